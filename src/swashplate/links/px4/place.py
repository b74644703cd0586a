"""Where a PX4 simulation is: Zurich, as PX4's own simulators have it, with its field and a standard atmosphere."""

from __future__ import annotations

import math

from swashplate.physics.backend import FloatBackend
from swashplate.physics.frames import Euler, Vector, local_to_body

LATITUDE, LONGITUDE, ALTITUDE = 47.397742, 8.545594, 488.0
"""deg, deg, m above the sea."""
FIELD = Vector(0.2146, 0.0124, 0.4293)
"""Gauss, north-east-down: 0.48 in all, declination 3.3 deg, inclination 63.4 deg (World Magnetic Model, rounded)."""
EARTH = 6_371_000.0
"""m, the sphere that PX4's map projection uses."""
_FLOATS = FloatBackend()


def coordinates(place: Vector) -> tuple[float, float, float]:
    """Latitude, longitude [deg] and altitude [m] of a place north-east-down of home [m]."""
    north = math.degrees(place.x / EARTH)
    east = math.degrees(place.y / (EARTH * math.cos(math.radians(LATITUDE))))
    return LATITUDE + north, LONGITUDE + east, ALTITUDE - place.z


def pressure(altitude: float) -> float:
    """Of the standard atmosphere [hPa] (ISO 2533:1975), up to 11,000 m."""
    return float(1013.25 * (1.0 - 0.0065 * altitude / 288.15) ** 5.25588)


def temperature(altitude: float) -> float:
    """Of the standard atmosphere [deg C]."""
    return 15.0 - 0.0065 * altitude


def field_seen(attitude: tuple[float, float, float]) -> Vector:
    """The magnetic field in body axes [Gauss]."""
    return local_to_body(FIELD, Euler(*attitude), _FLOATS)


def quaternion(attitude: tuple[float, float, float]) -> tuple[float, float, float, float]:
    """Roll, pitch, yaw [rad] as w, x, y, z (Stevens, Lewis and Johnson 2016, eq. 1.8-18)."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(0.5 * a), math.sin(0.5 * a)) for a in attitude)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )
