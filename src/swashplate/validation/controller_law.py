"""How a controller answers the motion of an axis, as the first seconds of a record tell it.

Proportional to position and rate, some samples late: what keeps a heading or a height, seen from outside.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import SwashError
from swashplate.identification.core.records import Record
from swashplate.identification.time.feedback import MOTION
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.models.vehicle import Vehicle

CLOSABLE = tuple(axis for axis, (names, _) in MOTION.items() if set(names) <= set(PREDICTED))
"""Axes whose command answers nothing but states of the body."""

_LATEST = 0.08
"""Seconds by which a command may follow the motion that it answers."""
_BEGUN = 0.5
"""Seconds at the beginning that nothing is learnt from: the filter settles."""


@dataclass(frozen=True)
class Law:
    """How a controller answers an axis: command = reference + gains . motion, `lag` seconds ago.

    Attributes:
        record: of which record. axis: of `Traits.axes`.
        motion: names of the states that it answers. gains: command per unit of each.
        lag: seconds by which the logged command follows the motion.
        explained: share of the command's variance in the seconds that it was learnt from.
    """

    record: str
    axis: str
    motion: tuple[str, ...]
    gains: tuple[float, ...]
    lag: float
    explained: float

    @property
    def summary_text(self) -> str:
        answers = ", ".join(f"{gain:+.4g} per {name}" for name, gain in zip(self.motion, self.gains, strict=True))
        return (
            f"{self.axis} loop of {self.record}: the command answers with {answers}, {1e3 * self.lag:.0f} ms late; "
            f"that explains {100.0 * self.explained:.0f} % of it in the seconds that told it."
        )


def check_closed(vehicle: Vehicle, axes: Sequence[str]) -> None:
    """That each axis can be closed.

    Raises:
        SwashError: naming the axis and those that can.
    """
    can = [axis.name for axis in vehicle.traits.axes if axis.name in CLOSABLE]
    for name in axes:
        if name not in can:
            raise SwashError(
                f"'{name}' cannot be closed, expected {' or '.join(can) or 'nothing: the vehicle names no such axis'}.",
                channel="close_loop",
                hint="Roll and pitch answer a position controller as well: predict them on the recorded inputs.",
            )


def learnt(vehicle: Vehicle, record: Record, states: Array, *, axes: Sequence[str], seconds: float) -> tuple[Law, ...]:
    """The controllers of some axes from the first seconds of a record, by least squares.

    Args:
        states: the observer's body states (n, 12).
        axes: of `CLOSABLE`. seconds: what comes later is not looked at.
    """
    first, last = round(_BEGUN / record.dt), round(seconds / record.dt)
    laws = []
    for axis in (a.name for a in vehicle.traits.axes if a.name in axes):
        command = record.inputs @ shares_of(vehicle, axis)
        names = MOTION[axis][0]
        motion = states[:, [PREDICTED.index(name) for name in names]]
        best = Law(record.name, axis, names, (0.0,) * len(names), 0.0, 0.0)  # a command that is held
        for lag in range(round(_LATEST / record.dt) + 1):
            answer = command[first:last]
            table = np.column_stack([np.ones(answer.size), motion[first - lag : last - lag]])
            gains = np.linalg.lstsq(table, answer, rcond=None)[0]
            left, all_of_it = np.var(answer - table @ gains), np.var(answer)
            share = 1.0 - float(left / all_of_it) if all_of_it > 0.0 else 0.0
            if share > best.explained:
                coefficients = tuple(float(g) for g in gains[1:])
                best = Law(record.name, axis, names, coefficients, lag * record.dt, share)
        laws.append(best)
    return tuple(laws)


def shares_of(vehicle: Vehicle, axis: str) -> Array:
    """Shares of the inputs (inputs,) in the command of an axis."""
    inputs: Mapping[str, float] = next(a.inputs for a in vehicle.traits.axes if a.name == axis)
    return np.array([float(inputs.get(name, 0.0)) for name in vehicle.input_names])
