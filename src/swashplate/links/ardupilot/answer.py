"""Readings as the line of JSON that ArduPilot's SITL reads.

ArduPilot does not parse JSON but looks for each key from the front and reads what stands behind `":` (libraries/SITL/
SIM_JSON.cpp). So there are no blanks, `velocity` stands before `velocity_wind`, the same keys come every time, and a
line break stands before and behind. Rotor speeds stand in a section `rpm`, as versions that read them want it.
"""

from __future__ import annotations

from swashplate.links.sensing import Readings

_FORM = (
    '\n{"timestamp":%.9f,"imu":{"gyro":[%.9g,%.9g,%.9g],"accel_body":[%.9g,%.9g,%.9g]},"position":[%.9g,%.9g,%.9g],'
    '"attitude":[%.9g,%.9g,%.9g],"velocity":[%.9g,%.9g,%.9g],"rng_1":%.6g,"airspeed":%.6g,'
    '"velocity_wind":[%.6g,%.6g,%.6g],"windvane":{"direction":%.6g,"speed":%.6g},"rpm":{"rpm_1":%.6g,"rpm_2":%.6g}'
)
_BATTERY = ',"battery":{"voltage":%.6g,"current":%.6g}'


def line(readings: Readings) -> bytes:
    """The answer to one servo packet."""
    r = readings
    text = _FORM % (
        r.time,
        *r.gyro,
        *r.force,
        *r.place,
        *r.attitude,
        *r.velocity,
        r.range,
        r.airspeed,
        *r.wind,
        *r.vane,
        *r.rotors,
    )
    if r.voltage is not None:
        text += _BATTERY % (r.voltage, r.current)
    return (text + "}\n").encode("ascii")
