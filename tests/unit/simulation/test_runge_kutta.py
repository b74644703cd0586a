"""Runge and Kutta's step: its order."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.simulation.discretisation import rk4_step


def falling(x: float, w: float) -> float:
    """x' = w - x^2: from zero x = tanh(t) under a w of one."""
    return w - x * x


def test_half_the_step_leaves_a_sixteenth_of_the_error() -> None:
    off = []
    for count in (8, 16):
        x = 0.0
        for _ in range(count):
            x = rk4_step(falling, x, lambda _: 1.0, 1.0 / count)
        off.append(abs(x - np.tanh(1.0)))
    assert 13.0 < off[0] / off[1] < 19.0
    assert off[1] < 1e-6


def test_a_cubic_drive_is_met_without_error() -> None:
    """Start, middle twice and end with Simpson's weights."""
    found = rk4_step(lambda x, w: w + 0.0 * x, 0.0, lambda s: 4.0 * (0.5 * s) ** 3, 0.5)
    assert found == pytest.approx(0.5**4, rel=1e-15)
