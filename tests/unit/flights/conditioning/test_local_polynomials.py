"""Polynomials fitted around each sample: SciPy's, and polynomials are what they were."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import savgol_filter

from swashplate.flights.conditioning.local_polynomials import local_polynomials


@pytest.mark.parametrize(("window", "order"), [(5, 2), (11, 3), (21, 1), (51, 3)])
def test_it_is_scipys(window: int, order: int) -> None:
    values = 3.0 + np.cumsum(np.random.default_rng(2).standard_normal((60, 2)), axis=0)
    for given in (values, values[:, 0]):
        smooth, slopes = local_polynomials(given, window, order), local_polynomials(given, window, order, slope=0.01)
        np.testing.assert_allclose(smooth, savgol_filter(given, window, order, axis=0), atol=1e-11)
        expected = savgol_filter(given, window, order, deriv=1, delta=0.01, axis=0)
        np.testing.assert_allclose(slopes, expected, atol=1e-9)


def test_a_cubic_stays_and_has_its_slope_to_the_ends() -> None:
    time = np.linspace(-1.0, 1.0, 41)
    np.testing.assert_allclose(local_polynomials(time**3 - time, 9, 3), time**3 - time, atol=1e-12)
    np.testing.assert_allclose(local_polynomials(time**3 - time, 9, 3, slope=0.05), 3.0 * time**2 - 1.0, atol=1e-11)
    assert np.abs(local_polynomials(time**5, 9, 3) - time**5).max() > 1e-6
