"""The standard atmosphere's density (ISO 2533:1975; U.S. Standard Atmosphere 1976), to 11 km."""

from __future__ import annotations

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
