"""Runge and Kutta's step: its order, its two forms, and what runs it."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from swashplate.simulation.dynamics import enable_double_precision
from swashplate.simulation.runge_kutta import rk4_step


def falling(x: float, w: float) -> float:
    """x' = w - x^2: from zero x = tanh(t) under a w of one."""
    return w - x * x


def test_half_the_step_leaves_a_sixteenth_of_the_error() -> None:
    off = []
    for count in (8, 16):
        x = 0.0
        for _ in range(count):
            x = rk4_step(falling, x, lambda _: 1.0, 1.0 / count, looped=False)
        off.append(abs(x - np.tanh(1.0)))
    assert 13.0 < off[0] / off[1] < 19.0
    assert off[1] < 1e-6


def test_a_cubic_drive_is_met_without_error() -> None:
    """Start, middle twice and end with Simpson's weights."""
    enable_double_precision()
    for looped in (False, True):
        found = rk4_step(lambda x, w: w + 0.0 * x, jnp.zeros(1), lambda s: 4.0 * (0.5 * s) ** 3, 0.5, looped=looped)
        assert float(found[0]) == pytest.approx(0.5**4, rel=1e-15)


def test_in_a_loop_it_is_the_step_written_out() -> None:
    enable_double_precision()
    x, w = jnp.array([0.3, -0.2]), jnp.array([1.0, 2.0])

    def rates(x: jax.Array, w: jax.Array) -> jax.Array:
        return jnp.stack([x[1] * w[0], w[1] - jnp.sin(x[0])])

    def drive(fraction: float) -> jax.Array:
        return w * (1.0 + fraction)

    once = [rk4_step(rates, x, drive, 0.1, looped=looped) for looped in (False, True)]
    np.testing.assert_allclose(once[0], once[1], rtol=1e-15)
