"""Levels of handling qualities: boundaries of the standards as data, each with its source and whether it was checked.

ADS-33E-PRF was written for manned helicopters. A small one is a scale model of them: with the length N times smaller,
times shrink and frequencies grow by sqrt(N) (Froude scaling).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from swashplate.errors import SwashError

REFERENCE_RADIUS = 8.18
"""Rotor radius [m] of the UH-60, the helicopter of whose size the boundaries are taken to be (53.67 ft diameter)."""

Kind = Literal["frequency", "time", "ratio"]


@dataclass(frozen=True)
class Boundary:
    """What a number must reach for Level 1 and for Level 2.

    Attributes:
        name: of the quantity.
        level1, level2: the boundaries [rad/s for a frequency, s for a time]; NaN where there is none.
        least: True where the number must be at least the boundary, False where at most.
        kind: how it scales with size.
        source: standard and paragraph.
        checked: whether the number was compared with the standard's own text. The text was not at hand for those that
            were not: they are as the field quotes them.
    """

    name: str
    level1: float
    level2: float
    least: bool
    kind: Kind
    source: str
    checked: bool = False

    def scaled(self, scale: float) -> tuple[float, float]:
        """Both boundaries for a vehicle `scale` times smaller than the reference."""
        factor = {"frequency": math.sqrt(scale), "time": 1.0 / math.sqrt(scale), "ratio": 1.0}[self.kind]
        return self.level1 * factor, self.level2 * factor

    def level(self, value: float, *, scale: float = 1.0) -> int | None:
        """1, 2 or 3; 2 too for what misses a Level 1 that has no boundary below; None for no number."""
        first, second = self.scaled(scale)
        if not math.isfinite(value) or not math.isfinite(first):
            return None
        good = [value >= b if self.least else value <= b for b in (first, second)]
        return 1 if good[0] else 2 if good[1] or not math.isfinite(second) else 3


_BANDWIDTH = "ADS-33E-PRF (2000), hover and low speed, small-amplitude {}, {}; small phase delay"
_TRACKING, _OTHER = "target acquisition and tracking", "all other tasks, good sight, full attention"
BANDWIDTH: dict[str, dict[str, Boundary]] = {
    "tracking": {
        "phi": Boundary("roll bandwidth", 3.5, 2.0, True, "frequency", _BANDWIDTH.format("roll", _TRACKING)),
        "theta": Boundary("pitch bandwidth", 2.0, 1.0, True, "frequency", _BANDWIDTH.format("pitch", _TRACKING)),
        "psi": Boundary("yaw bandwidth", 3.5, 2.0, True, "frequency", _BANDWIDTH.format("yaw", _TRACKING)),
    },
    "other": {
        "phi": Boundary("roll bandwidth", 2.0, 0.5, True, "frequency", _BANDWIDTH.format("roll", _OTHER)),
        "theta": Boundary("pitch bandwidth", 1.0, 0.5, True, "frequency", _BANDWIDTH.format("pitch", _OTHER)),
        "psi": Boundary("yaw bandwidth", 2.0, 0.5, True, "frequency", _BANDWIDTH.format("yaw", _OTHER)),
    },
}
"""By task and attitude. Only the part of the boundary that is vertical over phase delay."""
TASKS = tuple(BANDWIDTH)

_GUIDE = "Test Guide for ADS-33E-PRF (Blanken et al. 2008), disturbance rejection"
REJECTION: dict[str, Boundary] = {
    "phi": Boundary("roll disturbance-rejection bandwidth", 0.9, math.nan, True, "frequency", _GUIDE),
    "theta": Boundary("pitch disturbance-rejection bandwidth", 0.5, math.nan, True, "frequency", _GUIDE),
    "psi": Boundary("yaw disturbance-rejection bandwidth", 0.7, math.nan, True, "frequency", _GUIDE),
}
REJECTION_PEAK = Boundary("disturbance-rejection peak [dB]", 5.0, math.nan, False, "ratio", _GUIDE)
ATTITUDE_COUPLING = Boundary(
    "off-axis over on-axis attitude", 0.25, 0.60, False, "ratio", "ADS-33E-PRF (2000), 3.3.9, pitch due to roll"
)
GAIN_MARGIN = Boundary(
    "gain margin [dB]", 6.0, math.nan, True, "ratio", "MIL-DTL-9490E, SAE AS94900, stability margins"
)
PHASE_MARGIN = Boundary("phase margin [deg]", 45.0, math.nan, True, "ratio", "MIL-DTL-9490E, SAE AS94900")


def delay_margin(required: float) -> Boundary:
    """The further delay that every loop, and all together, must stand [s], as a boundary in milliseconds."""
    source = "of this check, not of a standard: a sample of the controller and its computation, or as asked for"
    return Boundary("delay margin [ms]", 1e3 * required, math.nan, True, "ratio", source, checked=True)


def froude_scale(radius: float, *, reference: float = REFERENCE_RADIUS) -> float:
    """How many times smaller a rotor is than the reference: N = reference / radius.

    Args:
        radius: of the main rotor [m].
        reference: of the full-size helicopter [m].

    Raises:
        SwashError: for a radius that is not positive.
    """
    if not (radius > 0.0 and reference > 0.0 and math.isfinite(reference / radius)):
        raise SwashError(
            f"is {radius:g} m against {reference:g} m, expected two positive radii.", channel="rotor_radius"
        )
    return reference / radius
