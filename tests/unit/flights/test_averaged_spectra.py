"""Welch's spectra: SciPy's, and the power of a channel is what its density sums to."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from swashplate.flights.averaged_spectra import cross_density, power_density


@pytest.mark.parametrize("window", [400, 401, 2000])
@pytest.mark.parametrize("line", [False, True])
def test_they_are_scipys(window: int, line: bool) -> None:
    first, second = np.cumsum(np.random.default_rng(3).standard_normal((2, 2000)), axis=1)
    frequency, cross = cross_density(first, second, rate=100.0, window=window, line=line)
    taken = "linear" if line else "constant"
    lines, expected = signal.csd(first, second, 100.0, nperseg=window, detrend=taken)
    np.testing.assert_allclose(frequency, lines, rtol=1e-14)
    np.testing.assert_allclose(cross, expected, atol=1e-12 * np.abs(expected).max())
    power = power_density(first, rate=100.0, window=window, line=line)[1]
    np.testing.assert_allclose(power, signal.welch(first, 100.0, nperseg=window, detrend=taken)[1], rtol=1e-8)


def test_a_sines_power_is_in_its_line() -> None:
    time = np.arange(4000) / 100.0
    frequency, power = power_density(3.0 * np.sin(2.0 * np.pi * 5.0 * time), rate=100.0, window=400)
    assert frequency[np.argmax(power)] == 5.0
    np.testing.assert_allclose(np.sum(power) * frequency[1], 4.5, rtol=1e-6)
