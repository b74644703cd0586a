"""Searches that begin again from another delay: the deeper valley is found, and nothing is begun where none is near."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.scoring import Solver, minimise, minimise_over_valleys

PERIOD, DEEPEST = 1.2, 2.0


@dataclass
class Waves:
    """A cost with a valley per wave of the command; the parameter settles at the delay."""

    height: float
    row: Row = field(
        default_factory=lambda: Row(
            (Entry("gain", "parameter", 0.9, 1.0), Entry("delay", "nuisance", 0.9, 1.0, lower=0.0, kinked=True))
        )
    )
    steepness: float = 1.0
    searches: int = 0

    def cost(self, row: np.ndarray) -> float:
        gain, delay = row
        wave = self.height * (1.0 - np.cos(2.0 * np.pi * (delay - DEEPEST) / PERIOD))
        return float(self.steepness * (wave + 5.0 * (delay - DEEPEST) ** 2 + 20.0 * (gain - delay) ** 2))

    def scores(self, row: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        gain, delay = row
        turns = 2.0 * np.pi / PERIOD
        by_gain = 40.0 * (gain - delay)
        by_delay = self.height * turns * np.sin(turns * (delay - DEEPEST)) + 10.0 * (delay - DEEPEST) - by_gain
        steep = 10.0 + self.height * turns**2
        gradient, information = np.array([by_gain, by_delay]), np.array([[40.0, -40.0], [-40.0, 40.0 + steep]])
        return self.cost(row), self.steepness * gradient, self.steepness * information

    def refresh(self, row: np.ndarray) -> None:
        self.searches += 1


def test_the_deeper_valley_is_found_and_its_way_is_told() -> None:
    told: list[int] = []
    alone = minimise(Waves(5.0))
    found = minimise_over_valleys(Waves(5.0), Solver(progress=lambda iteration, cost: told.append(iteration)))
    assert alone.row[1] == pytest.approx(DEEPEST - PERIOD, abs=0.3)  # one wave too early
    np.testing.assert_allclose(found.row, DEEPEST, atol=0.05)
    assert found.cost < alone.cost
    assert found.history[: len(alone.history)] == alone.history
    assert found.history[-1] == found.cost
    assert told == sorted(told)


def test_the_deepest_valley_is_kept() -> None:
    deepest = Row((Entry("gain", "parameter", 2.1, 1.0), Entry("delay", "nuisance", 2.1, 1.0, 0.0, kinked=True)))
    alone, found = minimise(Waves(5.0, deepest)), minimise_over_valleys(Waves(5.0, deepest))
    np.testing.assert_array_equal(found.row, alone.row)
    assert found.history == alone.history


@pytest.mark.parametrize(("steepness", "begun"), [(1.0, True), (20.0, False)])
def test_nothing_is_begun_where_other_delays_promise_nothing(steepness: float, begun: bool) -> None:
    """Where every other delay costs far more, some costs are all that is spent."""
    plain, whole = Waves(5.0, steepness=steepness), Waves(5.0, steepness=steepness)
    minimise(plain)
    minimise_over_valleys(whole)
    assert (whole.searches > plain.searches + 1) is begun
