"""A CoaX that hovers under feedback in moving air is identified again.

The counterpart of the July flight in short: one seed; both flights and more
seeds: research/simulated_counterpart.py.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

import swashplate as sp
from swashplate.flights.flight import Flight

TRUTH = {
    "linkage_lower": 0.183, "tau_f_lower": 0.03, "o_zeta_lower": -0.069, "o_zeta_upper": -0.268, "tau_f_upper": 1.8,
    "hub_stiffness_upper": 0.163, "a_alpha_p_linear": 0.015, "a_beta_q_linear": 0.015, "a_alpha_v_linear": 0.029,
    "a_beta_u_linear": 0.029, "a_alpha_u_linear": 0.029, "a_beta_v_linear": 0.029, "gyroscopic": 0.38,
    "damping_r": 0.00275, "damping_w": 0.36, "inertia_zz": 3.17e-4, "bar_heading_transport": 1.0,
}  # fmt: skip
"""What July's fit finds, about."""


def _flight(gusts: float) -> Flight:
    aircraft = sp.vehicle("coax").with_values(TRUTH)
    wind = lfilter([1.0], [1.0, -0.99], gusts * np.random.default_rng(101).standard_normal((2, 2001)))
    flown = sp.simulate(
        aircraft,
        "multisine:roll+pitch+yaw+heave,0.3-4Hz,18s,0.05",
        controller=sp.hover_hold,
        lead=1,
        tail=1,
        wind=(*wind, 0.0),
    )
    return sp.observe(flown, aircraft, sensors=sp.QUIET, seed=1).condition(rate=100.0, cutoff=0.0)


def _off(fit: sp.Result) -> dict[str, float]:
    """By how many corrected sigmas each estimate is off."""
    truth = sp.vehicle("coax").with_values(TRUTH).card.values()
    return {e.name: abs(e.value - truth[e.name]) / e.sigma_corrected for e in fit.estimates if not e.tie}


@pytest.mark.proof
def test_bounds_hold_in_moving_air_with_a_wind_and_not_without() -> None:
    """Without it tau_f_upper is tens of sigmas off; the fit says that the air may have moved."""
    seen = _flight(0.015)
    plain, windy = (sp.identify(sp.vehicle("coax"), seen, keep_unexcited=True, wind=wind) for wind in (False, True))
    assert any(words.startswith("gusts of ") for words in plain.problems)
    assert not any(words.startswith("gusts of ") for words in windy.problems)
    assert _off(plain)["tau_f_upper"] > 5.0
    assert np.mean([off < 2.0 for off in _off(plain).values()]) < 0.8
    assert np.mean([off < 2.0 for off in _off(windy).values()]) > 0.85
    assert windy.noise is not None
    assert float(windy.noise.wind) * np.sqrt(0.5 * float(windy.noise.tau_wind)) == pytest.approx(0.106, rel=0.2)
