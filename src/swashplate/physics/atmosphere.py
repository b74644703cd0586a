"""The standard atmosphere's density (ISO 2533:1975; U.S. Standard Atmosphere 1976, the same to 32 km), to 20 km."""

from __future__ import annotations

import math

from swashplate.physics.backend import Backend, Scalar

SEA_LEVEL_DENSITY = 1.225
"""kg/m^3."""
_KELVIN, _LAPSE, _TROPOPAUSE = 288.15, 0.0065, 11_000.0
_EXPONENT = 5.25588
_RADIUS = 6356766.0
"""m, of the atmosphere's Earth: geopotential altitude is R h / (R + h)."""
_SCALE = 6341.62
"""m: the pressure of the isothermal layer falls by e in it, R T / g at 216.65 K."""


def air_density(altitude: float, *, warmer: float = 0.0) -> float:
    """Density [kg/m^3] at a pressure altitude [m] up to 11,000 m, `warmer` [K] than the standard day."""
    standard = _KELVIN - _LAPSE * altitude
    pressure_ratio: float = (standard / _KELVIN) ** _EXPONENT
    return SEA_LEVEL_DENSITY * pressure_ratio * _KELVIN / (standard + warmer)


def standard_altitude(density: float) -> float:
    """Altitude [m] of the standard day where the air has a density [kg/m^3]: the inverse of `air_density`."""
    return float(_KELVIN / _LAPSE * (1.0 - (density / SEA_LEVEL_DENSITY) ** (1.0 / (_EXPONENT - 1.0))))


def temperature_of(density: Scalar, xp: Backend) -> Scalar:
    """Temperature [K] of the standard day's air where it has a density [kg/m^3], as an equation."""
    tropopause = _KELVIN - _LAPSE * _TROPOPAUSE
    return xp.maximum(tropopause, _KELVIN * (density / SEA_LEVEL_DENSITY) ** (1.0 / (_EXPONENT - 1.0)))


def sound_speed(temperature: Scalar, xp: Backend) -> Scalar:
    """Speed of sound [m/s] in air of a temperature [K] (ISO 2533:1975, eq. 21): 340.3 at 288.15."""
    return 20.046796 * xp.sqrt(temperature)


def viscosity(temperature: Scalar, xp: Backend) -> Scalar:
    """Dynamic viscosity of air [Pa s] at a temperature [K] (Sutherland's law, ISO 2533:1975, eq. 22)."""
    return 1.458e-6 * temperature * xp.sqrt(temperature) / (temperature + 110.4)


def density_at(height: Scalar, xp: Backend) -> Scalar:
    """Density [kg/m^3] at a geometric height [m] up to 20 km, as an equation."""
    geopotential = _RADIUS * height / (_RADIUS + height)
    below = xp.minimum(geopotential, _TROPOPAUSE)
    troposphere = SEA_LEVEL_DENSITY * (1.0 - _LAPSE / _KELVIN * below) ** (_EXPONENT - 1.0)
    return troposphere * math.e ** ((below - geopotential) / _SCALE)
