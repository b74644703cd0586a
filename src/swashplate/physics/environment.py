"""What surrounds a vehicle: wind, air, gravity and the battery's voltage."""

from __future__ import annotations

from typing import NamedTuple

from swashplate.physics.backend import Scalar
from swashplate.physics.frames import Vector

LABORATORY_GRAVITY = 9.81
"""m/s^2, the value that the published hover figures of the CoaX were computed with (Zurich: 9.807)."""


class Environment(NamedTuple):
    """Surroundings at one instant; wind is the air's velocity in local axes (north-east-down)."""

    wind_north: Scalar = 0.0
    wind_east: Scalar = 0.0
    wind_down: Scalar = 0.0
    air_density: Scalar = 1.2
    gravity: Scalar = LABORATORY_GRAVITY
    voltage: Scalar = 12.22

    @property
    def wind(self) -> Vector:
        return Vector(self.wind_north, self.wind_east, self.wind_down)
