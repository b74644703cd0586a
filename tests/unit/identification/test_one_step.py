"""One step from a fit says what the whole fits say: exactly, where the errors are linear in the numbers."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from made_results import result
from rolling import OFF_CENTRE, OUTPUTS_OF_ROLL, biased, gusty
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.result import Fitted
from swashplate.identification.identify import identify
from swashplate.identification.one_step import in_words, not_judged, one_step_effects
from swashplate.models.catalogue import vehicle
from swashplate.models.traits import PhysicalEffect

NAMES = ("linkage_lower", "o_zeta_lower", "a_alpha_u_linear")
SPIN = PhysicalEffect("spin", {"gyroscopic": 0.0})
DRAG = PhysicalEffect("flap-back", {"a_alpha_u_linear": 0.0})
SAMPLES = 4000


class Line:
    """Errors linear in the numbers, of unit variance: least squares is the likelihood."""

    def __init__(self, names: tuple[str, ...], slopes: dict[str, np.ndarray], errors: np.ndarray) -> None:
        self.records = (SimpleNamespace(dt=0.01),)
        self.row = Row(tuple(Entry(name, "parameter", 0.0, 2.0) for name in names))
        self.slopes, self.errors, self.all = np.stack([2.0 * slopes[n] for n in names]), errors, slopes

    def left(self, row: np.ndarray) -> np.ndarray:
        return row @ self.slopes - self.errors

    def refresh(self, row: np.ndarray) -> None:
        """Nothing to take anew."""

    def scores(self, row: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        left = self.left(row)
        return 0.5 * float(left @ left), self.slopes @ left, self.slopes @ self.slopes.T

    def whitened(self, row: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray], np.ndarray]:
        p = len(self.row)
        return [self.left(row)[:, None]], [self.slopes[:, :, None]], np.zeros((p, p))

    def widened(self, added: list[str]) -> Line:
        return Line((*self.row.names, *added), self.all, self.errors)

    def solved(self) -> tuple[float, np.ndarray, np.ndarray]:
        """Cost, numbers and their covariance at the optimum."""
        row = np.linalg.solve(self.slopes @ self.slopes.T, self.slopes @ self.errors)
        return self.scores(row)[0], 2.0 * row, 4.0 * np.linalg.inv(self.slopes @ self.slopes.T)


def fitted(names: tuple[str, ...], truth: dict[str, float]) -> tuple[Any, Line]:
    """A fit of the errors of some truth, and its likelihood."""
    draw = np.random.default_rng(4)
    slopes = {name: draw.standard_normal(SAMPLES) for name in (*NAMES, "gyroscopic")}
    slopes["gyroscopic"] += 0.6 * slopes["o_zeta_lower"]
    slopes["a_alpha_u_linear"] += 0.5 * slopes["linkage_lower"]
    errors = sum(value * slopes[name] for name, value in truth.items()) + draw.standard_normal(SAMPLES)
    line = Line(names, slopes, np.asarray(errors))
    _, numbers, covariance = line.solved()
    made = result(vehicle("coax"), dict(zip(names, map(float, numbers), strict=True)), covariance)
    object.__setattr__(made, "fitted", Fitted(line, numbers / 2.0))
    return made, line


@pytest.mark.parametrize("spin", [0.0, 0.15])
def test_a_part_that_is_held_out_is_judged_as_the_fit_with_it_judges(spin: float) -> None:
    fit, line = fitted(NAMES, {"linkage_lower": 0.2, "o_zeta_lower": 0.1, "gyroscopic": spin})
    (test,) = one_step_effects(fit, [SPIN])
    cost, numbers, covariance = line.widened(["gyroscopic"]).solved()
    assert test.gain == pytest.approx(line.solved()[0] - cost, rel=0.1)
    assert test.values["gyroscopic"][0] == pytest.approx(numbers[-1], rel=1e-6)
    assert test.values["gyroscopic"][1] == pytest.approx(np.sqrt(covariance[-1, -1]), rel=0.1)
    assert test.verdict == ("needed" if spin else "not needed")
    by = (numbers[1] - line.solved()[1][1]) / fit["o_zeta_lower"].best_sigma
    assert test.shifts["o_zeta_lower"] == pytest.approx(by, rel=1e-6)
    assert in_words([test]).startswith("lacks spin (" if spin else "asks for no part of the physics; not asked")


def test_a_part_that_is_free_is_judged_as_the_fit_without_it_judges() -> None:
    fit, line = fitted(NAMES, {"linkage_lower": 0.2, "a_alpha_u_linear": 0.15})
    (test,) = one_step_effects(fit, [DRAG])
    cost, numbers, covariance = Line(NAMES[:2], line.all, line.errors).solved()
    assert test.asked
    assert test.gain == pytest.approx(cost - line.solved()[0], rel=1e-6)
    by = (line.solved()[1][0] - numbers[0]) / np.sqrt(covariance[0, 0])
    assert test.shifts["linkage_lower"] == pytest.approx(by, rel=1e-6)
    assert "needs flap-back" in in_words([test])
    assert "freeing a_alpha_u_linear moves linkage_lower by" in in_words([test])


@pytest.mark.parametrize("offset", [0.0, 0.05])
def test_a_flight_asks_for_a_part_only_where_it_is_there(offset: float) -> None:
    free = ["Lb", "tau", "A", "offset"]
    fit = identify(biased(), gusty(offset=offset), free=free, outputs=list(OUTPUTS_OF_ROLL), method="filter-error")
    (test,) = one_step_effects(fit, [OFF_CENTRE])
    assert test.verdict == ("needed" if offset else "not needed")
    told = "needs stick that stands off centre (" if offset else "asks for no part of the physics; not asked for:"
    assert in_words([test]).startswith(told)


def test_what_no_step_can_judge_is_named() -> None:
    """Another likelihood cannot free more numbers: what is held is said to be unjudged, not silently fine."""
    fit, _ = fitted(NAMES, {"linkage_lower": 0.2})
    assert not_judged(fit, [SPIN, DRAG]) == ""  # this one can
    object.__setattr__(fit, "fitted", None)
    told = not_judged(fit, [SPIN, DRAG])
    assert SPIN.name in told
    assert DRAG.name not in told  # its number is free
    assert not_judged(fit, [DRAG]) == ""


def test_nothing_is_said_of_a_fit_that_did_not_converge() -> None:
    fit, _ = fitted(NAMES, {"linkage_lower": 0.2})
    object.__setattr__(fit, "converged", False)
    assert one_step_effects(fit, [SPIN, DRAG]) == ()
    assert in_words(()) == ""
