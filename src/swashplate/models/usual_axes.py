"""Inputs that are called as usual, by the axis that they drive: for models that say nothing else."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from swashplate.models.traits import Axis

_USUAL: Mapping[str, tuple[Mapping[str, float], ...]] = {
    "roll": ({"servo_roll": 1.0}, {"A1": 1.0}, {"lateral": 1.0}),
    "pitch": ({"servo_pitch": 1.0}, {"B1": 1.0}, {"longitudinal": 1.0}),
    "yaw": ({"motor_upper": 1.0, "motor_lower": -1.0}, {"theta0T": 1.0}, {"pedal": 1.0}),
    "heave": ({"motor_upper": 1.0, "motor_lower": 1.0}, {"theta0": 1.0}, {"collective": 1.0}),
}
"""In the sense of the commands: servo_pitch and B1 positive are nose down; yaw is nose right, of theta0T with a
clockwise rotor."""


def usual_axes(inputs: Collection[str]) -> tuple[Axis, ...]:
    """The axes of inputs that are called as a coaxial helicopter's, a single rotor's or the ready linear models'."""
    by_axis = {axis: next((s for s in sets if s.keys() <= set(inputs)), None) for axis, sets in _USUAL.items()}
    return tuple(Axis(axis, channel) for axis, channel in by_axis.items() if channel is not None)
