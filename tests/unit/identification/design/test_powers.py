"""The best powers where they are known by thought."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.identification.design.information import best_powers

NOTHING_KNOWN = np.diag([1e-9, 1e-9, 1.0])


def line(*told: float) -> np.ndarray:
    """What a line tells of two parameters, and nothing of the nuisance."""
    return np.diag([*told, 0.0])


def powers(draws: list[list[np.ndarray]], *, criterion: str = "D", worst: bool = False) -> np.ndarray:
    found = best_powers(
        np.array(draws), np.zeros(len(draws[0]), dtype=int), np.ones(1), NOTHING_KNOWN, criterion=criterion, worst=worst
    )
    assert found.sum() == pytest.approx(1.0)
    return found


def test_d_gives_both_parameters_the_same_power_and_useless_lines_none() -> None:
    found = powers([[line(100.0, 0.0), line(0.0, 1.0), line(0.1, 0.1)]])
    np.testing.assert_allclose(found, [0.5, 0.5, 0.0], atol=1e-3)


def test_a_gives_the_parameter_that_is_told_badly_more() -> None:
    found = powers([[line(100.0, 0.0), line(0.0, 1.0)]], criterion="A")
    np.testing.assert_allclose(found, [1.0 / 11.0, 10.0 / 11.0], atol=1e-3)  # as 1/sqrt of what they tell


def test_a_line_that_the_nuisance_spoils_is_worth_less() -> None:
    spoilt = np.array([[1.0, 0.0, 30.0], [0.0, 0.0, 0.0], [30.0, 0.0, 1000.0]])
    found = powers([[spoilt, line(0.9, 0.0), line(0.0, 1.0)]])
    assert found[1] > 10.0 * found[0]


def test_the_worst_draw_decides_where_it_is_asked_to() -> None:
    draws = [[line(10.0, 1.0), line(1.0, 1.0)], [line(0.01, 1.0), line(1.0, 1.0)]]
    average, worst = powers(draws), powers(draws, worst=True)
    assert worst[1] > average[1] + 0.05


def test_each_axis_spends_its_own() -> None:
    lines = np.array([[line(1.0, 0.0), line(2.0, 0.0), line(0.0, 1.0), line(0.0, 3.0)]])
    allowed = np.array([0.3, 2.0])
    found = best_powers(lines, np.array([0, 0, 1, 1]), allowed, NOTHING_KNOWN, criterion="D", worst=False)
    np.testing.assert_allclose(found, [0.0, 0.3, 0.0, 2.0], atol=1e-6)
