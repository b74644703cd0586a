"""The loop of every filter: a reading corrects before the model predicts, with what holds at that sample."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from swashplate.filtering.filter_loop import filtered
from swashplate.simulation.dynamics import enable_double_precision


def test_a_scalar_filter_is_the_recursion_by_hand() -> None:
    enable_double_precision()
    readings, pushes = np.array([1.0, 0.5, -0.2, 0.3]), np.array([0.1, 0.2, 0.3, 0.4])
    last, (told, states) = filtered(
        jnp.asarray(0.2),
        readings,
        pushes,
        correct=lambda x, y, now: (x + 0.5 * (y - x - now), y - x - now),
        predict=lambda x, now: 0.9 * x + now,
    )
    x, expected = 0.2, []
    for y, push in zip(readings, pushes, strict=True):
        innovation = y - x - push
        x += 0.5 * innovation
        expected.append((innovation, x))
        x = 0.9 * x + push
    np.testing.assert_allclose(np.column_stack([told, states]), expected, rtol=1e-15)
    assert float(last) == x
