"""Does a record move each axis by itself, or is the command only a controller's answer to the motion?

A command that past motion explains carries no information of its own: whatever relates it to the motion is the
controller, and a fit of the aircraft to it may well find minus the controller's inverse (Ljung 1999, ch. 13). A slow
sweep is explained by past motion too, because it can be predicted; but what the aircraft does comes after the command,
so the motion that follows then explains it better still, which it does not where the command is an answer.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.core.parameters import Parameterization
from swashplate.identification.core.records import Record
from swashplate.identification.time.flight_details import AxisExcitation
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.models.traits import Axis
from swashplate.models.vehicle import Vehicle

EXPLAINED = 0.99
"""Share of a command's variance that past motion may explain before the axis counts as not excited."""

WEAK = 0.90
"""Share above which the excitation is called weak: what the axis tells then rests on the noise model and the priors."""

FOLLOWS = 1.5
"""How many times more of a command past motion must leave unexplained than later motion, for the motion to follow it.

Measured: 1.4 to 4.6 with sweeps and multisines, 0.8 to 1.2 for controllers' answers, real ones included.
"""

_BAND = (0.3, 8.0)
_LAGS = 0.3
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
    from scipy.signal import butter, sosfiltfilt

    rate = 1.0 / record.dt
    high = min(_BAND[1], 0.4 * rate)
    sos = butter(2, (_BAND[0], high), "bandpass", fs=rate, output="sos")
    banded = sosfiltfilt(sos, command)
    power = float(np.std(banded))
    still = power < _MOVED
    explained, later, peak, phase = float("nan"), float("nan"), 0.0, float("nan")
    if not still:
        answered, response = MOTION[axis.name]
        moved = [motion[name] for name in answered]
        explained = _explained(command, moved, rate)
        later = _explained(command[::-1], [signal[::-1] for signal in moved], rate)
        peak, phase = _coherence(command, motion[response], rate, high)
    follows = 1.0 - explained > FOLLOWS * (1.0 - later)
    identifiable = not still and (explained < EXPLAINED or follows)
    return AxisExcitation(
        record=record.name,
        axis=axis.name,
        command=_called(axis.inputs),
        explained=explained,
        coherence=peak,
        phase=phase,
        power=power,
        identifiable=identifiable,
        words=_words(axis.name, explained, peak, phase, still=still, identifiable=identifiable, follows=follows),
        explained_later=later,
    )


def by_itself(axis: AxisExcitation) -> bool:
    """Whether a record moves an axis by more than weakly: what else it shows there may be the controller."""
    follows = 1.0 - axis.explained > FOLLOWS * (1.0 - axis.explained_later)
    return axis.identifiable and (axis.explained <= WEAK or follows)


def _called(inputs: Mapping[str, float]) -> str:
    """A sum of inputs in words."""
    return "".join(f"{' - ' if share < 0.0 else ' + '}{name}" for name, share in inputs.items()).removeprefix(" + ")


def _explained(command: Array, motion: list[Array], rate: float) -> float:
    """Adjusted R^2 of the command on present and past motion, everything low-passed to the band and decimated."""
    from scipy.signal import butter, sosfiltfilt

    keep = max(1, round(rate / (4.0 * _BAND[1])))
    sos = butter(4, min(_BAND[1], 0.4 * rate), fs=rate, output="sos")
    slow = [sosfiltfilt(sos, signal)[::keep] for signal in (command, *motion)]
    lags = max(1, round(_LAGS * rate / keep))
    n = slow[0].size - lags
    if n < 4 * lags * len(motion):
        return float("nan")
    columns = [signal[lags - lag : lags - lag + n] for signal in slow[1:] for lag in range(lags + 1)]
    trend = np.linspace(-1.0, 1.0, n)
    table = np.column_stack([np.ones(n), trend, trend**2, *columns])
    target = slow[0][lags:]
    residual = target - table @ np.linalg.lstsq(table, target, rcond=None)[0]
    base = target - table[:, :3] @ np.linalg.lstsq(table[:, :3], target, rcond=None)[0]
    freedom = (n - 3) / max(n - table.shape[1], 1)
    return float(max(0.0, 1.0 - freedom * (residual @ residual) / max(base @ base, 1e-30)))


def _coherence(command: Array, response: Array, rate: float, high: float) -> tuple[float, float]:
    from scipy.signal import coherence, csd

    length = int(min(command.size, 4.0 * rate))
    frequency, squared = coherence(command, response, rate, nperseg=length)
    cross = csd(command, response, rate, nperseg=length)[1]
    band = (frequency >= _BAND[0]) & (frequency <= high)
    best = np.flatnonzero(band)[np.argmax(squared[band])]
    return float(squared[best]), float(np.angle(cross[best]))


def _words(
    axis: str, explained: float, peak: float, phase: float, *, still: bool, identifiable: bool, follows: bool
) -> str:
    if still:
        return f"{axis}: the command does not move. Fly a sweep or a multisine in {axis}."
    share = f"past motion explains {100 * explained:.0f} % of the command (coherence up to {peak:.2f}"
    share += f" at {np.degrees(phase):+.0f} deg)"
    if identifiable and follows and explained > WEAK:
        return f"{axis}: {share}, but the motion after it explains more: the motion follows the command."
    if identifiable and explained > WEAK:
        return f"{axis}: {share}: mostly a controller's answer; the axis is weakly excited, believe it with its bound."
    if identifiable:
        return f"{axis}: {share}; the rest moves the axis independently."
    return (
        f"{axis}: {share}: it is a controller's answer, and this record cannot tell the {axis} dynamics from the "
        f"controller. Add an independent sweep or multisine to the {axis} reference and log rotor speed and voltage."
    )


UNMOVED = "unmoved"
"""Section of an identified card: axes that were fitted although no flight moved them from outside."""


def mark_unmoved(vehicle: Vehicle, free: Collection[str], axes: Sequence[AxisExcitation]) -> Vehicle:
    """The identified vehicle whose card names the axes that were fitted although no flight moved them by itself.

    Args:
        free: names that the fit moved. axes: how each record moves each axis.
    """
    moved = {item.axis for item in axes if item.identifiable}
    fitted = [axis.name for axis in vehicle.traits.axes if axes and set(axis.parameters) & set(free)]
    unmoved = {name: 1.0 for name in fitted if name not in moved}
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
