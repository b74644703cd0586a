"""The Earth under a flight: an ellipsoid that turns, its gravity, and its standard atmosphere.

For flights of many kilometres or from great heights, and to hold the rigid body against reference simulators. Small
helicopters fly on a flat Earth (`Environment`), which is what everything else here takes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

from swashplate.errors import SwashError
from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.frames import Vector

RADIUS: Final = 6378137.0
"""Equatorial radius [m] (WGS 84, NIMA TR8350.2, 2000)."""
FLATTENING: Final = 1.0 / 298.257223563
GM: Final = 3.986004418e14
"""Gravitational constant times mass, air included [m^3/s^2] (ibid.)."""
J2: Final = 1.082626684e-3
"""Second zonal harmonic, from WGS 84's C20 (ibid.)."""
SPIN: Final = 7.292115e-5
"""rad/s (ibid.)."""
ROUND: Final = 6371008.8
"""Mean radius [m] of the Earth as a sphere (IUGG)."""

GravityModel = Literal["constant", "inverse-square", "J2"]
Rows = tuple[Vector, Vector, Vector]
"""Unit vectors north, east and down, in Earth-fixed axes."""


@dataclass(frozen=True)
class Earth:
    """Where a flight's local axes begin, and what the Earth under it is like.

    Attributes:
        latitude, longitude: geodetic, of the origin of x, y, z [rad]. altitude: of it above the ellipsoid [m].
        gravity: "J2" (gravitation of the ellipsoid; turning adds the centrifugal part), "inverse-square", or "constant"
            (the environment's, along the vertical, centrifugal part included).
        rotating: whether it turns. sphere: a sphere in place of the ellipsoid of WGS 84.
        standard_air: density of the standard atmosphere at the altitude in place of the environment's.
    """

    latitude: float
    longitude: float
    altitude: float = 0.0
    gravity: GravityModel = "J2"
    rotating: bool = True
    sphere: bool = False
    standard_air: bool = True

    def __post_init__(self) -> None:
        if not abs(self.latitude) <= math.pi / 2.0:
            raise SwashError(f"is {self.latitude!r}, expected -pi/2 to pi/2 [rad].", channel="latitude")
        if self.gravity not in ("constant", "inverse-square", "J2"):
            raise SwashError(f"is {self.gravity!r}, expected constant, inverse-square or J2.", channel="gravity")

    @property
    def radius(self) -> float:
        """Equatorial radius [m]."""
        return ROUND if self.sphere else RADIUS

    @property
    def flattening(self) -> float:
        return 0.0 if self.sphere else FLATTENING

    @property
    def spin(self) -> float:
        """rad/s about the axis to the north pole."""
        return SPIN if self.rotating else 0.0


def place(earth: Earth, latitude: Scalar, longitude: Scalar, altitude: Scalar, xp: Backend) -> Vector:
    """Earth-fixed axes (to Greenwich on the equator, to 90 deg east, to the north pole) of a geodetic place [m]."""
    e2 = earth.flattening * (2.0 - earth.flattening)
    s, c = xp.sin(latitude), xp.cos(latitude)
    across = earth.radius / xp.sqrt(1.0 - e2 * s * s)
    level = (across + altitude) * c
    return Vector(level * xp.cos(longitude), level * xp.sin(longitude), (across * (1.0 - e2) + altitude) * s)


def geodetic(earth: Earth, at: Vector, xp: Backend) -> tuple[Scalar, Scalar, Scalar]:
    """Latitude, longitude [rad] and altitude [m] of a place in Earth-fixed axes (Bowring 1976)."""
    a, f = earth.radius, earth.flattening
    e2, b = f * (2.0 - f), a * (1.0 - f)
    level = xp.sqrt(at.x * at.x + at.y * at.y)
    reduced = xp.atan2(at.z * a, level * b)
    s, c = xp.sin(reduced), xp.cos(reduced)
    latitude = xp.atan2(at.z + e2 / (1.0 - e2) * b * s * s * s, level - e2 * a * c * c * c)
    s, c = xp.sin(latitude), xp.cos(latitude)
    return latitude, xp.atan2(at.y, at.x), level * c + at.z * s - a * xp.sqrt(1.0 - e2 * s * s)


def local_axes(latitude: Scalar, longitude: Scalar, xp: Backend) -> Rows:
    """North, east and down at a place."""
    s, c, sl, cl = xp.sin(latitude), xp.cos(latitude), xp.sin(longitude), xp.cos(longitude)
    return Vector(-s * cl, -s * sl, c), Vector(-sl, cl, 0.0), Vector(-c * cl, -c * sl, -s)


def acceleration(earth: Earth, at: Vector, down: Vector, constant: Scalar, xp: Backend) -> Vector:
    """What a body at rest on the Earth feels as gravity, in Earth-fixed axes [m/s^2], centrifugal part included.

    Args:
        earth: its model. at: the place. down: the vertical there. constant: gravity of the model "constant" [m/s^2].

    Source:
        Stevens, Lewis and Johnson (2016), eq. 1.6-12, for J2.
    """
    if earth.gravity == "constant":
        return down.scaled(constant)
    square = at.x * at.x + at.y * at.y + at.z * at.z
    pull = -GM / (square * xp.sqrt(square))
    across = along = 1.0
    if earth.gravity == "J2":
        share, tilt = 1.5 * J2 * RADIUS * RADIUS / square, 5.0 * at.z * at.z / square
        across, along = 1.0 + share * (1.0 - tilt), 1.0 + share * (3.0 - tilt)
    away = earth.spin * earth.spin
    return Vector((pull * across + away) * at.x, (pull * across + away) * at.y, pull * along * at.z)
