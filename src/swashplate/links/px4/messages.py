"""Readings as MAVLink's HIL messages, and actuator controls out of a stream of bytes (needs the extra `link`)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from swashplate.extras import library
from swashplate.links.px4 import place
from swashplate.links.sensing import Readings
from swashplate.links.servo import CENTRE, HALF, NO_PULSE

OUTPUTS = 16
IMU, SLOW = 0b111111, 0b1111111000000
"""Which fields of HIL_SENSOR are new: accelerometer and gyro; magnetometer and pressures."""
_LOCKSTEP = 1
_STANDARD_GRAVITY = 9.80665


class ActuatorControls(NamedTuple):
    """Actuator controls: -1 to 1 for servos, 0 to 1 for motors, and whether the autopilot waits for sensors."""

    values: tuple[float, ...]
    lockstep: bool


class Mavlink:
    """Writes and reads messages of one connection.

    Raises:
        MissingLibraryError: where pymavlink is not installed.
    """

    def __init__(self) -> None:
        common = library("pymavlink.dialects.v20.common", what="a link to PX4")
        self._writer: Any = common.MAVLink(None, srcSystem=1, srcComponent=1)
        self._reader: Any = common.MAVLink(None)
        self._reader.robust_parsing = True

    def read(self, data: bytes) -> tuple[list[ActuatorControls], int]:
        """Actuator controls in the next bytes of the stream, and how many pieces of it were no messages."""
        controls, bad = [], 0
        for message in self._reader.parse_buffer(data) or ():
            kind = message.get_type()
            if kind == "HIL_ACTUATOR_CONTROLS":
                controls.append(ActuatorControls(tuple(message.controls), bool(message.flags & _LOCKSTEP)))
            elif kind == "BAD_DATA":
                bad += 1
        return controls, bad

    def sensor(
        self, r: Readings, *, slow: bool, field_noise: Sequence[float] = (0.0, 0.0, 0.0), pressure_noise: float = 0.0
    ) -> bytes:
        """HIL_SENSOR.

        Args:
            r: readings.
            slow: magnetometer and pressures are new, too.
            field_noise, pressure_noise: added to them [Gauss], [hPa].
        """
        altitude = place.ALTITUDE - r.place.z
        pressure = place.pressure(altitude) + pressure_noise
        field = [b + n for b, n in zip(place.field_seen(r.attitude), field_noise, strict=True)]
        ahead = 0.5 * 1.225 * r.airspeed**2 / 100.0
        seen_altitude = (1.0 - (pressure / 1013.25) ** (1.0 / 5.25588)) * 288.15 / 0.0065
        message = self._writer.hil_sensor_encode(
            _microseconds(r.time),
            *r.force,
            *r.gyro,
            *field,
            pressure,
            ahead,
            seen_altitude,
            place.temperature(altitude),
            IMU | (SLOW if slow else 0),
        )
        return bytes(message.pack(self._writer))

    def position(self, r: Readings) -> bytes:
        """HIL_GPS: a fix with ten satellites."""
        latitude, longitude, altitude = place.coordinates(r.place)
        north, east, down = (round(100.0 * v) for v in r.velocity)
        ground = math.hypot(r.velocity.x, r.velocity.y)
        course = math.degrees(math.atan2(r.velocity.y, r.velocity.x)) % 360.0
        message = self._writer.hil_gps_encode(
            _microseconds(r.time),
            3,
            round(latitude * 1e7),
            round(longitude * 1e7),
            round(altitude * 1e3),
            30,
            40,
            min(65_534, round(100.0 * ground)),
            *(max(-32_768, min(32_767, v)) for v in (north, east, down)),
            round(100.0 * course) % 36_000,
            10,
        )
        return bytes(message.pack(self._writer))

    def truth(self, r: Readings) -> bytes:
        """HIL_STATE_QUATERNION: what PX4 logs as ground truth."""
        latitude, longitude, altitude = place.coordinates(r.place)
        message = self._writer.hil_state_quaternion_encode(
            _microseconds(r.time),
            place.quaternion(r.attitude),
            *r.gyro,
            round(latitude * 1e7),
            round(longitude * 1e7),
            round(altitude * 1e3),
            *(_short(100.0 * v) for v in r.velocity),
            max(0, _short(100.0 * r.airspeed)),
            max(0, _short(100.0 * r.airspeed)),
            *(_short(1000.0 * f / _STANDARD_GRAVITY) for f in r.force),
        )
        return bytes(message.pack(self._writer))

    def rotor(self, r: Readings) -> bytes:
        """RAW_RPM of the main or lower rotor. PX4 takes it into its topic `rpm` whatever the index, so one is sent."""
        return bytes(self._writer.raw_rpm_encode(0, r.rotors[0]).pack(self._writer))


def pulses(controls: Sequence[float], shares: Sequence[int]) -> list[float]:
    """Controls as the pulses [us] that a servo mapping speaks of; what is no number drives nothing.

    Args:
        controls: of the outputs from 1.
        shares: outputs that go from 0 to 1; the others go from -1 to 1.
    """
    widths = []
    for number, control in enumerate(controls, start=1):
        if not math.isfinite(control):
            widths.append(float(NO_PULSE))
        elif number in shares:
            widths.append(CENTRE - HALF + 2.0 * HALF * min(1.0, max(0.0, control)))
        else:
            widths.append(CENTRE + HALF * min(1.0, max(-1.0, control)))
    return widths


def _microseconds(time: float) -> int:
    return round(1e6 * time)


def _short(value: float) -> int:
    return max(-32_768, min(32_767, round(value)))
