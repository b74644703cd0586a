"""Huber's loss: its middle, its tails, and weights that are its slope."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.identification.core.robust import KNEE, huber, weights


def test_the_middle_is_quadratic_and_the_tails_are_linear() -> None:
    inside = np.linspace(-0.999 * KNEE, 0.999 * KNEE, 11)
    assert huber(inside) == pytest.approx(0.5 * inside @ inside)
    assert huber(np.array([KNEE + 3.0])) - huber(np.array([KNEE + 2.0])) == pytest.approx(KNEE)
    assert huber(np.array([-9.0])) == huber(np.array([9.0]))


@pytest.mark.parametrize("size", [-50.0, -4.1, -3.9, -0.2, 0.3, 3.9, 4.1, 20.0])
def test_weight_times_residual_is_the_slope(size: float) -> None:
    step = 1e-6
    slope = (huber(np.array([size + step])) - huber(np.array([size - step]))) / (2.0 * step)
    assert float(weights(np.array([size]))[0]) * size == pytest.approx(slope, rel=1e-8)


def test_an_outlier_hardly_moves_a_mean() -> None:
    """The most likely level of noise with one sample in fifty a thousand sigmas away."""
    rng = np.random.default_rng(1)
    sample = np.concatenate([rng.standard_normal(490), np.full(10, 1000.0)])
    level = 0.0
    for _ in range(100):
        w = weights(sample - level)
        level = float(w @ sample / w.sum())
    assert abs(level) < 0.2
    assert np.mean(sample) > 19.0
