"""The paper's own way down: it moves the parameters only, stays inside physics, and finds known minima."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.time.nelder_mead import minimise_squares

INF = float("inf")


class Bowl:
    """Half the squared distance from a target, parameters first, one nuisance that wants to move as well."""

    def __init__(self, *bounds: tuple[float, float], sigma: float = INF) -> None:
        entries = [Entry(f"a{i}", "parameter", 1.0, 1.0, *pair, 0.0, sigma) for i, pair in enumerate(bounds)]
        self.row = Row((*entries, Entry("lever", "nuisance", 0.25, 0.5)))
        self.target = np.array([*np.linspace(2.0, 3.0, len(bounds)), 9.0])
        self.refreshed = 0

    def cost(self, row: np.ndarray) -> float:
        away = (row - self.target) * [*np.linspace(10.0, 100.0, len(row) - 1), 1.0]
        return float("nan") if row[0] > 5.0 else 0.5 * float(away @ away)

    def scores(self, row: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        return self.cost(row), row - self.target, 7.0 * np.eye(row.size)

    def refresh(self, row: np.ndarray) -> None:
        self.refreshed += 1


def test_it_finds_the_bottom_with_everything_else_at_its_first_guess() -> None:
    bowl: Any = Bowl((-INF, INF), (-INF, INF), (-INF, INF))
    told: list[int] = []
    found = minimise_squares(bowl, progress=lambda i, _: told.append(i))
    np.testing.assert_allclose(found.row[:3], bowl.target[:3], atol=2e-3)
    assert found.row[3] == 0.5  # the lever's start in its scale: not moved
    assert found.converged
    assert bowl.refreshed == 1
    assert told == list(range(1, len(found.history) + 1))
    assert found.history[-1] == pytest.approx(found.cost, abs=1e-2)
    np.testing.assert_array_equal(found.information, 7.0 * np.eye(4))


def test_a_bound_stops_it_and_is_named() -> None:
    bowl: Any = Bowl((-INF, 1.5), (-INF, INF))
    found = minimise_squares(bowl)
    assert found.row[0] == pytest.approx(1.5)
    assert found.row[1] == pytest.approx(3.0, abs=2e-3)
    assert found.at_bound == ("a0",)


def test_a_prior_counts() -> None:
    """Weights 10^2 from the data and 10^2 from a prior at zero: half way."""
    bowl: Any = Bowl((-INF, INF), sigma=0.1)
    bowl.target = np.array([2.0, 9.0])
    assert minimise_squares(bowl).row[0] == pytest.approx(1.0, abs=2e-3)
