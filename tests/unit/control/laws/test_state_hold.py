"""A hold by state feedback holds, or says why it cannot."""

from __future__ import annotations

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import SwashError


def test_gains_too_fast_for_the_rate_are_refused() -> None:
    """Unsaid, the CoaX spins at 10 rad/s under it, with one motor at its limit."""
    coax = sp.vehicle("coax")
    start = sp.trim(coax)
    with pytest.raises(SwashError, match=r"coax: .*too fast for 50 samples a second.* 2\.21 times.*higher rate="):
        sp.state_hold(coax, start, rate=50.0)
    assert sp.state_hold(coax, start).rate == 100.0  # what its gains allow


@pytest.mark.proof
def test_at_the_rate_that_its_gains_allow_it_holds() -> None:
    coax = sp.vehicle("coax")
    start = sp.trim(coax)
    hold = sp.state_hold(coax, start)
    held = sp.simulate_closed_loop(coax, hold, duration=5.0, start=start)
    assert np.abs(held.values("r")).max() < 0.1
    assert np.abs(held.values("z")).max() < 0.02


@pytest.mark.parametrize("name", ["raptor50", "crazyflie", "x8"])
def test_others_are_held_at_the_usual_rate(name: str) -> None:
    vehicle = sp.vehicle(name)
    assert sp.state_hold(vehicle, sp.trim(vehicle)).rate == 50.0
