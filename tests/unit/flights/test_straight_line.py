"""Straight lines taken out of signals, as SciPy takes them out."""

from __future__ import annotations

import numpy as np
from scipy.signal import detrend

from swashplate.flights.conditioning.filters import detrended


def test_the_best_line_is_taken_out_of_every_column() -> None:
    values = np.cumsum(np.random.default_rng(0).standard_normal((300, 3)), axis=0)
    np.testing.assert_allclose(detrended(values), detrend(values, axis=0), atol=1e-10)
    np.testing.assert_allclose(detrended(values[:, 0]), detrend(values[:, 0]), atol=1e-10)
    np.testing.assert_allclose(detrended(3.0 + 2.0 * np.arange(50.0)), 0.0, atol=1e-10)


def test_one_sample_is_its_own_line() -> None:
    assert detrended(np.array([4.0])).tolist() == [0.0]
