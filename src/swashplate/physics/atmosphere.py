"""The international standard atmosphere's density (ISO 2533:1975), troposphere."""

from __future__ import annotations

SEA_LEVEL_DENSITY = 1.225
"""kg/m^3."""


def air_density(altitude: float, *, warmer: float = 0.0) -> float:
    """Density [kg/m^3] at a pressure altitude [m] up to 11,000 m, `warmer` [K] than the standard day."""
    standard = 288.15 - 0.0065 * altitude
    pressure_ratio: float = (standard / 288.15) ** 5.25588
    return SEA_LEVEL_DENSITY * pressure_ratio * 288.15 / (standard + warmer)
