"""Which way a positive command moves the aircraft: what the names of commands promise, as numbers.

The commands are those of the schema (body axes forward-right-down) and the inputs of the ready linear models. A name
that does not say its sense is not here: a stick's pitch is forward in one log and aft in the next.
"""

from __future__ import annotations

from collections.abc import Mapping

from swashplate.flights.schema import VARIANTS

_MOTION: Mapping[str, Mapping[str, int]] = {
    "roll": {"p": 1, "phi": 1},
    "pitch": {"q": 1, "theta": 1},
    "yaw": {"r": 1, "psi": 1},
    "climb": {"az": -1, "w": -1, "vz": -1},
}
"""Signs of what moves when the aircraft rolls right, pitches nose up, turns its nose right and climbs."""
_COMMANDS: Mapping[str, Mapping[str, int]] = {
    "mixer_roll": {"roll": 1},
    "mixer_pitch": {"pitch": 1},
    "mixer_yaw": {"yaw": 1},
    "mixer_collective": {"climb": 1},
    "servo_roll": {"roll": 1},
    "servo_pitch": {"pitch": -1},
    # Lower rotor clockwise from above: its torque turns the body the other way, nose left.
    "motor_lower": {"yaw": -1, "climb": 1},
    "motor_upper": {"yaw": 1, "climb": 1},
    "lateral": {"roll": 1},
    "pedal": {"yaw": 1},
    "collective": {"climb": 1},
    "stick_roll": {"roll": 1},
    "stick_lateral": {"roll": 1},
    "stick_pedal": {"yaw": 1},
    "stick_collective": {"climb": 1},
    "stick_throttle": {"climb": 1},
}
INTEGRATIONS: Mapping[str, int] = {"az": 0, "w": 1, "vz": 1, "p": 1, "q": 1, "r": 1, "phi": 2, "theta": 2, "psi": 2}
"""How often the acceleration that a command makes is integrated to this motion."""


def plain(name: str) -> str:
    """A motion without the suffix of a second opinion: p of `p_imu`."""
    base, _, variant = name.partition("_")
    return base if variant in VARIANTS and variant != "demand" else name


def has_sense(input: str) -> bool:
    """Whether a command's name promises a motion."""
    return input in _COMMANDS


def expected_sense(output: str, input: str) -> int:
    """The sign of a motion that a positive command makes, 1 or -1; 0 where the names promise none."""
    promised = {
        motion: sense * sign
        for axis, sense in _COMMANDS.get(input, {}).items()
        for motion, sign in _MOTION[axis].items()
    }
    return promised.get(plain(output), 0)
