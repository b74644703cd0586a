"""Steps of the scoring when entries that hardly show want to go far."""

from __future__ import annotations

import numpy as np

from swashplate.identification.core.damped_steps import _held, _within


def test_holding_at_the_reach_promises_more_than_cutting_or_shortening() -> None:
    """Least squares of which half the columns show a thousandth: what is held lets the others go where that leads."""
    gained = []
    for seed in range(30):
        random = np.random.default_rng(seed)
        table = random.standard_normal((12, 8)) * np.array([1.0] * 4 + [1e-3] * 4)
        hessian, gradient = table.T @ table, table.T @ random.standard_normal(12)
        damping, reach = np.full(8, 1e-9), np.full(8, 0.7)
        whole = np.linalg.solve(hessian, -gradient)
        assert np.abs(whole).max() > 100.0
        plain = _within(reach, whole, gradient, hessian, together=False)
        held = _held((-reach, reach), plain, gradient, hessian, damping)
        assert np.all(np.abs(held) <= 0.7 + 1e-12)
        promised = [float(gradient @ step + 0.5 * step @ hessian @ step) for step in (plain, held)]
        assert promised[1] <= promised[0] < 0.0
        gained.append(promised[1] / promised[0])
    assert np.median(gained) > 1.1, gained
