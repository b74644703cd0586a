"""Rate-loop feed-forward and gains for ArduPilot's helicopter code, from an identified model, with their margins.

ArduPilot's rate controller gives the mixer command u = FF target + P e + I int e + D de/dt, with the rate error e in
rad/s behind a first-order filter (FLTE), and one more on the derivative (FLTD): parameters ATC_RAT_*_FF, _P, _I, _D,
_FLTE, _FLTD. The filters belong to the loop, and so to the suggestion.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.identification.frequency.handling import ReadNumber, ResponseMargins, margins
from swashplate.identification.frequency.handling_readings import model_margins
from swashplate.identification.frequency.reading_accuracy import Fitted, response_of
from swashplate.models.linear.linear_vehicle import structure_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle

PHASE_MARGIN, GAIN_MARGIN, PEAK = 45.0, 6.0, 2.0
"""Degrees, decibels and largest sensitivity that every suggestion keeps."""

AXES = {"RLL": ("p", "mixer_roll"), "PIT": ("q", "mixer_pitch"), "YAW": ("r", "mixer_yaw")}
_FILTER = 20.0  # Hz: FLTE where the log does not say it, and FLTD of a suggestion
_GAINS = ("FF", "P", "I", "D", "FLTE", "FLTD")
_LOWEST = 2.0 * np.pi * 0.05
_SEEN = np.geomspace(_LOWEST, 2.0 * np.pi * 40.0, 1500)
_SLOW = 2.0 * np.pi * 0.2
"""rad/s: unstable modes below it are the attitude loop's or the pilot's, not the rate loop's."""
_INTEGRATES = 2.0
"""Gain at 0.1 Hz over that at 0.4 Hz from which a rate has no steady value to feed forward."""


@dataclass(frozen=True, repr=False)
class Suggestion:
    """Gains of one axis.

    Attributes:
        axis: "RLL", "PIT" or "YAW".
        parameters: by ArduPilot's names; none where no gains keep the margins.
        margins: of the broken rate loop with these gains, with what the fit's bounds make of them.
        peak: largest closed-loop sensitivity |1/(1+L)|.
        flown: the log's own gains (none where it does not hold them), and their margins and peak.
        words: what it is, and what to do first.
    """

    axis: str
    parameters: dict[str, float]
    margins: ResponseMargins
    peak: float
    words: str
    flown: dict[str, float]
    flown_margins: ResponseMargins
    flown_peak: float

    def as_dict(self) -> dict[str, Any]:
        """Numbers and words as JSON types."""

        def read(m: ResponseMargins) -> dict[str, list[float]]:
            return {name: [r.value, r.sigma] for name, r in vars(m).items()}

        told = {"margins": read(self.margins), "flown_margins": read(self.flown_margins)}
        return {**vars(self), **told}

    def __repr__(self) -> str:
        words = f"{self.axis}: {_margin_words(self.margins, self.peak) if self.parameters else self.words}\n"
        if self.flown:
            words += f"  {'parameter':<18}{'suggested':>10}{'flown':>10}\n"
        for name in self.parameters or self.flown:
            cells = f"{self.parameters[name]:>10.4f}" if name in self.parameters else f"{'':>10}"
            words += f"  {name:<18}{cells}" + (f"{self.flown[name]:>10.4f}" if name in self.flown else "") + "\n"
        if self.flown:
            words += f"  as flown: {_margin_words(self.flown_margins, self.flown_peak)}\n"
        return f"{words}  {self.words}" if self.parameters else words.rstrip("\n")


def _margin_words(m: ResponseMargins, peak: float) -> str:
    where = f" at {m.omega_180.value:.3g} rad/s" if m.omega_180.value > 0.0 else ""
    return (
        f"phase margin {m.phase_margin!r} deg, gain margin {m.gain_margin!r} dB{where}, largest sensitivity {peak:.2f}"
    )


def suggest_gains(
    model: Vehicle | StateSpaceModel | Fitted,
    *,
    autopilot: Mapping[str, float] | None = None,
    sources: Mapping[str, str] | None = None,
) -> tuple[Suggestion, ...]:
    """Feed-forward and gains for every axis whose rate and mixer command the model joins.

    Feed-forward: one over the steady rate per command, so that a commanded rate is reached without an error; none where
    the rate settles slowly or not at all (yaw without much damping). P, I and D: the largest P of a grid, with half the
    feed-forward as I (a tenth of P without feed-forward) and D up to a fiftieth of P, that keeps 45 degrees, 6 dB and a
    sensitivity peak below two at every crossing with the model's own delay and the controller's filters. Other axes are
    left open: cross-coupling is not compensated.

    Args:
        model: a model, or a fit, whose bounds the margins then get.
        autopilot: parameters of the log by name: FLTE, the gains that were flown, INS_GYRO_FILTER.
        sources: the log's channel behind a model's, where their names differ. A rate of SIDD (`p_sid`) has not passed
            the gyro filter, which the loop has.
    """
    known, behind = dict(autopilot or {}), dict(sources or {})
    model = structure_of(model) if isinstance(model, Vehicle) else model
    outputs, inputs = _channels(model)
    made = []
    for axis, (rate, command) in AXES.items():
        rates = [o for o in outputs if behind.get(o, o) in (rate, f"{rate}_sid")]
        commands = [i for i in inputs if behind.get(i, i) == command]
        if rates and commands:
            raw = behind.get(rates[0], rates[0]) != rate
            gyro = known.get("INS_GYRO_FILTER", 0.0) if raw else 0.0
            error = known.get(f"ATC_RAT_{axis}_FLTE", _FILTER)
            made.append(_suggest(_Loop(model, axis, rates[0], commands[0], error, gyro), known))
    return tuple(made)


def _channels(model: StateSpaceModel | Fitted) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Outputs and inputs."""
    held = model if isinstance(model, StateSpaceModel) else model.model
    if isinstance(held, StateSpaceModel):
        return held.outputs, held.inputs
    return tuple(m.output for m in held), (held[0].input,)


@dataclass(frozen=True)
class _Loop:
    """A rate loop without its gains: what the model answers, and what filters stand beside it [Hz]."""

    model: StateSpaceModel | Fitted
    axis: str
    rate: str
    command: str
    error_filter: float
    gyro_filter: float

    def plant(self, omega: Array) -> Complex:
        if isinstance(self.model, StateSpaceModel):
            h = self.model.response(omega)
            return np.asarray(h[:, self.model.outputs.index(self.rate), self.model.inputs.index(self.command)])
        return response_of(self.model, self.rate, self.command, omega)

    def controller(self, gains: Mapping[str, float], omega: Array) -> Complex:
        """From the rate to the command with its sign turned, gyro filter included where the model lacks it."""
        s: Complex = np.asarray(1j * omega, dtype=np.complex128)
        k = {name.rsplit("_", 1)[1]: value for name, value in gains.items()}
        pid = k.get("P", 0.0) + k.get("I", 0.0) / s + k.get("D", 0.0) * s * _first_order(s, k.get("FLTD", 0.0))
        c = 2.0 * np.pi * self.gyro_filter
        gyro = c**2 / (s**2 + np.sqrt(2.0) * c * s + c**2) if c > 0.0 else 1.0
        return np.asarray(pid * _first_order(s, k.get("FLTE", 0.0)) * gyro, dtype=np.complex128)

    def margins(self, gains: Mapping[str, float], omega: Array) -> tuple[ResponseMargins, float]:
        """Margins, with bounds where a fit has them, and the sensitivity's peak."""
        controller = self.controller(gains, omega)
        loop = np.asarray(controller * self.plant(omega), dtype=np.complex128)
        peak = float(np.max(np.abs(1.0 / (1.0 + loop))))
        if isinstance(self.model, StateSpaceModel):
            return margins(omega, loop), peak
        return model_margins(self.model, self.rate, self.command, omega, controller), peak

    @property
    def unstable(self) -> float:
        """Size of the fastest growing mode [rad/s], zero for none."""
        m = self.model if isinstance(self.model, StateSpaceModel) else self.model.model
        modes = m.eigenvalues() if isinstance(m, StateSpaceModel) else m[0].poles
        return float(np.max(np.abs(modes[modes.real > 1e-6]), initial=0.0))


def _first_order(s: Complex, hertz: float) -> Complex | float:
    return 1.0 / (1.0 + s / (2.0 * np.pi * hertz)) if hertz > 0.0 else 1.0


def _suggest(loop: _Loop, known: Mapping[str, float]) -> Suggestion:
    nothing = ResponseMargins(*[ReadNumber(float("nan"))] * 4)
    names = [f"ATC_RAT_{loop.axis}_{name}" for name in _GAINS]
    flown = {name: known[name] for name in names if name in known}
    unstable = loop.unstable
    omega = _SEEN[max(_LOWEST, 3.0 * unstable) <= _SEEN]
    as_flown = loop.margins(flown, omega) if names[1] in flown and unstable < _SLOW else (nothing, float("nan"))
    if unstable >= _SLOW:
        words = (
            f"none: the model has an unstable mode at {unstable:.3g} rad/s, which no margin of a stable loop judges."
        )
        return Suggestion(loop.axis, {}, nothing, float("nan"), words, flown, *as_flown)
    gains, steady = _best(loop, omega)
    if gains is None:
        words = f"none: no gains tried keep {PHASE_MARGIN:g} degrees, {GAIN_MARGIN:g} dB and a sensitivity of {PEAK:g}."
        return Suggestion(loop.axis, {}, nothing, float("nan"), words, flown, *as_flown)
    words = (
        f"Keeps {PHASE_MARGIN:g} degrees and {GAIN_MARGIN:g} dB on the model, one axis at a time. Fly the feed-forward "
        "first with P, I and D at a third, then raise them."
    )
    if not steady:
        words += " Under a steady command the rate settles slowly or not at all: no feed-forward."
    if unstable:
        words += f" The slow mode that grows ({unstable:.2g} rad/s) is left to the attitude loop."
    return Suggestion(loop.axis, gains, *loop.margins(gains, omega), words, flown, *as_flown)


def _best(loop: _Loop, omega: Array) -> tuple[dict[str, float] | None, bool]:
    """The gains, None where none keep the margins, and whether the rate has a steady value."""
    plant = loop.plant(omega)
    low, middle, high = loop.plant(2.0 * np.pi * np.array([0.1, 0.2, 0.4]))
    steady = bool(abs(low) < _INTEGRATES * abs(high))
    one = float(np.sign(middle.real or middle.imag or 1.0) / abs(middle))
    if not steady:  # an integrator's phase is -90 degrees there
        one = float(np.sign((1j * middle).real or 1.0) / abs(middle))
    name = f"ATC_RAT_{loop.axis}_"
    for p in one * np.geomspace(20.0, 0.02, 80):
        for share in (0.2, 0.1, 0.05, 0.02, 0.0):
            numbers = (one if steady else 0.0, p, 0.5 * one if steady else 0.1 * p, share * p * 0.1)
            gains = {name + k: float(v) for k, v in zip(_GAINS, (*numbers, loop.error_filter, _FILTER), strict=True)}
            if _keeps(np.asarray(loop.controller(gains, omega) * plant, dtype=np.complex128)):
                return gains, steady
    return None, steady


def _keeps(loop: Complex) -> bool:
    """Stable by Nyquist's count of a stable plant, and far enough from -1 at every crossing."""
    distance = np.abs(1.0 + loop)
    turns = np.unwrap(np.angle(1.0 + loop))
    encircled = abs(turns[-1] - turns[0]) > np.pi
    return bool(not encircled and distance.min() > 1.0 / PEAK and _margins_hold(loop))


def _margins_hold(loop: Complex) -> bool:
    size, phase = np.abs(loop), np.degrees(np.angle(loop))
    above = size > 1.0
    crossings = np.flatnonzero(above[:-1] != above[1:])
    if any(180.0 - abs(phase[k]) < PHASE_MARGIN for k in crossings):
        return False
    half_turns = np.flatnonzero(np.abs(np.diff(phase)) > 180.0)
    return all(size[k] < 10.0 ** (-GAIN_MARGIN / 20.0) for k in half_turns)


def loop_of(model: StateSpaceModel, suggestion: Suggestion, omega: Array) -> Complex:
    """The broken rate loop of a suggestion on a model, shape (n,)."""
    loop = _Loop(model, suggestion.axis, *AXES[suggestion.axis], _FILTER, 0.0)
    return np.asarray(loop.controller(suggestion.parameters, omega) * loop.plant(omega), dtype=np.complex128)
