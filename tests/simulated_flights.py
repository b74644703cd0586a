"""One simulated flight for many tests: who shares its length and rate shares compiled code."""

from __future__ import annotations

from functools import lru_cache

import swashplate as sp
from swashplate.flights.flight import Flight
from swashplate.simulation.sensors import QUIET

FREE = ("tau_f_upper", "linkage_lower")
TIE = "design_angle_lower = 2 * linkage_lower"  # nothing depends on that angle, so the fit is as without the tie


@lru_cache(maxsize=1)
def ten_seconds() -> Flight:
    """What motion capture without faults and a battery log of 10 s of hover with independent roll and pitch inputs."""
    coax = sp.vehicle("coax")
    flight = sp.simulate(coax, "multisine:roll+pitch,0.4-4Hz,8s,0.1", controller=sp.hover_hold, lead=1, tail=1)
    return sp.observe(flight, coax, sensors=QUIET, seed=3)
