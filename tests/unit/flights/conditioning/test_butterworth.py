"""Butterworth filters: SciPy's, and what a filter of that name promises."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from swashplate.flights.conditioning.filters import both_ways, butterworth_sections

FILTERS = [
    (4, (40.0,), 300.0),
    (4, (0.5,), 100.0),
    (3, (10.0,), 100.0),
    (2, (0.3, 8.0), 100.0),
    (1, (0.3, 40.0), 100.0),
]


def _scipys(order: int, corners: tuple[float, ...], rate: float) -> np.ndarray:
    kind = "bandpass" if len(corners) == 2 else "lowpass"
    return signal.butter(order, corners if len(corners) == 2 else corners[0], kind, fs=rate, output="sos")


@pytest.mark.parametrize(("order", "corners", "rate"), FILTERS)
def test_both_ways_it_is_scipys(order: int, corners: tuple[float, ...], rate: float) -> None:
    """Of walks that begin and end far from zero, one column and several."""
    walks = 5.0 + np.cumsum(np.random.default_rng(1).standard_normal((2000, 3)), axis=0)
    sections = butterworth_sections(order, np.array(corners), rate=rate)
    for values in (walks, walks[:, 0]):
        found = both_ways(sections, values, padding=30)
        expected = signal.sosfiltfilt(_scipys(order, corners, rate), values, axis=0, padlen=30)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-11 * np.abs(values).max())


@pytest.mark.parametrize(("order", "corners", "rate"), FILTERS)
def test_half_the_power_passes_at_the_corners(order: int, corners: tuple[float, ...], rate: float) -> None:
    sections = butterworth_sections(order, np.array(corners), rate=rate)
    gain = np.abs(signal.sosfreqz(sections, np.array(corners), fs=rate)[1])
    np.testing.assert_allclose(gain**2, 0.5, rtol=1e-9)
    assert np.all(np.abs(np.concatenate([np.roots(row[3:]) for row in sections])) < 1.0)
