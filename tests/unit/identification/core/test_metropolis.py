"""Metropolis on densities whose answer is known, bounds among them, and whether its diagnostics can say no."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from swashplate.identification.core import metropolis
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.whitened import Chains, effective, split_rhat

WALL = 1.5
"""Sigmas from the mean to the lower bound of the second number."""
TIED = np.array([[1.0, 0.9], [0.9, 1.0]]) * np.outer([1.0, 2.0], [1.0, 2.0])
PULL = np.linalg.inv(TIED).tolist()
ROW = Row(
    (
        Entry("free", "parameter", 0.0, 1.0),
        Entry("walled", "parameter", 0.0, 1.0, lower=-2.0 * WALL),
        Entry("exponential", "parameter", 0.0, 1.0, lower=0.0),
    )
)


class HalfSquares:
    """A correlated pair, and a third that is exponential above zero."""

    row = ROW

    def cost(self, row: np.ndarray) -> float:
        a, b, c = row.tolist()
        return 0.5 * (a * a * PULL[0][0] + 2.0 * a * b * PULL[0][1] + b * b * PULL[1][1]) + c


def drawn(*, most: int, seed: int = 4, **changed: Any) -> Chains:
    covariance = np.zeros((3, 3))
    covariance[:2, :2] = TIED
    covariance[2, 2] = 1.0
    asked: dict[str, Any] = {"chains": 3, "warmup": 200, "block": 300, "enough": lambda _: False}
    return metropolis.sample(HalfSquares(), np.zeros(3), covariance, most=most, seed=seed, **(asked | changed))


FEW = 200
"""Draws of a chain: of 600, which `make proof` takes, more is known."""


@lru_cache(maxsize=2)
def chains(most: int) -> Chains:
    return drawn(most=most)


@pytest.mark.parametrize("most", [FEW, pytest.param(600, marks=pytest.mark.proof)])
def test_the_draws_are_of_the_density_and_keep_its_bounds(most: int) -> None:
    found = chains(most)
    random = np.random.default_rng(0)
    exact = random.standard_normal((400_000, 2)) @ np.linalg.cholesky(TIED).T
    exact = exact[exact[:, 1] > -2.0 * WALL]
    flat = found.rows.reshape(-1, 3)
    error = 4.0 / np.sqrt(effective(found.rows))  # four standard errors of a mean
    assert np.all(effective(found.rows) > 1.5 * most)  # half of all
    assert np.all(np.abs(flat[:, :2].mean(axis=0) - exact.mean(axis=0)) < error[:2] * exact.std(axis=0))
    assert abs(flat[:, 2].mean() - 1.0) < error[2]
    np.testing.assert_allclose(flat.std(axis=0), [*exact.std(axis=0), 1.0], rtol=0.15)
    assert flat[:, 1].min() > -2.0 * WALL
    assert flat[:, 2].min() > 0.0
    assert np.all(split_rhat(found.rows) < 1.02)
    assert np.all((found.stats["acceptance_rate"] >= 0.0) & (found.stats["acceptance_rate"] <= 1.0))


def test_equal_seeds_give_equal_draws_whatever_the_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    few = {"most": 20, "block": 20, "warmup": 20}
    first = drawn(**few).rows
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    np.testing.assert_array_equal(drawn(**few).rows, first)
    assert not np.array_equal(drawn(**few, seed=5).rows, first)


def test_it_ends_where_enough_is_drawn() -> None:
    few = {"most": 60, "block": 20, "warmup": 20}
    assert drawn(enough=lambda found: found.rows.shape[1] >= 40, **few).rows.shape == (3, 40, 3)


def test_chains_that_never_meet_or_drift_are_told() -> None:
    apart = chains(FEW).rows + np.array([0.0, 0.5, 5.0])[:, None, None]
    assert np.all(split_rhat(apart) > 1.05)
    assert np.all(effective(apart) < effective(chains(FEW).rows))
    drifting = chains(FEW).rows + np.linspace(0.0, 5.0, FEW)[None, :, None]
    assert np.all(split_rhat(drifting) > 1.05)  # only halves against halves can tell
    still = np.concatenate([chains(FEW).rows[:, :, :2], np.ones((3, FEW, 1))], axis=2)
    assert not split_rhat(still)[2] < 1.01
    assert np.isnan(effective(still)[2])


@pytest.mark.parametrize("keep", [0.0, 0.5, 0.9, -0.5])
def test_effective_draws_are_those_of_a_first_order_process(keep: float) -> None:
    random, rows = np.random.default_rng(1), np.zeros((4, 4000, 1))
    for k in range(1, rows.shape[1]):
        rows[:, k, 0] = keep * rows[:, k - 1, 0] + random.standard_normal(4)
    assert effective(rows)[0] == pytest.approx(16_000.0 * (1.0 - keep) / (1.0 + keep), rel=0.25)
