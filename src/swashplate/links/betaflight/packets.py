"""Betaflight's SITL packets, as the machine's own numbers without padding beyond C's (target.h, sitl.c of 2026.12).

Out of it: motor and servo pulses to UDP 9001 {uint16 count; float pulse[16]}, the first four motors as shares to 9002
{float speed[4]}. Into it: state on 9003, 18 doubles, and sticks on 9004 {double time; uint16 pulse[16]}. What comes
for a state is one pair of motor packets.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from typing import NamedTuple

from swashplate.links.sensing import Readings

MOTORS_PORT, SHARES_PORT, STATE_PORT, STICKS_PORT, MSP_PORT = 9001, 9002, 9003, 9004, 5761
CHANNELS = 16
_STATE = struct.Struct("<18d")
STATE_SIZE = _STATE.size
_STICKS = struct.Struct("<d16H")
_PULSES = struct.Struct("<H2x16f")
_EITHER = {"<": "<H2x16f", ">": ">H2x16f"}
_SEA_LEVEL = 101_325.0
_LATITUDE_METRES = 111_320.0
HOME = (47.397742, 8.545594)
"""Degrees north and east where the ground is: a virtual GPS wants a place."""


class Pulses(NamedTuple):
    """Motors, then servos [us], and how many of them are motors."""

    motors: int
    values: tuple[float, ...]


class PulseRefusal(NamedTuple):
    """Why a packet is none of Betaflight's: a kind to count it by, and words."""

    kind: str
    sentence: str


def pulses_of(data: bytes) -> Pulses | PulseRefusal:
    """A packet of port 9001."""
    if len(data) != _PULSES.size:
        return PulseRefusal(
            "size", f"a packet of {len(data)} bytes came in, expected {_PULSES.size} (a count and 16 pulses); ignored."
        )
    count, *values = _PULSES.unpack(data)
    if not (1 <= count <= CHANNELS) or not all(math.isfinite(v) and 0.0 <= v <= 3000.0 for v in values):
        turned, *others = struct.unpack(_EITHER[">"], data)
        if 1 <= turned <= CHANNELS and all(math.isfinite(v) and 0.0 <= v <= 3000.0 for v in others):
            text = "pulses in another byte order came in, expected little-endian; they are ignored."
            return PulseRefusal("byte order", text)
        return PulseRefusal("pulses", f"{count} outputs with pulses beyond 0 to 3000 us came in; they are ignored.")
    return Pulses(count, tuple(values))


def state_packet(time: float, readings: Readings) -> bytes:
    """What the flight controller senses, as its default build reads it (ENABLE_GAZEBO_BRIDGE 1), with a time stamp.

    Rates and specific force forward-right-down. That bridge's plugin has a world whose east and north are turned around
    (sitl.c mirrors positions about the first one): the attitude is the rotation from the body to north-east-down turned
    by 90 degrees about the vertical, and longitude and latitude [deg] go the other way. Velocity is east, north, up.
    """
    w, x, y, z = _quaternion(readings.attitude)
    c = math.sqrt(0.5)  # Rz(90 deg) before it
    turned = (c * (w - z), c * (x - y), c * (y + x), c * (z + w))
    north, east, down = readings.place
    latitude = HOME[0] - north / _LATITUDE_METRES
    longitude = HOME[1] - east / (_LATITUDE_METRES * math.cos(math.radians(HOME[0])))
    v = readings.velocity
    pressure = _SEA_LEVEL * (1.0 + 2.25577e-5 * down) ** 5.25588
    return _STATE.pack(
        time, *readings.gyro, *readings.force, *turned, v[1], v[0], -v[2], longitude, latitude, -down, pressure
    )


def sticks_packet(time: float, pulses: Sequence[float]) -> bytes:
    """Sticks and switches [us], roll, pitch, throttle, yaw first; what is missing is low."""
    row = [round(pulse) for pulse in pulses]
    return _STICKS.pack(time, *row, *(1000,) * (CHANNELS - len(row)))


def _quaternion(attitude: tuple[float, float, float]) -> tuple[float, float, float, float]:
    """From the body to north-east-down, scalar first."""
    (cf, sf), (ct, st), (cp, sp) = ((math.cos(0.5 * angle), math.sin(0.5 * angle)) for angle in attitude)
    return (
        cf * ct * cp + sf * st * sp,
        sf * ct * cp - cf * st * sp,
        cf * st * cp + sf * ct * sp,
        cf * ct * sp - sf * st * cp,
    )
