"""Readings as the line of JSON that ArduPilot's SITL reads.

ArduPilot does not parse JSON but looks for each key from the front and reads what stands behind `":` (libraries/SITL/
SIM_JSON.cpp). So there are no blanks, `velocity` stands before `velocity_wind`, the same keys come every time, and a
line break stands before and behind. Rotor speeds stand in a section `rpm`, as versions that read them want it.
"""

from __future__ import annotations

from swashplate.links.sensing import Readings
from swashplate.physics.backend import Scalar

_FORM = (
    '\n{"timestamp":%,"imu":{"gyro":[%,%,%],"accel_body":[%,%,%]},"position":[%,%,%],"attitude":[%,%,%],'
    '"velocity":[%,%,%],"rng_1":%,"airspeed":%,"velocity_wind":[%,%,%],"windvane":{"direction":%,"speed":%},'
    '"rpm":{"rpm_1":%,"rpm_2":%}'
)
_BATTERY = ',"battery":{"voltage":%,"current":%}'


def line(readings: Readings) -> bytes:
    """The answer to one servo packet."""
    values = in_order(readings)
    return (form(len(values)).replace("%", "%s") % tuple(map(decimal, values))).encode("ascii")


def form(count: int) -> str:
    """The line with a % for each of so many numbers."""
    return f"{_FORM}{'' if count == _FORM.count('%') else _BATTERY}}}\n"


def decimal(value: float) -> str:
    """A number with nine places. C writes it so too: `printf` took a fifth of the link's time."""
    digits = int(abs(value) * 1e9 + 0.5)
    return f"{'-' if value < 0.0 and digits else ''}{digits // 10**9}.{digits % 10**9:09d}"


def in_order(r: Readings) -> tuple[Scalar, ...]:
    """The numbers of the line."""
    battery = () if r.voltage is None else (r.voltage, r.current)
    motion = (r.time, *r.gyro, *r.force, *r.place, *r.attitude, *r.velocity)
    return (*motion, r.range, r.airspeed, *r.wind, *r.vane, *r.rotors, *battery)
