"""Filters without `scipy.signal`: the same numbers as SciPy's, to rounding."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from swashplate.flights.conditioning.digital_filters import both_ways, butterworth, forwards, savitzky_golay

RNG = np.random.default_rng(0)
WALK = np.cumsum(RNG.normal(size=(600, 2)), axis=0)


@pytest.mark.parametrize("order", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("cutoff", [1.0, 5.0, 20.0, 49.0, (0.3, 5.0), (1.0, 45.0)], ids=str)
def test_butterworth_is_that_of_scipy(order: int, cutoff: float | tuple[float, float]) -> None:
    band = isinstance(cutoff, tuple)
    known = signal.butter(order, cutoff, "bandpass" if band else "lowpass", fs=100.0, output="sos")
    own, size = butterworth(order, cutoff, rate=100.0), np.max(np.abs(WALK))
    assert own.shape == known.shape
    np.testing.assert_allclose(both_ways(own, WALK), signal.sosfiltfilt(known, WALK, axis=0), atol=1e-11 * size)
    rest = signal.sosfilt_zi(known)[:, :, None] * WALK[0]
    expected = signal.sosfilt(known, WALK, axis=0, zi=rest)[0]
    np.testing.assert_allclose(forwards(own, WALK), expected, atol=1e-11 * size)


@pytest.mark.parametrize(
    ("length", "order", "derivative"), [(13, 3, 0), (13, 3, 1), (5, 2, 0), (201, 1, 0), (11, 4, 2)]
)
def test_savitzky_golay_is_that_of_scipy(length: int, order: int, derivative: int) -> None:
    expected = signal.savgol_filter(WALK, length, order, deriv=derivative, delta=0.01, axis=0)
    own = savitzky_golay(WALK, length, order, derivative=derivative, step=0.01)
    np.testing.assert_allclose(own, expected, atol=1e-12 * np.max(np.abs(expected)))
    np.testing.assert_allclose(
        savitzky_golay(WALK[:, 0], length, order, derivative=derivative, step=0.01), own[:, 0], rtol=1e-13
    )
