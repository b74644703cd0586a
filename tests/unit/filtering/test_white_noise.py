"""Noise gathered over a sample, and the steady gain under white noise with its slopes, against differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from swashplate.filtering.riccati import STEP, gathered_noise, steady_gain, white_noise_gain

A = np.array([[-0.7, 2.0, 0.0], [0.1, -4.0, 1.0], [0.0, -3.0, -80.0]])
C = np.array([[1.0, 0.0, 0.0], [0.0, 9.81, 0.2]])
INTENSITY, SENSORS, DT = np.array([0.3, 0.02, 1.0]), np.diag([0.01, 0.09]), 0.02


def test_noise_is_gathered_over_a_sample() -> None:
    """Against the sum over many small pieces of it (trapezes)."""
    transition, gathered = gathered_noise(A, np.diag(INTENSITY), DT)
    pieces = [expm(A * s) for s in np.linspace(0.0, DT, 2001)]
    noise = np.array([piece @ np.diag(INTENSITY) @ piece.T for piece in pieces])
    np.testing.assert_allclose(transition, pieces[-1], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(gathered, np.trapezoid(noise, dx=DT / 2000, axis=0), rtol=1e-5, atol=1e-12)


@pytest.mark.parametrize("moved", range(4))
def test_a_gain_moves_as_differences_say(moved: int) -> None:
    random = np.random.default_rng(moved)
    parts = (A, INTENSITY, C, SENSORS)
    by = [random.standard_normal(part.shape) * (number == moved) for number, part in enumerate(parts)]
    by[3] = by[3] + by[3].T
    here = [np.stack([part, part + 1j * STEP * change]) for part, change in zip(parts, by, strict=True)]
    gain, covariance = white_noise_gain(here[0], here[1], here[2], here[3], DT)
    phi, gathered = gathered_noise(A, np.diag(INTENSITY), DT)
    np.testing.assert_array_equal(gain[0].real, steady_gain(phi, C, gathered, SENSORS)[0])
    h = 1e-6
    ends = [
        white_noise_gain(*(np.array([part + side * h * change]) for part, change in zip(parts, by, strict=True)), DT)
        for side in (1.0, -1.0)
    ]
    for told, high, low in zip((gain, covariance), *ends, strict=True):
        slopes = (high[0].real - low[0].real) / (2.0 * h)
        np.testing.assert_allclose(told[1].imag / STEP, slopes, rtol=1e-5, atol=1e-6 * np.max(np.abs(slopes)))
