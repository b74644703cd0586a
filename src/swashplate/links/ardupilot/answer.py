"""Readings as the line of JSON that ArduPilot's SITL reads.

ArduPilot does not parse JSON but looks for each key from the front and reads what stands behind `":` (libraries/SITL/
SIM_JSON.cpp). So there are no blanks, `velocity` stands before `velocity_wind`, the same keys come every time, and a
line break stands before and behind. Rotor speeds stand in a section `rpm`, as versions that read them want it.
"""

from __future__ import annotations

from swashplate.links.sensing import Readings
from swashplate.physics.backend import Scalar

_FORM = (
    '\n{"timestamp":%.9f,"imu":{"gyro":[%.9g,%.9g,%.9g],"accel_body":[%.9g,%.9g,%.9g]},"position":[%.9g,%.9g,%.9g],'
    '"attitude":[%.9g,%.9g,%.9g],"velocity":[%.9g,%.9g,%.9g],"rng_1":%.6g,"airspeed":%.6g,'
    '"velocity_wind":[%.6g,%.6g,%.6g],"windvane":{"direction":%.6g,"speed":%.6g},"rpm":{"rpm_1":%.6g,"rpm_2":%.6g}'
)
_BATTERY = ',"battery":{"voltage":%.6g,"current":%.6g}'


def line(readings: Readings) -> bytes:
    """The answer to one servo packet."""
    values = in_order(readings)
    return (form(len(values)) % values).encode("ascii")


def form(count: int) -> str:
    """The line with blanks, of `printf` here and in C, for so many numbers."""
    return f"{_FORM}{'' if count == _FORM.count('%') else _BATTERY}}}\n"


def in_order(r: Readings) -> tuple[Scalar, ...]:
    """The numbers of the line."""
    battery = () if r.voltage is None else (r.voltage, r.current)
    motion = (r.time, *r.gyro, *r.force, *r.place, *r.attitude, *r.velocity)
    return (*motion, r.range, r.airspeed, *r.wind, *r.vane, *r.rotors, *battery)
