"""How well a structure answers for its numbers: misfit over the measurement's scatter, and a price for each number.

Whether a fitted structure can be the aircraft's: misfits beyond what the measurement scatters, and where they lie.

J up to 100 counts as acceptable, but a wrong structure often stays below it: its modes are then confidently wrong. The
responses' own random errors tell: what misses them by several times their scatter is no bad luck, but something that
the structure lacks.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.frequency.fitted_pairs import TWINS
from swashplate.identification.frequency.response_cost import Target, log_error
from swashplate.identification.frequency.state_space_search import answers
from swashplate.identification.responses.frequency_response import TWO_PI
from swashplate.models.linear.composition import PREFIX, nonsense, pairs_of, parts_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.structure_parts import INPUTS, PARTS

_HEAVE, _YAW = ("w", "az"), ("r",)
_TURNING, _FORCES = ("p", "q"), ("u", "v", "ax", "ay", "phi", "theta")
_CYCLIC = (("p", "lateral"), ("q", "longitudinal"))

BEHIND: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "flap": ((*_TURNING, *_FORCES), ()),
    "bar": (_TURNING, ("lateral", "longitudinal")),
    "inflow": (_HEAVE, ("collective",)),
    "torque": (_YAW, ("collective",)),
    "droop": ((*_HEAVE, *_YAW), ("collective",)),
    "gyro": (_YAW, ("pedal",)),
    "hub": (_TURNING, ("lateral", "longitudinal")),
    "forces": (_FORCES, ("lateral", "longitudinal")),
    "actuators": ((*_TURNING, *_YAW, *_HEAVE), ()),
    "coupled": (_FORCES + _HEAVE + _TURNING + _YAW, ()),
}
"""Outputs and inputs (none: any) of the responses that show a part first, the likeliest part first."""

_MOST = 3


def parts_in(model: StateSpaceModel) -> tuple[str, ...]:
    """The parts that a model has: those that it was composed of, otherwise those whose states it has."""
    composed = str(model.document.get("composed", ""))
    if composed:
        return parts_of(composed)
    states = set(model.states)
    parts = [name for name, part in PARTS.items() if part.states and set(part.states) <= states]
    if "flap" in parts:
        crossed = {"Ab", "Ba"} & set(model.parameters)
        parts.remove("flap_decoupled" if crossed else "flap")
    core = [name for name in parts if PARTS[name].core]
    if "body" in core:
        parts = [name for name in parts if name not in ("cyclic", "heave", "yaw")]
    by_letters = {"hub": {"La", "Mb"}, "forces": {"Xa", "Yb"}, "coupled": {"Xv", "Zu", "Yw"}}
    parts += [name for name, letters in by_letters.items() if letters <= set(model.parameters)]
    return tuple(name for name in PARTS if name in parts)


def candidates(parts: Sequence[str], missed: Sequence[tuple[str, str]]) -> dict[str, list[str]]:
    """Parts that may be lacking, each with the responses that speak for it; all the same ones are one.

    Args:
        parts: that are there.
        missed: output and input of the missed responses, the worst first.
    """
    lacking: dict[str, list[str]] = {}
    for name, (outputs, inputs) in BEHIND.items():
        present = {*parts, *(["flap"] if "flap_decoupled" in parts and name != "flap" else [])}
        if name in present:
            continue
        others = [p for p in parts if not (name == "flap" and p == "flap_decoupled")]
        if nonsense([*others, name]):
            continue
        pairs = [f"{o} / {i}" for o, i in missed if o in outputs and (not inputs or i in inputs)]
        if name == "flap" and "flap_decoupled" in parts:
            pairs = [f"{o} / {i}" for o, i in missed if o in _TURNING and (o, i) not in _CYCLIC]
        if pairs:
            lacking[name] = pairs
    return lacking


def lacking_words(model: StateSpaceModel, missed: Sequence[str]) -> str:
    """What this structure may lack, in words that begin with a space; empty where nothing is known.

    Args:
        model: the structure. missed: "output / input" of the responses that it misses, the worst first.
    """
    parts = parts_in(model)
    known = {*INPUTS, *TWINS}
    if not any(name in PARTS and PARTS[name].core for name in parts) or not known >= set(model.inputs):
        return ""
    pairs = [(o, i) for o, _, i in (name.partition(" / ") for name in missed)]
    lacking = candidates(parts, pairs)
    if not lacking:
        return " It has every part that these responses could speak for: look at the trim, gusts and the signals."
    best = sorted(lacking, key=lambda name: _rank(lacking[name], pairs))
    if "flap_decoupled" in parts and "flap" in lacking:
        best = ["flap", *(name for name in best if name != "flap")]
    named = ", ".join(f"'{name}' ({lacking[name][0]})" for name in best[:_MOST])
    text = f" The parts that may be lacking are {named}."
    if composed := str(model.document.get("composed", "")):
        first = best[0]
        kept = [p for p in parts if not (first == "flap" and p == "flap_decoupled")]
        tried = [*(p for p in PARTS if p in (*kept, first)), *pairs_of(composed)]
        text += f" Try {PREFIX}{'+'.join(tried)}, or --search."
    else:
        text += " Compose one with it (swash vehicle structures), or let --search find the parts."
    return text


def _rank(speaking: Sequence[str], missed: Sequence[tuple[str, str]]) -> int:
    """Place of the worst response that speaks for a part."""
    names = [f"{o} / {i}" for o, i in missed]
    return min(names.index(name) for name in speaking)


MANY = 3.0
"""Times its scatter by which a response has to be missed to count."""

_ONE_END = 0.7
"""Share of the misfit in one half of the band (in log frequency) from which that half is named."""

_KEPT = 0.9
"""Share of a response's points that counts, the worst left out."""

_NAMED = 6


@dataclass(frozen=True)
class Misfit:
    """A response that the model misses.

    Attributes:
        name: of the pair. times: its scatter, by which it is missed (rms, without its worst points).
        omega: frequencies [rad/s]. squared: squared misfit over squared scatter at each.
    """

    name: str
    times: float
    omega: Array
    squared: Array


def misfits(model: StateSpaceModel, targets: Sequence[Target]) -> tuple[Misfit, ...]:
    """What a model misses by more than `MANY` times the measurement's scatter, the worst first.

    Args:
        model: with its numbers. targets: fitted responses; those without known errors are passed over.
    """
    missed = []
    for t, h in zip(targets, answers(model, targets), strict=True):
        if t.error is None:
            continue
        # The random error is that of the modulus; real and imaginary part scatter alike.
        squared = np.abs(log_error(h, t.measured)) ** 2 / (2.0 * scatter(t) ** 2)
        # A tenth of the points may be a notch that windows and model see elsewhere; a wrong structure misses more.
        times = float(np.sqrt(np.mean(np.sort(squared)[: round(_KEPT * squared.size)])))
        if times > MANY:
            missed.append(Misfit(t.name, times, t.omega, squared))
    return tuple(sorted(missed, key=lambda one: -one.times))


def misfit_words(model: StateSpaceModel, targets: Sequence[Target], *, advise: bool = True) -> list[str]:
    """That a structure cannot be the aircraft's, in words: which responses, how far off, at which end of the band.

    Args:
        model: with its numbers. targets: fitted responses. advise: whether to say what it may lack.
    """
    missed = misfits(model, targets)
    if not missed:
        return []
    named = ", ".join(f"{one.name} ({one.times:.0f} times)" for one in missed[:_NAMED])
    named += f" and {len(missed) - _NAMED} more" if len(missed) > _NAMED else ""
    text = (
        f"this structure is not all of the aircraft: {len(missed)} of {len(targets)} responses are missed by more than "
        f"{MANY:g} times their scatter: {named}{_where(missed)}. Do not trust modes or derivatives that rest on them."
    )
    text += lacking_words(model, [one.name for one in missed]) if advise else ""
    speeds = [n for s, n in model.trim.items() if s in ("u", "v", "w")]
    if speeds and all(model.parameters[n].value == 0.0 for n in speeds):
        text += f" If this was not flown in hover, say so: --fix {speeds[0]}=..."
    return [text]


def _where(missed: Sequence[Misfit]) -> str:
    low, high = (end(one.omega[k] for one in missed) for end, k in ((min, 0), (max, -1)))
    middle = float(np.sqrt(low * high))
    total = sum(float(np.sum(one.squared)) for one in missed)
    upper = sum(float(np.sum(one.squared[one.omega > middle])) for one in missed) / total
    if upper > _ONE_END:
        return f", mostly above {middle / TWO_PI:.2g} Hz"
    if upper < 1.0 - _ONE_END:
        return f", mostly below {middle / TWO_PI:.2g} Hz"
    return ", all over the band"


FLOOR = 0.03
"""Relative error that every response is granted: 0.26 dB or 1.7 degrees of windows, filters and sampling."""

_LINEAR = 5.0
"""Scatters from which a misfit counts linearly (Huber 1964): a notch is no wrong structure."""

_TOGETHER = 2.0
"""Times that a misfit is counted, because neighbouring lines err together."""


def scatter(target: Target) -> Array:
    """The relative error of a measured response that counts as one, shape (n,)."""
    return np.asarray(np.sqrt((0.0 if target.error is None else target.error) ** 2 + FLOOR**2))


def robust(times: Array) -> Array:
    """Weights of errors that are so many scatters large: one up to `_LINEAR`, beyond it what Huber gives them."""
    return np.asarray(np.minimum(1.0, _LINEAR / np.maximum(times, 1e-300)))


def squared_misfit(model: StateSpaceModel, targets: Sequence[Target]) -> float:
    """Sum over all points of the squared misfit over the measurement's scatter; two degrees of freedom a point."""
    total = 0.0
    for t, h in zip(targets, answers(model, targets), strict=True):
        times = np.abs(log_error(h, t.measured)) / scatter(t)
        if not np.all(np.isfinite(times)):
            return float("inf")
        total += float(np.sum(np.where(times < _LINEAR, times**2, _LINEAR * (2.0 * times - _LINEAR))))
    return total


def spread_of(misfit: float, points: int, parameters: int) -> float:
    """Variance of the scatter over what it should be, as a fit leaves it; never below one.

    Args:
        misfit: of the fit. points: that were fitted. parameters: that were free.
    """
    return max(1.0, misfit / max(2.0 * points - parameters, 1.0))


HIDDEN = 10.0
"""Points that a part with states of its own costs besides its numbers: it can take many shapes, of which the best was
taken, and what is built into an aircraft must not be invented."""


def score(misfit: float, parameters: int, *, hidden: int, spread: float, points: int) -> float:
    """Bayes' information criterion with overdispersion (Schwarz 1978; Burnham and Anderson 2002, sec. 2.5).

    Args:
        misfit: `squared_misfit`. parameters: that were fitted. hidden: parts with states of their own (`hidden`).
        spread: variance of the scatter over what it should be, 1 and more. points: that were fitted.
    """
    return misfit / (_TOGETHER * spread) + parameters * np.log(2.0 * points / _TOGETHER) + HIDDEN * hidden


def hidden(parts: Iterable[str]) -> int:
    """How many of these parts have states that are not the body's."""
    return sum(bool(PARTS[name].states) and not PARTS[name].core for name in parts if name in PARTS)
