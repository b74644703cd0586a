"""What sweeps in an autopilot's log say of a vehicle, beside its own linearisation: `respond` and the fits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.api.linear_study import LinearStudy
from swashplate.api.verbs.identify import fit_ss, fit_tf
from swashplate.arrays import Array, Complex
from swashplate.errors import FlightError, SwashError
from swashplate.flights.conditioning.uniform_records import uniform_records
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.ardupilot_chirp import Chirp
from swashplate.flights.maneuvers.sweeps import Sweep, sweeps
from swashplate.identification.core.result import Estimate
from swashplate.identification.responses.frequency_response import TWO_PI, FrequencyResponse
from swashplate.identification.responses.respond import respond
from swashplate.links.ardupilot.mixer_responses import MIXER_AXES
from swashplate.links.ardupilot.trial import TrialLine
from swashplate.models.linear.composition import is_composed
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.transfer_function import TransferFunction

GAIN, PHASE, SIGMAS = 1.0, 7.0, 3.0
"""dB and degrees that an estimate may be off the truth at most, or so many random errors where those are more."""
ROUNDED = 2.7
"""Degrees that whole microseconds turn a sine of the least amplitude that is swept (`trial_sweeps.RESOLVED`)."""
COHERENT = 0.8
"""Coherence from which on a line is judged."""
_SWEPT = "sid_target"
"""What System ID adds to the mixer: no loop feeds it back, so that the loops do not bias the estimate."""
_SURE = 0.01
"""Random error that an exact response is given."""
_LEAST_SHARE = 0.7
"""Share of the band that must be coherent, else the sweep has told too little."""
STRUCTURES: Mapping[tuple[str, ...], tuple[str, ...]] = {
    ("roll", "pitch"): (
        "rotor_body",
        "compose:body+flap+Lp+Llat+Mq+Mlon",  # a rotor and part of one, or two rotors, and their speeds
        "compose:cyclic+bar_rotor+actuators",  # the CoaX: the lower rotor lags its servos, the upper follows its bar
        "compose:body+flap+bar+hub",
        "compose:body+actuators+Yp+Xq",  # motors of a light multirotor, whose rotors feel its rates
    ),
    ("yaw",): ("yaw", "compose:yaw+reaction"),  # motors, whose reaction comes before the torque of their rotors
    ("heave",): ("heave", "compose:heave+actuators", "compose:heave+lead"),  # motors; two inflows or motors
}
"""Structures by the axes that they describe, the simplest first: the first that follows a vehicle is fitted to it."""
_ANSWERS = {"heave": "yaw"}
"""Whose loop answers an axis' sweep with a command of its own: to speed up two motors turns the vehicle."""
_ACTS = 0.05
"""Share of an axis' own response from which on that command's part in it is told apart, by the other's sweep."""
_COMPOSED = {"lateral": "roll", "longitudinal": "pitch", "pedal": "yaw", "collective": "heave"}
"""The axis of each input of a composed structure."""
FORMS: Mapping[str, tuple[str, ...]] = {
    "roll": ("0/2", "1/3"),
    "pitch": ("0/2", "1/3"),
    "yaw": ("0/1", "1/2"),
    "heave": ("1/1", "1/2"),
}
"""Zeros over poles of an axis in hover: a rotor that tilts, and a body that is damped; az of one that climbs. With one
pole more: motors behind the rotors."""
_FOLLOWS = 0.5
"""Of what an estimate may be off, how far a form may be off the vehicle that flew when it is fitted to just that."""

Truth = Callable[[str, str, Array], Complex]
"""Response of an axis' command to a channel ("p") over frequency [rad/s]."""


@dataclass
class TruthBeside:
    """Estimates of the axes that were swept.

    Attributes:
        lines: verdicts.
        curves: by (output, input), by name ("truth", "respond", ...): frequencies [rad/s] and the response.
        models: transfer functions that were fitted, in words.
        structures: parameters of the state-space structures that were fitted, by their axes.
        remarks: what the estimates themselves warn of.
    """

    lines: list[TrialLine] = field(default_factory=list)
    curves: dict[tuple[str, str], dict[str, tuple[Array, Complex]]] = field(default_factory=dict)
    models: list[str] = field(default_factory=list)
    structures: dict[str, Sequence[Estimate]] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)


def beside_truth(
    flight: Flight, flown: Mapping[str, Chirp], truth: Truth, own: Truth, *, rate: float, loop: float
) -> TruthBeside:
    """Take a log through `respond`, `fit_tf` and `fit_ss`, and judge each against the truth.

    The phase that a response may be off is what rounded pulses turn it (`ROUNDED`) and half a loop, for stamps are of
    whole loops; of a fit, also what its form misses when it is fitted to the vehicle's own linearisation.

    A form or structure that cannot follow the vehicle that flew, fitted to its own linearisation, is told and not
    judged: it would speak of itself. What `respond` gives is always judged.

    Args:
        flight: as logged, with a System ID sweep for each axis.
        flown: the sweeps by axis.
        truth: what the estimates are held against. own: of the vehicle that flew.
        rate: of the records [Hz]. loop: of the autopilot [Hz].
    """
    comparison = TruthBeside()
    by_axis = _sweeps_by_axis(flight, flown, comparison)
    axes = [axis for axis in MIXER_AXES if axis in by_axis]
    for together in _grouped(axes):
        try:
            parts, others = [by_axis[axis] for axis in together], _answering(together, by_axis, flown, own)
            _judge(flight, parts, others, together, flown, truth, own, rate, loop, comparison)
        except SwashError as error:
            comparison.lines.append(TrialLine(f"{' and '.join(together)}: estimate", str(error), "an estimate", False))
    return comparison


def _grouped(axes: Sequence[str]) -> list[tuple[str, ...]]:
    """Axes that one structure describes together; those whose partner was not swept alone."""
    groups = [group for group in STRUCTURES if set(group) <= set(axes)]
    taken = {axis for group in groups for axis in group}
    return [*groups, *((axis,) for axis in axes if axis not in taken)]


def _answering(
    axes: Sequence[str], by_axis: Mapping[str, Sweep], flown: Mapping[str, Chirp], own: Truth
) -> dict[str, Sweep]:
    """Sweeps of other axes whose commands move along and act on what these axes answer with."""
    answering = {}
    for axis in axes:
        other = _ANSWERS.get(axis)
        if other in by_axis:
            omega = TWO_PI * np.geomspace(flown[axis].start_hz, flown[axis].stop_hz, 20)
            output = MIXER_AXES[axis].output
            if np.median(np.abs(own(other, output, omega) / own(axis, output, omega))) > _ACTS:
                answering[other] = by_axis[other]
    return answering


def _sweeps_by_axis(flight: Flight, flown: Mapping[str, Chirp], comparison: TruthBeside) -> dict[str, Sweep]:
    told = [sweep for sweep in sweeps(flight) if sweep.source == "log"]
    by_axis = {}
    for axis, chirp in flown.items():
        mine = [sweep for sweep in told if sweep.axis == chirp.axis_name]
        complete = [sweep for sweep in mine if sweep.complete]
        words = f"{len(complete)} complete of {len(mine)}"
        comparison.lines.append(TrialLine(f"sweep of {axis} in the log", words, "1 complete", len(complete) == 1))
        if complete:
            by_axis[axis] = complete[-1]
    return by_axis


def _judge(
    flight: Flight,
    parts: Sequence[Sweep],
    others: Mapping[str, Sweep],
    axes: Sequence[str],
    flown: Mapping[str, Chirp],
    truth: Truth,
    own: Truth,
    rate: float,
    loop: float,
    comparison: TruthBeside,
) -> None:
    named = [MIXER_AXES[axis] for axis in axes]
    inputs, outputs = [a.input for a in named], [a.output for a in named]
    # Without another message that has the channel, System ID's own has the plain name.
    logged = {a.output: a.logged if a.logged in flight else a.output for a in named}
    if missing := [name for name in (*inputs, *logged.values()) if name not in flight]:
        raise FlightError("is not in the log.", channel=", ".join(missing))
    pieces = [flight.between(part.start, part.stop) for part in (*parts, *others.values())]
    swept = (_SWEPT,) if _SWEPT in flight else ()
    along = [MIXER_AXES[axis].input for axis in others]
    records = uniform_records(pieces, (*inputs, *along, *outputs, *swept), rate=rate, names=logged)
    low, high = max(flown[a].start_hz for a in axes), min(flown[a].stop_hz for a in axes)
    band = (1.25 * low, 0.75 * high)
    responses = respond(records, inputs=(*inputs, *along), outputs=outputs, references=swept, band=band)
    responses = responses.select(outputs=tuple(outputs), inputs=tuple(inputs))
    words = f"{' and '.join(axes)}: "
    comparison.remarks += [words + text for text in (*responses.warnings, *responses.problems)]
    exact = _exact(responses, axes, own)
    forms = [_form(exact, axis) for axis in axes]
    simple = [_fitted(responses, axis, form) for axis, form in zip(axes, forms, strict=True)]
    comparison.models += [f"{axis}, fit-tf: {each!r}" for axis, each in zip(axes, simple, strict=True)]
    told = following_structure(exact, axes)
    fitted = None
    if told is not None:
        study = _study(told.name, responses, axes)
        fitted = study.structure
        if study.fit is not None:
            comparison.structures[" and ".join(axes)] = study.fit.estimates
    for place, (axis, a) in enumerate(zip(axes, named, strict=True)):
        h, coherence, error = responses.pair(a.output, a.input)
        good = np.isfinite(h) & (coherence >= COHERENT)
        true = truth(axis, a.output, responses.omega)
        curves = {"truth": (responses.omega, true), "respond": (responses.omega, np.where(good, h, np.nan))}
        share = float(np.mean(good))
        has, least = (f"{100 * part:.0f} % of the band" for part in (share, _LEAST_SHARE))
        comparison.lines.append(TrialLine(f"{axis}: coherent", has, least, share >= _LEAST_SHARE))
        limit = ROUNDED + np.degrees(0.5 / loop * responses.omega)
        comparison.lines.append(_verdict(f"{axis}: respond beside truth", h, true, error, good, limit))
        estimate = np.asarray(simple[place].response(responses.omega))
        curves["fit-tf"] = (responses.omega, estimate)
        best = np.asarray(_fitted(exact, axis, forms[place]).response(responses.omega))
        line = _verdict(f"{axis}: fit-tf beside truth", estimate, true, error, good, limit + _misses(exact, axis, best))
        follows = _follows(exact, axis, best)
        comparison.lines.append(line if follows else _told(line, f"no form of {', '.join(FORMS[axis])} follows"))
        if fitted is not None and told is not None:
            estimate, best = _answer(fitted, axis, responses.omega), told.answers[place]
            curves["fit-ss"] = (responses.omega, estimate)
            line = _verdict(
                f"{axis}: fit-ss beside truth", estimate, true, error, good, limit + _misses(exact, axis, best)
            )
            none = f"no structure of {', '.join(STRUCTURES[tuple(axes)])} follows"
            comparison.lines.append(line if told.follows else _told(line, none))
        comparison.curves[(a.output, a.input)] = curves
        comparison.lines.append(_lateness(axis, h, true, responses, good))


def _exact(responses: FrequencyResponse, axes: Sequence[str], own: Truth) -> FrequencyResponse:
    """The vehicle's own responses at the same frequencies, all as sure, and fitted where the measured ones are."""
    columns = [[own(axis, output, responses.omega) for axis in axes] for output in responses.outputs]
    h = np.moveaxis(np.array(columns), -1, 0)
    sure = _SURE * np.ones(h.shape)
    return replace(responses, response=h, error=sure, multiple=np.ones(h.shape[:2]), direct=None, shared=None)


class FollowingStructure(NamedTuple):
    """A structure that was fitted to a vehicle's own responses.

    Attributes:
        name: of it.
        answers: of its axes, each of shape (n_f,).
        follows: whether it is within half of what an estimate may be off; where none is, it is the first one.
    """

    name: str
    answers: tuple[Complex, ...]
    follows: bool


def following_structure(exact: FrequencyResponse, axes: Sequence[str]) -> FollowingStructure | None:
    """The first of `STRUCTURES` that follows a vehicle's own responses; None where no structure has these axes."""
    tried: list[FollowingStructure] = []
    for name in STRUCTURES.get(tuple(axes), ()):
        structure = _study(name, exact, axes).structure
        if structure is not None:
            answers = tuple(_answer(structure, axis, exact.omega) for axis in axes)
            follows = all(_follows(exact, axis, answer) for axis, answer in zip(axes, answers, strict=True))
            tried.append(FollowingStructure(name, answers, follows))
            if follows:
                return tried[-1]
    return tried[0] if tried else None


def _study(name: str, responses: FrequencyResponse, axes: Sequence[str]) -> LinearStudy:
    composed = {ours: MIXER_AXES[axis].input for ours, axis in _COMPOSED.items() if axis in axes}
    return fit_ss(name, responses, rename=composed if is_composed(name) else None)


def _answer(structure: StateSpaceModel, axis: str, omega: Array) -> Complex:
    """A structure's response of one axis, shape (n_f,)."""
    a = MIXER_AXES[axis]
    named = {a.input, *(ours for ours, its in _COMPOSED.items() if its == axis)}
    i = next(k for k, name in enumerate(structure.inputs) if name in named)
    return structure.response(omega)[:, list(structure.outputs).index(a.output), i]


def _fitted(responses: FrequencyResponse, axis: str, form: str) -> TransferFunction:
    a = MIXER_AXES[axis]
    fit = fit_tf(responses, input=a.input, outputs=[a.output], form=form)
    return fit.material.transfer_functions[0].solution[0]


def _form(exact: FrequencyResponse, axis: str) -> str:
    """The first form that follows the vehicle's own response; the first of all where none does."""
    for form in FORMS[axis]:
        if _follows(exact, axis, np.asarray(_fitted(exact, axis, form).response(exact.omega))):
            return form
    return FORMS[axis][0]


def _misses(exact: FrequencyResponse, axis: str, best: Complex) -> Array:
    """Degrees by which a form is off the vehicle's own response when it is fitted to that."""
    a = MIXER_AXES[axis]
    return gain_and_phase_off(best, exact.pair(a.output, a.input)[0])[1]


def _follows(exact: FrequencyResponse, axis: str, estimate: Complex) -> bool:
    a = MIXER_AXES[axis]
    h, coherence, _ = exact.pair(a.output, a.input)
    gain, phase = gain_and_phase_off(estimate, h)
    judged = coherence >= COHERENT
    return not np.any(judged & ((gain > _FOLLOWS * GAIN) | (phase > _FOLLOWS * PHASE)))


def _told(line: TrialLine, who: str) -> TrialLine:
    words = f"{who} the vehicle's own linearisation within {_FOLLOWS * GAIN:g} dB and {_FOLLOWS * PHASE:g} deg"
    return line._replace(expected=words, passed=None)


def gain_and_phase_off(estimate: Complex, true: Complex) -> tuple[Array, Array]:
    """Gain [dB] and phase [deg] between two responses, both positive."""
    ratio = estimate / true
    return 20.0 * np.abs(np.log10(np.abs(ratio))), np.degrees(np.abs(np.angle(ratio)))


def _verdict(
    what: str, estimate: Complex, true: Complex, error: Array, good: NDArray[np.bool_], limit: Array
) -> TrialLine:
    """The largest distance over the coherent lines; the random errors there widen what is allowed.

    Args:
        limit: of the phase [deg] by frequency; no more than `PHASE` of it counts.
    """
    limit = np.minimum(PHASE, limit)
    within = f"within {GAIN:g} dB and {limit.min():.1f} to {limit.max():.1f} deg, or {SIGMAS:g} random errors"
    if not good.any():
        return TrialLine(what, "nothing coherent", within, False)
    gain, phase = gain_and_phase_off(estimate[good], true[good])
    sigma = np.nan_to_num(error[good])
    allowed = (
        np.maximum(GAIN, SIGMAS * 20.0 / np.log(10.0) * sigma),
        np.maximum(limit[good], SIGMAS * np.degrees(sigma)),
    )
    passed = bool(np.all(gain <= allowed[0]) and np.all(phase <= allowed[1]))
    distance = f"{gain.max():.2f} dB, {phase.max():.1f} deg"
    return TrialLine(what, distance, within, passed)


def _lateness(axis: str, h: Complex, true: Complex, responses: FrequencyResponse, good: NDArray[np.bool_]) -> TrialLine:
    """How much later than the truth the estimate is, as a pure delay [ms]; told, not judged: the phase is."""
    omega = responses.omega[good]
    late = -float(np.sum(omega * np.angle(h[good] / true[good])) / np.sum(omega**2)) if good.any() else float("nan")
    return TrialLine(f"{axis}: log later than the truth", f"{1e3 * late:.1f} ms")


def at_three(curves: Mapping[str, tuple[Array, Complex]]) -> list[tuple[float, dict[str, tuple[float, float]]]]:
    """Gain [dB] and phase [deg] of each curve at three frequencies [Hz] spread over the band."""
    omega = curves["truth"][0]
    rows = []
    for share in (0.15, 0.5, 0.85):
        k = int(np.argmin(np.abs(np.log(omega / omega[0]) - share * np.log(omega[-1] / omega[0]))))
        values = {name: h[k] for name, (_, h) in curves.items()}
        polar = {n: (float(20.0 * np.log10(np.abs(v))), float(np.degrees(np.angle(v)))) for n, v in values.items()}
        rows.append((float(omega[k] / TWO_PI), polar))
    return rows
