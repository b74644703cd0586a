"""Does a record move each axis by itself, or is the command only a controller's answer to the motion?

The question of `flights/feedback.py`, asked of the axes of a vehicle. A fit in time can use more than a response can:
predictions from the past stay right under feedback as long as something of the command is its own (Ljung 1999, ch. 13).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from swashplate.arrays import Array
from swashplate.filtering.disturbances import Noise
from swashplate.flights.averaged_spectra import cross_density, power_density
from swashplate.flights.conditioning.filters import filtered
from swashplate.flights.excitation import CONTROLLER, Excitation, of_inputs
from swashplate.flights.feedback import ANSWER, NOTHING, AnswerShares, told_by_motion
from swashplate.identification.core.parameters import Parameterization
from swashplate.identification.core.records import Record
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.models.linear.state_space import UNMOVED
from swashplate.models.traits import Axis
from swashplate.models.vehicle import Vehicle

MOVING = 0.2
"""Root mean square [rad/s^2] of gusts in roll and pitch from which they may be moving air. A CoaX simulated in still
air comes out at 0.003, in wind of 0.1 m/s at 0.7; its real flights indoors at 1.9."""


@dataclass(frozen=True)
class AxisExcitation:
    """Whether a record moves an axis independently of what the aircraft did.

    Attributes:
        record: the record's name.
        axis: "roll", "pitch", "yaw" or "heave".
        command: the input that drives it.
        explained: part of the command's variance that past motion explains (1: a controller's answer to the motion;
            NaN where the command stands still or the record is too short to tell).
        coherence: largest coherence between command and motion in the band.
        phase: phase of motion over command there [rad] (NaN where the command stands still).
        power: standard deviation of the command in the band [1].
        identifiable: False where there is no independent excitation.
        words: the finding, and what to fly instead.
        answer: whether the motion tells the command as it tells a controller's answer; where the axis is identifiable
            all the same, it is weakly excited.
    """

    record: str
    axis: str
    command: str
    explained: float
    coherence: float
    phase: float
    power: float
    identifiable: bool
    words: str
    answer: bool = False


@dataclass(frozen=True)
class FlightDetails:
    """What `identify` adds to a result.

    Attributes:
        excitation: per record and axis.
    """

    kind: ClassVar[str] = "flight"
    excitation: tuple[AxisExcitation, ...] = ()


def moving_air(noise: Noise) -> str:
    """What a fit without a wind is to say of the gusts that it found; "" where there are none."""
    rms = float(noise.gust_tilt) * math.sqrt(0.5 * float(noise.tau_gust_moment))
    if float(noise.wind) > 0.0 or not rms > MOVING:
        return ""
    return (
        f"gusts of {rms:.2g} rad/s^2 (rms) in roll and pitch that fade in {float(noise.tau_gust_moment):.2g} s. If the "
        "air moved, outdoors or in the rotors' own wake in a room, it acted through the rotors: without --wind "
        "(wind=True) the bounds of terms of speed, rotor lags and linkages are then too narrow. Fit again with it."
    )


EXPLAINED = 0.99
"""Share of an answer's variance that past motion explains from which the axis counts as not excited. Below it, the axis
is weakly excited: what it tells rests on the noise model and the priors."""

_BAND = (0.3, 8.0)
_MOVED = 1e-4


UNJUDGED = "the model names no axes: whether the flights move each by itself was not judged"

MOTION: Mapping[str, tuple[tuple[str, ...], str]] = {
    "roll": (("phi", "p", "lateral", "v"), "p"),
    "pitch": (("theta", "q", "forward", "u"), "q"),
    "yaw": (("psi", "r"), "r"),
    "heave": (("z", "w"), "w"),
}
"""The motion that a command of an axis may answer, and what of it follows the command."""


def excitation(vehicle: Vehicle, record: Record, states: Array) -> tuple[AxisExcitation, ...]:
    """Independent excitation of each axis of a record, those that the vehicle says it is flown in (`Traits.axes`).

    Args:
        states: body states (n, 12) of the record.
    """
    motion = {name: states[:, i] for i, name in enumerate(PREDICTED)}
    heading = motion["psi"]
    motion["forward"] = np.cos(heading) * motion["x"] + np.sin(heading) * motion["y"]
    motion["lateral"] = -np.sin(heading) * motion["x"] + np.cos(heading) * motion["y"]
    judged = []
    for axis in vehicle.traits.axes:
        command = np.zeros(record.time.size)
        for name, weight in axis.inputs.items():
            command = command + weight * record.inputs[:, vehicle.input_names.index(name)]
        judged.append(_judge(record, axis, command, motion))
    return tuple(judged)


def _judge(record: Record, axis: Axis, command: Array, motion: dict[str, Array]) -> AxisExcitation:
    rate = 1.0 / record.dt
    high = min(_BAND[1], 0.4 * rate)
    power = float(np.std(filtered(command, rate=rate, cutoff=(_BAND[0], high), order=2)))
    still = power < _MOVED
    shares, peak, phase = NOTHING, 0.0, float("nan")
    if not still:
        answered, response = MOTION[axis.name]
        answers = np.stack([motion[name] for name in answered], axis=1)
        (shares,) = told_by_motion(command[:, None], answers, record.dt, memory=False)
        peak, phase = _coherence(command, motion[response], rate, high)
    # News is not asked: rates that were derived from a tracked pose know a little of what follows.
    answer = shares.known and shares.past >= ANSWER and not shares.follows
    identifiable = shares.known and not (answer and shares.past >= EXPLAINED)
    return AxisExcitation(
        record=record.name,
        axis=axis.name,
        command=_called(axis.inputs),
        explained=shares.past,
        coherence=peak,
        phase=phase,
        power=power,
        identifiable=identifiable,
        words=_sentence(axis.name, shares, peak, phase, still=still, answer=answer),
        answer=answer,
    )


def by_itself(axis: AxisExcitation) -> bool:
    """Whether a record moves an axis by more than weakly: what else it shows there may be the controller."""
    return axis.identifiable and not axis.answer


def _called(inputs: Mapping[str, float]) -> str:
    """A sum of inputs in words."""
    return "".join(f"{' - ' if share < 0.0 else ' + '}{name}" for name, share in inputs.items()).removeprefix(" + ")


def _coherence(command: Array, response: Array, rate: float, high: float) -> tuple[float, float]:
    length = int(min(command.size, 4.0 * rate))
    frequency, cross = cross_density(command, response, rate=rate, window=length)
    both = [power_density(values, rate=rate, window=length)[1] for values in (command, response)]
    squared = np.abs(cross) ** 2 / (both[0] * both[1])
    band = (frequency >= _BAND[0]) & (frequency <= high)
    best = np.flatnonzero(band)[np.argmax(squared[band])]
    return float(squared[best]), float(np.angle(cross[best]))


def _sentence(axis: str, shares: AnswerShares, peak: float, phase: float, *, still: bool, answer: bool) -> str:
    if still:
        return f"{axis}: the command does not move. Fly a sweep or a multisine in {axis}."
    if not shares.known:
        return f"{axis}: the record is too short to tell what moves the command. Fly longer."
    share = f"past motion explains {100 * shares.past:.0f} % of the command (coherence up to {peak:.2f}"
    share += f" at {np.degrees(phase):+.0f} deg)"
    if not answer and shares.past >= ANSWER:
        return f"{axis}: {share}, but the motion after it explains more: the motion follows the command."
    if not answer:
        return f"{axis}: {share}; the rest moves the axis independently."
    if shares.past < EXPLAINED:
        return f"{axis}: {share}: mostly a controller's answer; the axis is weakly excited, believe it with its bound."
    return (
        f"{axis}: {share}: it is a controller's answer, and this record cannot tell the {axis} dynamics from the "
        f"controller. Add an independent sweep or multisine to the {axis} reference and log rotor speed and voltage."
    )


def mark_unmoved(vehicle: Vehicle, free: Collection[str], axes: Sequence[AxisExcitation]) -> Vehicle:
    """The identified vehicle whose card names the axes that were fitted although no flight moved them by itself.

    Args:
        free: names that the fit moved. axes: how each record moves each axis.
    """
    excited = {item.axis for item in axes if item.identifiable}
    fitted = [axis.name for axis in vehicle.traits.axes if axes and set(axis.parameters) & set(free)]
    unmoved = {name: 1.0 for name in fitted if name not in excited}
    card = vehicle.card
    return vehicle.with_card(replace(card, observer={**card.observer, UNMOVED: unmoved})) if unmoved else vehicle


def mark_answers(vehicle: Vehicle, inputs: Collection[Excitation]) -> Vehicle:
    """The identified vehicle whose card names the inputs that only a controller moved.

    Args:
        inputs: what moved each input of each record.
    """
    unmoved = {name: 1.0 for name, one in of_inputs(tuple(inputs)).items() if one.kind == CONTROLLER}
    card = vehicle.card
    return vehicle.with_card(replace(card, observer={**card.observer, UNMOVED: unmoved})) if unmoved else vehicle


def hold_unexcited(table: Parameterization, axes: Sequence[AxisExcitation]) -> tuple[Parameterization, list[str]]:
    """Fix what only unexcited axes could tell, at its prior where it has one."""
    notes = []
    for axis in table.vehicle.traits.axes:
        judged = [item for item in axes if item.axis == axis.name]
        held = [item for item in table.free if item.name in axis.parameters]
        if not held or any(item.identifiable for item in judged):
            continue
        at = {item.name: item.start if item.mean is None else item.mean for item in held}
        table = replace(
            table.without(at), vehicle=table.vehicle.with_values({k: v for k, v in at.items() if v is not None})
        )
        notes.append(f"{', '.join(at)} held: {judged[0].words}")
    return table, notes
