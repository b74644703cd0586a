"""The optimizer on problems whose answer is known: lines, a curved valley, bounds, priors, where it diverges."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from swashplate.errors import IdentificationError
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.scoring import Solver, minimise

INF = float("inf")


@dataclass
class Line:
    """Half the squared residuals of y = A x."""

    row: Row
    A: np.ndarray
    y: np.ndarray
    refreshed: list[np.ndarray] = field(default_factory=list)

    def cost(self, row: np.ndarray) -> float:
        residual = self.y - self.A @ (row * self.row.scale)
        return 0.5 * float(residual @ residual)

    def scores(self, row: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        scaled = self.A * self.row.scale
        residual = self.y - scaled @ row
        return self.cost(row), -scaled.T @ residual, scaled.T @ scaled

    def refresh(self, row: np.ndarray) -> None:
        self.refreshed.append(row.copy())


@dataclass
class Valley:
    """Rosenbrock's function as least squares: 50 (y - x^2)^2 + (1 - x)^2 / 2, no finite value where x < -2."""

    row: Row

    def _residual(self, row: np.ndarray) -> np.ndarray:
        return np.array([10.0 * (row[1] - row[0] ** 2), 1.0 - row[0]])

    def cost(self, row: np.ndarray) -> float:
        residual = self._residual(row)
        return INF if row[0] < -2.0 else 0.5 * float(residual @ residual)

    def scores(self, row: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        slope = np.array([[-20.0 * row[0], 10.0], [-1.0, 0.0]])
        return self.cost(row), slope.T @ self._residual(row), slope.T @ slope

    def refresh(self, row: np.ndarray) -> None:
        pass


def _line(*, bounds: tuple[float, float] = (-INF, INF), sigma: float = INF, mean: float = 0.0) -> Line:
    """Three numbers of very different sizes from fifty equations; `bounds` and prior are those of the second."""
    rng = np.random.default_rng(8)
    truth, scale = np.array([3e-4, -2.0, 5e3]), np.array([1e-4, 1.0, 1e3])
    A = rng.standard_normal((50, 3)) / scale
    entries = [Entry(name, "nuisance", 0.0, s) for name, s in zip("abc", scale, strict=True)]
    entries[1] = Entry("b", "nuisance", 0.0, 1.0, bounds[0], bounds[1], mean, sigma)
    return Line(Row(tuple(entries)), A, A @ truth + 0.1 * rng.standard_normal(50))


def test_a_linear_problem_gives_the_least_squares_answer() -> None:
    problem = _line()
    found = minimise(problem, Solver(tolerance=1e-10))
    exact = np.linalg.lstsq(problem.A, problem.y, rcond=None)[0]
    np.testing.assert_allclose(found.row * problem.row.scale, exact, rtol=1e-6)
    assert found.converged
    assert found.at_bound == ()
    np.testing.assert_allclose(found.information, (problem.A * problem.row.scale).T @ (problem.A * problem.row.scale))
    assert list(found.history) == sorted(found.history, reverse=True)
    assert found.cost == found.history[-1] == problem.cost(found.row)
    np.testing.assert_array_equal(problem.refreshed[-1], found.row)


def test_a_prior_pulls_by_its_weight() -> None:
    problem = _line(mean=4.0, sigma=0.05)
    found = minimise(problem, Solver(tolerance=1e-10))
    weight = np.diag([0.0, 1.0 / 0.05**2, 0.0])
    normal = problem.A.T @ problem.A + weight
    exact = np.linalg.solve(normal, problem.A.T @ problem.y + weight @ [0.0, 4.0, 0.0])
    np.testing.assert_allclose(found.row * problem.row.scale, exact, rtol=1e-6)
    assert -2.0 < exact[1] < 4.0
    # The information is of the data alone.
    np.testing.assert_allclose(found.information, (problem.A * problem.row.scale).T @ (problem.A * problem.row.scale))


@pytest.mark.parametrize("bounds", [(-1.0, INF), (-INF, -3.0)])
def test_a_bound_holds_and_the_others_are_the_best_beside_it(bounds: tuple[float, float]) -> None:
    problem = _line(bounds=bounds)
    found = minimise(problem, Solver(tolerance=1e-10))
    at = -1.0 if np.isfinite(bounds[0]) else -3.0
    rest = np.linalg.lstsq(problem.A[:, [0, 2]], problem.y - at * problem.A[:, 1], rcond=None)[0]
    np.testing.assert_allclose(found.row * problem.row.scale, [rest[0], at, rest[1]], rtol=1e-5)
    assert found.at_bound == ("b",)


@pytest.mark.parametrize("start", [(-1.2, 1.0), (0.0, -3.0), (2.0, 2.0)])
def test_rosenbrocks_valley(start: tuple[float, float]) -> None:
    row = Row(tuple(Entry(name, "parameter", value, 1.0) for name, value in zip("xy", start, strict=True)))
    found = minimise(Valley(row), Solver(iterations=200, tolerance=1e-12))
    np.testing.assert_allclose(found.row, [1.0, 1.0], atol=1e-5)
    assert found.converged


def test_a_step_into_nowhere_is_taken_back() -> None:
    """The undamped first step would land where the cost is not finite."""
    row = Row((Entry("x", "initial", -1.9, 1.0), Entry("y", "initial", -9.0, 1.0)))
    found = minimise(Valley(row), Solver(iterations=300, tolerance=1e-12))
    np.testing.assert_allclose(found.row, [1.0, 1.0], atol=1e-5)
    with pytest.raises(IdentificationError, match="diverges from the flight at the first guess"):
        minimise(Valley(Row((Entry("x", "initial", -3.0, 1.0), Entry("y", "initial", 0.0, 1.0)))))


def test_no_entry_moves_further_in_one_iteration_than_its_group_may() -> None:
    row = Row(tuple(Entry(name, "parameter", 0.0, 1.0) for name in "ab"))
    problem = Line(row, np.eye(2), np.array([10.0, 0.1]))
    minimise(problem, Solver(iterations=30))
    moved = np.abs(np.diff(problem.refreshed, axis=0)).max()
    assert 0.69 < moved <= 0.7 + 1e-12


def test_iterations_that_run_out_are_said_and_every_one_is_told() -> None:
    told: list[tuple[int, float]] = []
    row = Row((Entry("x", "parameter", -1.2, 1.0), Entry("y", "parameter", 1.0, 1.0)))
    found = minimise(
        Valley(row), Solver(iterations=3, tolerance=1e-12, progress=lambda i, cost: told.append((i, cost)))
    )
    assert not found.converged
    assert [i for i, _ in told] == [1, 2, 3]
    assert tuple(cost for _, cost in told) == found.history[1:]


def test_a_start_outside_the_bounds_is_brought_inside() -> None:
    row = Row((Entry("x", "parameter", 5.0, 2.0, -1.0, 1.0),))
    problem = Line(row, np.eye(1), np.array([7.0]))
    found = minimise(problem)
    assert problem.refreshed[0] == 0.5
    assert (float(found.row[0]), found.at_bound) == (0.5, ("x",))


@pytest.mark.parametrize("runaway", [False, True])
def test_long_ways_are_gone_along_the_valley_and_past_a_noise_that_runs_away(runaway: bool) -> None:
    """Cutting entry by entry climbs out of a valley; shortening as a whole lets one logarithm hold up the rest."""
    far = np.array([0.2, 1e4] if runaway else [10.0, 20.0])
    A = np.diag([1e3, 1e-4]) if runaway else np.array([[1e3, -0.5e3], [1.0, 1.0]])
    entries = (Entry("a", "parameter", 0.0, 1.0), Entry("b", "noise" if runaway else "parameter", 0.0, 1.0))
    optimum = minimise(Line(Row(entries), A, A @ far), Solver(iterations=60))
    assert optimum.row[0] == pytest.approx(far[0], abs=1e-3)
    # The valley of 20 is 29 steps of 0.7 long; beside a runaway the other is found at once.
    assert len(optimum.history) <= (12 if runaway else 35)
