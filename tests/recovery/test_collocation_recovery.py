"""Simulate an unstable model in gusts, identify it by collocation from zero: the bounds mean what they say."""

from __future__ import annotations

import numpy as np
import pytest

import swashplate as sp
from tipping import GUST, NOISE, OUTPUTS, TRUTH, tipped, tipping

SEEDS = 60


def distances(seeds: range) -> np.ndarray:
    """Errors in predicted standard deviations, (n_seeds, n_parameters)."""
    rows = []
    for seed in seeds:
        fit = sp.identify(tipping(), tipped(seed), free=list(TRUTH), outputs=OUTPUTS, method="collocation")
        assert fit.converged
        rows.append([(fit[name].value - TRUTH[name]) / fit[name].sigma for name in TRUTH])
    return np.array(rows)


def test_an_unstable_model_is_recovered_from_zero() -> None:
    fit = sp.identify(tipping(), tipped(1), free=list(TRUTH), outputs=OUTPUTS, method="collocation")
    assert fit.converged
    assert not fit.failed
    for name, value in TRUTH.items():
        assert fit[name].start == 0.0
        assert abs(fit[name].value - value) < 2.0 * fit[name].sigma, name
        assert fit[name].sigma < 0.3 * abs(value), name
    told = {c.name: c for c in fit.constants}
    for name, value in (*zip(OUTPUTS, NOISE, strict=True), ("gust q", GUST[1])):
        constant = told[name if name.startswith("gust") else f"noise {name}"]
        assert constant.value == pytest.approx(value, abs=3.0 * constant.sigma), name


@pytest.mark.proof
def test_output_error_does_not_get_there_from_zero() -> None:
    flown = tipped(1)
    fit = sp.identify(tipping(), flown, free=list(TRUTH), outputs=OUTPUTS, method="output-error", iterations=40)
    assert all(abs(fit[name].value - value) > 0.5 * abs(value) for name, value in TRUTH.items()), fit


@pytest.mark.proof
def test_a_few_seeds_lie_within_their_bounds() -> None:
    found = distances(range(2, 8))
    assert np.mean(np.abs(found) < 2.0) >= 0.8
    assert np.abs(found).max() < 4.0
    assert 0.5 < np.sqrt(np.mean(found**2)) < 1.6


@pytest.mark.proof
def test_many_seeds_scatter_as_predicted() -> None:
    found = distances(range(SEEDS))
    share, scatter = np.mean(np.abs(found) < 2.0), found.std(axis=0, ddof=1)
    print(
        f"{100 * share:.1f} % within two sigmas; scatter {np.round(scatter, 2)}, mean {np.round(found.mean(axis=0), 2)}"
    )
    assert 0.90 <= share <= 0.99
    assert np.all((scatter > 0.75) & (scatter < 1.3))
    assert np.all(np.abs(found.mean(axis=0)) < 4.0 / np.sqrt(SEEDS))
