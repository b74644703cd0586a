"""Simulate, identify, recover: what balances the yaw, and how roll and pitch differ, in gusts and under feedback."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from scipy.signal import lfilter

import swashplate as sp
from swashplate.identification.core.result import Result

FREE = (
    "linkage_lower",
    "k_torque_upper",
    "linkage_asymmetry_lower",
    "phase_asymmetry_lower",
    "tau_gust_yaw",
    "drift_yaw",
)
ASYMMETRIES = FREE[2:4]
BENT = {"k_torque_upper": 1.07 * 9.9708e-7, "linkage_asymmetry_lower": 0.12, "phase_asymmetry_lower": -0.1}


@lru_cache(maxsize=3)
def found(truth: tuple[tuple[str, float], ...] = (), horizon: tuple[float, float] | None = None) -> Result:
    """A fit from the published card of ten seconds of an aircraft with some other numbers."""
    flown = sp.vehicle("coax").with_values(dict(truth))
    gusts = lfilter([1.0], [1.0, -0.99], 0.015 * np.random.default_rng(5).standard_normal((2, 1001)))
    flight = sp.simulate(
        flown,
        "multisine:roll+pitch,0.4-4Hz,8s,0.1",
        controller=sp.hover_hold,
        lead=1,
        tail=1,
        wind=(*gusts, 0.0),
    )
    seen = sp.observe(flight, flown, sensors=sp.QUIET, seed=4).condition(rate=100.0, cutoff=0.0)
    return sp.identify(sp.vehicle("coax"), seen, free=list(FREE), horizon=horizon)


@pytest.mark.proof
def test_constants_and_asymmetries_are_found() -> None:
    fit = found(tuple(BENT.items()))
    assert not fit.failed
    for name, value in BENT.items():
        assert abs(fit[name].value - value) < 2.0 * fit[name].sigma_corrected, name
    # The published numbers are far away: a fit that stays there is seen.
    assert abs(fit["k_torque_upper"].value - fit["k_torque_upper"].start) > 5.0 * fit["k_torque_upper"].sigma_corrected
    for name in ASYMMETRIES:
        assert abs(fit[name].value) > 5.0 * fit[name].sigma_corrected, name
    (told,) = (words for words in fit.problems if words.startswith("balance: "))
    assert "k_torque_upper +" in told
    assert fit.noise is not None
    assert fit.noise.tau_gust_yaw > 0.0
    assert fit.noise.tau_gust_vertical == 0.0  # shared with all forces


@pytest.mark.proof
def test_a_symmetric_aircraft_is_found_symmetric() -> None:
    fit = found()
    for name in ASYMMETRIES:
        assert abs(fit[name].value) < 2.0 * fit[name].sigma_corrected, name
        assert fit[name].sigma_corrected < 0.1


@pytest.mark.proof
def test_errors_ahead_find_them_too() -> None:
    fit = found(tuple(BENT.items()), (0.25, 1.0))
    assert fit.settings["horizon"] == [0.25, 1.0]
    assert fit.converged
    for name, value in BENT.items():
        assert abs(fit[name].value - value) < 3.0 * fit[name].sigma_corrected, name
    once = found(tuple(BENT.items()))
    assert fit["linkage_lower"].value != once["linkage_lower"].value
    assert fit.noise == pytest.approx(once.noise)
