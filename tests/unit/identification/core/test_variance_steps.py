"""Searches among variances: known answers, noises that are far away or not there, bounds, and wrong slopes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.scoring import Solver, minimise

_N = 400


@dataclass
class Noisy:
    """Half of the readings have the noise `first`, the others `first` and `second` together, around one mean."""

    row: Row
    squares: tuple[float, float] = (4.0, 5.0)
    asked: list[np.ndarray] = field(default_factory=list)

    def _at(self, row: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        first, second = np.exp(2.0 * row[1:])
        return np.array([first, first + second]), np.array([[0.0, 2.0 * first, 0.0], [0.0, 2.0 * first, 2.0 * second]])

    def cost(self, row: np.ndarray) -> float:
        variances, _ = self._at(row)
        off = np.array(self.squares) + (row[0] - 1.0) ** 2
        return 0.5 * _N * float(np.sum(np.log(variances) + off / variances))

    def scores(self, row: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        self.asked.append(row.copy())
        variances, moved = self._at(row)
        off = np.array(self.squares) + (row[0] - 1.0) ** 2
        gradient = 0.5 * _N * ((1.0 / variances - off / variances**2) @ moved)
        gradient[0] += _N * (row[0] - 1.0) * np.sum(1.0 / variances)
        information = 0.5 * _N * (moved.T / variances**2) @ moved
        information[0, 0] += _N * np.sum(1.0 / variances)
        return self.cost(row), gradient, information

    def refresh(self, row: np.ndarray) -> None:
        pass


def _row(*, variance: bool, first: float = 6.0, lower: float = -12.0, sigma: float = 2.0) -> Row:
    noise = {"logarithmic": True, "variance": variance}
    return Row(
        (
            Entry("mean", "parameter", 0.0, 1.0),
            Entry("first", "noise", first, 1.0, lower, 12.0, first, np.inf, **noise),
            Entry("second", "noise", 0.0, 1.0, lower, 12.0, 0.0, sigma, **noise),
        )
    )


def test_variances_far_away_are_found_in_few_steps_and_as_damped_steps_find_them() -> None:
    quick, slow = Noisy(_row(variance=True)), Noisy(_row(variance=False))
    found, damped = minimise(quick, Solver(tolerance=1e-6)), minimise(slow, Solver(tolerance=1e-9, iterations=200))
    np.testing.assert_allclose(found.row, damped.row, atol=2e-4)
    assert found.converged
    assert np.exp(2.0 * found.row[1]) == pytest.approx(4.0, rel=0.02)
    assert len(quick.asked) <= 10 < len(slow.asked)  # 60 times too large a noise: the logarithm goes 0.7 at a time
    assert list(found.history) == sorted(found.history, reverse=True)


def test_a_noise_that_is_not_there_settles_where_its_prior_holds_it() -> None:
    """The second noise is small beside the first: its variance acts in proportion, and only the prior ends its way."""
    absent = Noisy(_row(variance=True, first=0.7), squares=(4.0, 4.0))
    found = minimise(absent, Solver(tolerance=1e-6))
    step = 1e-4 * np.eye(3)

    def posterior(row: np.ndarray) -> float:
        return absent.cost(row) + absent.row.prior(row)[0]

    slopes = [(posterior(found.row + s) - posterior(found.row - s)) / 2e-4 for s in step]
    np.testing.assert_allclose(slopes, 0.0, atol=1e-2)
    assert found.row[2] < -0.5
    assert len(absent.asked) <= 12


def test_bounds_hold_and_a_search_that_is_cut_short_says_so() -> None:
    bounded = Noisy(_row(variance=True, lower=1.5))
    found = minimise(bounded, Solver(tolerance=1e-6))
    assert "first" in found.at_bound
    assert min(row[1] for row in bounded.asked) >= 1.5
    assert not minimise(Noisy(_row(variance=True)), Solver(iterations=2, tolerance=1e-9)).converged


def test_a_wrong_gradient_is_not_called_an_optimum() -> None:
    """Every step is judged by its cost: with slopes of the wrong sign nothing goes down, and the start is left."""

    class Wrong(Noisy):
        def scores(self, row: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
            cost, gradient, information = super().scores(row)
            return cost, -gradient, information

    row = _row(variance=True)
    found = minimise(Wrong(row), Solver(tolerance=1e-6))
    np.testing.assert_allclose(found.row, row.starts(), atol=1e-3)
    assert found.history[0] - found.history[-1] < 1.0


def test_a_kinked_entry_that_goes_too_far_does_not_hold_up_the_others() -> None:
    class Kinked(Noisy):
        def cost(self, row: np.ndarray) -> float:
            return super().cost(row) + (1e6 if row[0] > 0.3 else 0.0)

    row = _row(variance=True)
    kinked = replace(row.entries[0], kinked=True)
    found = minimise(Kinked(Row((kinked, *row.entries[1:]))), Solver(tolerance=1e-6))
    assert found.row[0] <= 0.3
    at_kink = 4.0 + (found.row[0] - 1.0) ** 2
    assert np.exp(2.0 * found.row[1]) == pytest.approx(at_kink, rel=0.05)
