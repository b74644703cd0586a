"""Rate-loop gains for ArduPilot, Rotorflight or Betaflight, from an identified model, and what they buy.

ArduPilot's parameters are ATC_RAT_*_FF, _P, _I, _D and the filters _FLTT, _FLTE, _FLTD (`rate_loop`), which belong to
the loop, and so to the suggestion; Rotorflight's are `roll_p_gain`, Betaflight's `p_roll` and its like
(`rate_gain_names`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.control.analysis.gain_changes import gain_changes
from swashplate.control.analysis.gain_premises import refused_by_flight, refused_by_sign
from swashplate.control.analysis.kept_margins import GAIN_MARGIN, PEAK, PHASE_MARGIN, keeps_margins, keeps_with_angle
from swashplate.control.analysis.rate_gain_names import (
    ARDUPILOT,
    BETAFLIGHT,
    axes_of,
    beware,
    filters_of,
    gain_text,
    names_of,
    representable,
    short,
    written,
)
from swashplate.control.analysis.rate_loop import (
    HALF_POWER,
    LOWEST,
    NO_FIGURES,
    SEEN,
    LoopFigures,
    RateLoop,
    couplings,
)
from swashplate.control.analysis.rate_loop_steps import RateSteps, rate_loop_steps
from swashplate.errors import IdentificationError
from swashplate.identification.core.result import Result
from swashplate.identification.frequency.handling import ResponseMargins
from swashplate.identification.frequency.reading_accuracy import Fitted
from swashplate.models.linear.linear_vehicle import structure_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle
from swashplate.shown import Shown

OVERSHOOT = 0.3
"""Of a demand that steps at once; the filter of the demand (FLTT) is the fastest that keeps it."""

_SLOW = 2.0 * np.pi * 0.2
"""rad/s: unstable modes below it are the attitude loop's or the pilot's, not the rate loop's."""
_SHARES = {"P": np.geomspace(20.0, 0.02, 50), "D": np.array([0.2, 0.1, 0.05, 0.0]), "I": np.array([0.5, 0.25, 0.1])}
"""Shares: P of one over the steady rate, D of a tenth of P, I of the feed-forward or else of P / 5."""
_STEEP = np.array([0.6, 0.4, 0.3])
"""Shares of D for Betaflight's roll and pitch too, whose motors are late by some 0.05 s."""
_QUICK = np.geomspace(400.0, 0.1, 60)
"""Shares of P for Betaflight: one over the rate at the slow end of a plant that integrates up to 20 rad/s is small."""
_STRONG = 15.0
"""rad/s up to which Betaflight's loops hold disturbances down."""
_FADED = np.array([1.5, 0.5])
"""1/s, I over P that are tried too: a disturbance that lasts must fade although the steady rate is large."""
_HELD = np.array([20.0, 8.0, 3.0, 1.0])
"""1/s, I over P where the integral of the rate holds the attitude (Rotorflight)."""
_NEARLY = 0.9
_DEMAND = (20.0, 10.0, 7.0, 5.0, 3.0, 2.0)
"""Hz: filters of the demand that are tried."""


@dataclass(frozen=True, repr=False)
class Suggestion(Shown):
    """Gains of one axis.

    Attributes:
        axis: "RLL", "PIT" or "YAW"; Rotorflight's are "roll", "pitch", "yaw", Betaflight's "Roll", "Pitch", "Yaw".
        parameters: by the firmware's names; none where they are refused.
        figures: what they are worth on the model, with what the fit's bounds make of the margins.
        flown: the log's own gains (none where it does not hold them), and what they are worth.
        buys, costs: what the suggestion betters and worsens, from flown to suggested.
        words: what it is, and what to do first.
        loop: the axis' loop without gains.
    """

    axis: str
    parameters: dict[str, float]
    figures_suggested: LoopFigures
    flown: dict[str, float]
    figures_flown: LoopFigures
    loop: RateLoop
    words: str = ""
    buys: tuple[str, ...] = ()
    costs: tuple[str, ...] = ()

    @property
    def refused(self) -> str:
        """Why there are no gains; "" where there are."""
        return "" if self.parameters else self.words

    @property
    def margins(self) -> ResponseMargins:
        return self.figures_suggested.margins

    @property
    def flown_margins(self) -> ResponseMargins:
        return self.figures_flown.margins

    @property
    def peak(self) -> float:
        return self.figures_suggested.peak

    @property
    def flown_peak(self) -> float:
        return self.figures_flown.peak

    @property
    def trade(self) -> tuple[str, ...]:
        """What changes against the flown gains, in words; empty where none were logged or judged."""
        if not (self.buys or self.costs):
            return ()
        return f"better than flown: {', '.join(self.buys) or 'nothing'}", f"worse: {', '.join(self.costs) or 'nothing'}"

    def steps(self) -> dict[str, RateSteps]:
        """How the loop answers a step of the demand and a disturbance: "suggested" and "flown", where there are any."""
        judged = {"suggested": (self.parameters, self.peak), "flown": (self.flown, self.flown_peak)}
        structure, sets = self.loop.structure, {n: k for n, (k, peak) in judged.items() if np.isfinite(peak)}
        if structure is None:
            return {}
        return {
            which: rate_loop_steps(
                structure, gains, rate=self.loop.rate, command=self.loop.command, gyro_filter=self.loop.gyro_filter
            )
            for which, gains in sets.items()
            if {"P", "I", "D", "FF"} & set(short(gains))
        }

    def to_document(self) -> dict[str, object]:
        """Numbers and words as JSON types."""

        def read(f: LoopFigures) -> dict[str, Any]:
            return {name: value for name, value in vars(f).items() if name != "margins"}

        def margins(f: LoopFigures) -> dict[str, list[float]]:
            return {name: [r.value, r.sigma] for name, r in vars(f.margins).items()}

        document: dict[str, Any] = {k: v for k, v in vars(self).items() if k != "loop"}
        document |= {"figures_suggested": read(self.figures_suggested), "figures_flown": read(self.figures_flown)}
        document |= {"margins": margins(self.figures_suggested), "flown_margins": margins(self.figures_flown)}
        return document | {"refused": self.refused}

    def table(self) -> list[tuple[str, str, str]]:
        """What the loop is worth: a name with its unit, suggested, flown."""
        columns = [_figure_rows(f) for f in (self.figures_suggested, self.figures_flown)]
        coupled = any(np.isfinite(f.coupling) for f in (self.figures_suggested, self.figures_flown))
        return [(name, ours, theirs) for (name, ours), (_, theirs) in zip(*columns, strict=True)][
            : None if coupled else -1
        ]

    def __repr__(self) -> str:
        lines = [f"{self.axis}: {self.words}"]
        if self.parameters or self.flown:
            lines.append(f"  {'':<30}{'suggested':>18}{'flown':>18}")
        for name in self.parameters or self.flown:
            cells = [gain_text(name, k[name]) if name in k else "-" for k in (self.parameters, self.flown)]
            lines.append(f"  {name:<30}{cells[0]:>18}{cells[1]:>18}")
        if np.isfinite(self.peak) or np.isfinite(self.flown_peak):
            lines += [f"  {name:<30}{cells[0]:>18}{cells[1]:>18}" for name, *cells in self.table()]
        lines += [f"  {line}" for line in self.trade]
        return "\n".join(lines)


def _figure_rows(f: LoopFigures) -> list[tuple[str, str]]:
    judged = np.isfinite(f.peak)

    def number(value: float, scale: float = 1.0) -> str:
        return f"{scale * value:.3g}" if np.isfinite(value) else "-"

    def margin(text: str) -> str:
        return text if judged else "-"

    return [
        ("phase margin [deg]", margin(f"{f.margins.phase_margin!r}")),
        ("gain margin [dB]", margin(f"{f.margins.gain_margin!r}")),
        ("delay margin", margin(f.margins.delay_in_words())),
        ("crossover [rad/s]", margin(f"{f.margins.crossover!r}")),
        ("largest sensitivity", number(f.peak)),
        ("bandwidth [rad/s]", number(f.bandwidth)),
        ("disturbance rejection [rad/s]", number(f.rejection)),
        ("overshoot of a step [%]", number(f.overshoot, 100.0)),
        ("largest disturbed rate [deg/s]", number(np.degrees(f.shaken))),
        ("left of it after 2 s [deg/s]", number(np.degrees(f.left))),
        ("gyro noise in command [s/rad]", number(f.noise)),
        ("coupling into other rates", number(f.coupling)),
    ]


def suggest_gains(
    model: Vehicle | StateSpaceModel | Fitted,
    *,
    autopilot: Mapping[str, float] | None = None,
    sources: Mapping[str, str] | None = None,
    premise: Callable[[str, str], str] | None = None,
) -> tuple[Suggestion, ...]:
    """Feed-forward and gains for every axis whose rate and mixer command the model joins, and what they buy.

    Feed-forward: one over the steady rate per command, so that a commanded rate is reached without an error; none where
    the rate settles slowly or not at all (yaw without much damping). P, I and D: of a grid, those that reject
    disturbances fastest among all that keep 45 degrees, 6 dB and a sensitivity peak below two at every crossing, with
    the model's own delay and the controller's filters. The demand's filter: the fastest with which a step of the demand
    overshoots by no more than 30 %, or least. Other axes are left open while an axis is judged; the coupling is that
    with all loops closed. Where nothing that was tried is better than the flown gains, these are kept. No gains are
    given where a premise does not hold (`gain_premises`).

    Args:
        model: a model, or a fit, whose bounds the margins then get.
        autopilot: parameters of the log by name: filters, the gains that were flown, INS_GYRO_FILTER. With
            Rotorflight's or Betaflight's among them the suggestion is in their names and whole numbers.
        sources: the log's channel behind a model's, where their names differ. A rate of SIDD (`p_sid`) has not passed
            the gyro filter, which the loop has.
        premise: of a rate and its command, why the data behind the model carry no gains, "" where they do; None for a
            model whose numbers do not come from data.
    """
    known, behind = dict(autopilot or {}), dict(sources or {})
    fit, answering = (model, model.solution) if isinstance(model, Result) else (None, structure_of(model))
    suggestions = []
    for axis, (rate, command) in axes_of(known).items():
        rates = [o for o in answering.outputs if behind.get(o, o) in (rate, f"{rate}_sid")]
        commands = [i for i in answering.inputs if behind.get(i, i) == command]
        if rates and commands:
            raw = behind.get(rates[0], rates[0]) != rate
            gyro = known.get("INS_GYRO_FILTER", 0.0) if raw else 0.0
            filters = filters_of(axis, known)
            loop = RateLoop(answering, axis, rates[0], commands[0], filters, gyro, _in_time(model), fit)
            suggestions.append(_suggest(loop, known, premise(rates[0], commands[0]) if premise else ""))
    return tuple(_with_words(s, beware(s.axis, known)) for s in _with_coupling(suggestions))


def _in_time(model: Vehicle | StateSpaceModel | Fitted) -> StateSpaceModel | None:
    """What can be stepped; None for transfer functions with more zeros than poles."""
    try:
        return structure_of(model.model if isinstance(model, Result) else model)
    except IdentificationError:
        return None


def _suggest(loop: RateLoop, known: Mapping[str, float], refused: str) -> Suggestion:
    names = names_of(loop.axis)
    logged = {name: known[name] for name in names.values() if name in known}

    def none(reason: str, as_flown: LoopFigures = NO_FIGURES) -> Suggestion:
        return Suggestion(loop.axis, {}, NO_FIGURES, logged, as_flown, loop, f"none: {reason}")

    if refused:
        return none(refused)
    if loop.unstable >= _SLOW:
        return none(
            f"the model has an unstable mode at {loop.unstable:.3g} rad/s, which no margin of a stable loop judges."
        )
    omega = _judged_at(loop)
    as_flown = loop.figures(logged, omega) if names["P"] in logged else NO_FIGURES
    if refuted := refused_by_flight(logged, as_flown.margins):
        return none(refuted)
    gains = _best(loop, omega)
    if gains is None:
        required = f"{PHASE_MARGIN:g} degrees, {GAIN_MARGIN:g} dB and a sensitivity of {PEAK:g}"
        return none(f"no gains tried that the firmware can hold keep {required}.", as_flown)
    if turned := refused_by_sign(short(gains)):
        return none(turned, as_flown)
    suggestion = Suggestion(loop.axis, gains, loop.figures(gains, omega), logged, as_flown, loop)
    if np.isfinite(as_flown.peak) and not any(good for _, good in gain_changes(as_flown, suggestion.figures_suggested)):
        return replace(suggestion, parameters=logged, figures_suggested=as_flown)
    return suggestion


def _judged_at(loop: RateLoop) -> Array:
    return np.asarray(SEEN[max(LOWEST, 3.0 * loop.unstable) <= SEEN])


def _best(loop: RateLoop, omega: Array) -> dict[str, float] | None:
    """The gains, None where none keep the margins."""
    steady = np.isfinite(loop.steady)
    if steady:
        one = 1.0 / loop.steady
    else:  # an integrator's phase is -90 degrees there
        middle = complex(loop.plant(np.array([_SLOW]))[0])
        one = float(np.sign((1j * middle).real or 1.0) / abs(middle))
    holds = loop.axis not in ARDUPILOT  # no attitude loop stands behind its integral
    ours = np.arange(float(_HELD.size if holds else _SHARES["I"].size + _FADED.size))
    leans = loop.axis in BETAFLIGHT and loop.axis != "Yaw"
    slopes = np.concatenate([_STEEP, _SHARES["D"]]) if leans else _SHARES["D"][-1 if loop.axis in BETAFLIGHT else 0 :]
    shares = _QUICK if loop.axis in BETAFLIGHT else _SHARES["P"]
    tried = np.meshgrid(shares, slopes, ours, indexing="ij")
    share, slope, which = (np.ravel(np.asarray(x, dtype=np.float64)) for x in tried)
    p: Array = one * share
    of_one = _SHARES["I"][:, None] * (one if steady else 0.2 * p) * np.ones(p.size)
    rows = _HELD[:, None] * p if holds else np.concatenate([of_one, _FADED[:, None] * p])
    integral: Array = np.asarray(rows[which.astype(np.int64), np.arange(p.size)], dtype=np.float64)
    grid: dict[str, Array] = {
        "FF": np.full(p.size, one if steady and loop.axis not in BETAFLIGHT else 0.0),
        "P": p,
        "I": integral,
        "D": slope * 0.1 * p,
        **{name: np.full(p.size, value) for name, value in loop.filters.items()},
    }
    grid = representable(loop.axis, grid)
    if not grid["P"].size:
        return None
    loops = _loops(loop, grid, omega)
    kept = keeps_margins(loops)
    if loop.axis in BETAFLIGHT and loop.fit is not None:  # beyond what was fitted nobody has seen a crossover
        last = max(float(target.omega[-1]) for target in loop.fit.targets)
        kept &= np.abs(loops[:, min(int(np.searchsorted(omega, last)), omega.size - 1)]) < 1.0
    if leans:
        ahead = np.stack([loop.ahead(gains, omega) for gains in _sets(grid)]) * loop.plant(omega)
        kept &= keeps_with_angle(omega, loops, ahead)
    if not kept.any():
        return None
    sensitivity = np.abs(1.0 / (1.0 + loops[kept]))
    rejected = omega[np.argmax(sensitivity > HALF_POWER, axis=1)]
    # Of those that are nearly the fastest, the one whose integral takes a lasting disturbance away first.
    slow = rejected < _NEARLY * rejected.max()
    if loop.axis in BETAFLIGHT:
        slow = np.log(sensitivity[:, omega <= _STRONG]).mean(axis=1)
    ranked = np.flatnonzero(kept)[np.lexsort((sensitivity.max(axis=1), -np.abs(grid["I"][kept]), slow))]
    best = int(ranked[0])
    if holds:  # no filter of the demand takes an overshoot away
        beyond = loop.overshoots({name: value[ranked] for name, value in grid.items()})
        beyond = np.nan_to_num(beyond, nan=0.0 if loop.structure is None else np.inf)
        best = int(ranked[np.argmax(beyond <= max(OVERSHOOT, beyond.min()))])
    chosen = {name: float(value[best]) for name, value in grid.items()}
    if "FLTT" not in names_of(loop.axis):
        return written(loop.axis, chosen)
    filters = {name: np.full(len(_DEMAND), value) for name, value in chosen.items()} | {"FLTT": np.array(_DEMAND)}
    overshoot = np.nan_to_num(loop.overshoots(filters), nan=0.0 if loop.structure is None else np.inf)
    quick = np.flatnonzero(overshoot <= max(OVERSHOOT, overshoot.min()))[0]
    chosen["FLTT"] = _DEMAND[quick]
    return written(loop.axis, chosen)


def _loops(loop: RateLoop, grid: Mapping[str, Array], omega: Array) -> Complex:
    """Broken loops of m sets of gains, shape (m, n)."""
    return np.stack([loop.controller(gains, omega) for gains in _sets(grid)]) * loop.plant(omega)


def _sets(grid: Mapping[str, Array]) -> Iterator[dict[str, float]]:
    return ({name: float(value[k]) for name, value in grid.items()} for k in range(grid["P"].size))


def _with_coupling(single: Sequence[Suggestion]) -> list[Suggestion]:
    """With what the axes do to each other, where all of them have gains."""
    suggestions, loops = list(single), tuple(s.loop for s in single)
    for gains, figures in (("parameters", "figures_suggested"), ("flown", "figures_flown")):
        sets = tuple(getattr(s, gains) for s in single)
        if all({"P", "I", "D", "FF"} & set(short(k)) for k in sets) and all(np.isfinite(s.peak) for s in single):
            joined = couplings(loops, sets, SEEN)
            suggestions = [
                replace(s, **{figures: replace(getattr(s, figures), coupling=value)})
                for s, value in zip(suggestions, joined, strict=True)
            ]
    return suggestions


def _with_words(s: Suggestion, besides: str) -> Suggestion:
    if s.words:
        return s
    if s.parameters == s.flown:
        return replace(s, words=f"Keep what you fly: nothing that was tried is better.{besides}")
    changes = gain_changes(s.figures_flown, s.figures_suggested)
    buys = tuple(text for text, good in changes if good)
    costs = tuple(text for text, good in changes if not good)
    ahead = s.axis not in BETAFLIGHT
    text = (
        f"Keeps {PHASE_MARGIN:g} degrees and {GAIN_MARGIN:g} dB on the model, one axis at a time. Fly "
        f"{'the feed-forward first with P, I and D at a third' if ahead else 'P, I and D at a third first'}, then "
        "raise them."
    )
    if s.figures_suggested.overshoot > OVERSHOOT:
        size = f"{100.0 * s.figures_suggested.overshoot:.0f} %"
        text += f" A step of the demand overshoots by {size} with the slowest filter tried: give it soft demands."
    if not s.flown:
        text += " The log holds no flown gains: there is nothing to compare with."
    text += besides
    if ahead and not np.isfinite(s.loop.steady):
        text += " Under a steady command the rate settles slowly or not at all: no feed-forward."
    if s.loop.unstable:
        text += f" The slow mode that grows ({s.loop.unstable:.2g} rad/s) is left to the attitude loop."
    return replace(s, words=text, buys=buys, costs=costs)
