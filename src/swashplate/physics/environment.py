"""What surrounds a vehicle: wind, air (ISO 2533), gravity and the battery's voltage."""

from __future__ import annotations

from typing import Any, NamedTuple

from swashplate.physics.backend import Scalar
from swashplate.physics.frames import Vector

LABORATORY_GRAVITY = 9.81
"""m/s^2, the value that the published hover figures of the CoaX were computed with (Zurich: 9.807)."""
USUAL: Any = None
"""Not said: what is usual for the vehicle (`swashplate.models.surroundings.environment_of` fills it in)."""


class Environment(NamedTuple):
    """Surroundings at one instant; wind is the air's velocity in local axes (north-east-down).

    Air density [kg/m^3], gravity [m/s^2] and battery voltage [V] that are not given are the vehicle's own: those of its
    card, or 1.225 kg/m^3 (sea level of the standard atmosphere) and 9.81 m/s^2 where the card has none, and the card's
    nominal voltage.
    """

    wind_north: Scalar = 0.0
    wind_east: Scalar = 0.0
    wind_down: Scalar = 0.0
    air_density: Scalar = USUAL
    gravity: Scalar = USUAL
    voltage: Scalar = USUAL

    @property
    def wind(self) -> Vector:
        return Vector(self.wind_north, self.wind_east, self.wind_down)


SEA_LEVEL_DENSITY = 1.225
"""kg/m^3."""
_KELVIN, _LAPSE = 288.15, 0.0065
_EXPONENT = 5.25588


def air_density(altitude: float, *, warmer: float = 0.0) -> float:
    """Density [kg/m^3] at a pressure altitude [m] up to 11,000 m, `warmer` [K] than the standard day."""
    standard = _KELVIN - _LAPSE * altitude
    pressure_ratio: float = (standard / _KELVIN) ** _EXPONENT
    return SEA_LEVEL_DENSITY * pressure_ratio * _KELVIN / (standard + warmer)


def standard_altitude(density: float) -> float:
    """Altitude [m] of the standard day where the air has a density [kg/m^3]: the inverse of `air_density`."""
    return float(_KELVIN / _LAPSE * (1.0 - (density / SEA_LEVEL_DENSITY) ** (1.0 / (_EXPONENT - 1.0))))
