"""Errors some time ahead as a criterion: the words for it, its slopes, what it finds, and what it refuses."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

import swashplate as sp
from rolling import SAME, TRUTH, gusty, rolling
from swashplate.errors import IdentificationError
from swashplate.identification.core.likelihood import OwnCovariance
from swashplate.identification.core.multi_step import Horizon, MultiStepErrors
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import records
from swashplate.identification.core.scoring import Solver, minimise
from swashplate.identification.identify import identify
from swashplate.identification.time.vehicle_problem import VehicleErrors
from swashplate.models.linear.state_space_file import parse
from swashplate.physics.environment import Environment

OUTPUTS = ("p", "pdot", "ay")
AHEAD, FURTHER = (0.02, 0.1), (0.1, 0.4)
"""The first begins at every sample, one sample ahead: one program for all of these tests."""


def test_a_horizon_is_two_times_or_one() -> None:
    assert Horizon.of((0.25, 2.0)).samples(0.01) == tuple(range(25, 201, 25))
    assert Horizon.of([1]).samples(0.01) == (100,)
    assert Horizon.of((0.1, 0.37)).samples(0.02) == (5, 10, 15)
    for wrong in ((), (0.5, 0.25), (0.0, 1.0), (1.0, 2.0, 3.0), (float("nan"),)):
        with pytest.raises(IdentificationError, match="expected FIRST,LAST"):
            Horizon.of(wrong)


@lru_cache(maxsize=1)
def _filter_error() -> OwnCovariance:
    table = parameterize(rolling(), list(TRUTH))
    pieces = records([gusty()], rolling(), outputs=OUTPUTS)
    how = {"environment": Environment(), "shifts": True, "biases": ("ay",)}
    return VehicleErrors(table, pieces, gain="from the noise", **how)


def _criterion(*, sigma: float | None = None) -> MultiStepErrors:
    """The criterion alone, or beside a likelihood that knows every scaled entry to a sigma."""
    base = _filter_error()
    known = None if sigma is None else sigma**2 * np.eye(len(base.row))
    return MultiStepErrors(base, base.row.starts(), base.records, horizon=Horizon(*AHEAD), known=known)


@pytest.mark.parametrize("sigma", [None, 0.03])
def test_gradient_and_slopes_are_those_of_the_cost(sigma: float | None) -> None:
    criterion = _criterion(sigma=sigma)
    row = criterion.start + 0.05 * np.random.default_rng(1).standard_normal(len(criterion.row))
    cost, gradient, information = criterion.scores(row)
    assert cost == pytest.approx(criterion.cost(row), rel=1e-12)
    for place in range(len(row)):
        step = np.zeros(row.size)
        step[place] = 1e-4 / np.sqrt(information[place, place])
        slope = (criterion.cost(row + step) - criterion.cost(row - step)) / (2.0 * step[place])
        size = float(np.sqrt(information[place, place]))
        assert gradient[place] == pytest.approx(slope, rel=1e-4, abs=1e-4 * size), criterion.row.names[place]


def test_what_the_likelihood_knows_stays() -> None:
    """Known well, the row hardly moves; known as well as by the priors alone, it moves as if nothing were known."""
    alone, firmly, hardly = (
        minimise(c, Solver(iterations=5), start=c.start).row - c.start
        for c in (_criterion(), _criterion(sigma=1e-4), _criterion(sigma=1e6))
    )
    assert np.abs(alone).max() > 0.05
    assert np.abs(firmly).max() < 0.01
    np.testing.assert_allclose(hardly, alone, rtol=0.02, atol=1e-3)


def test_only_parameters_and_constants_move() -> None:
    criterion = _criterion()
    assert {entry.group for entry in criterion.row.entries} == {"parameter", "nuisance"}
    whole, found = criterion.whole_row(criterion.start + 1.0), _filter_error().row
    moved = np.flatnonzero(whole != found.starts())
    assert [found.names[i] for i in moved] == list(criterion.row.names)


def test_one_step_ahead_is_the_innovation() -> None:
    """A start at every sample and one sample ahead: the filter's own errors."""
    base = _filter_error()
    (errors,) = base.errors_ahead(base.row.starts(), _criterion().ahead)
    assert len(errors) == len(base.records[0].time) - 5
    np.testing.assert_allclose(
        errors[:, 0], base._errors_in_a_row(base.row.starts())[1 : len(errors) + 1], rtol=1e-9, atol=1e-12
    )


@pytest.mark.proof
def test_a_linear_vehicle_is_fitted_ahead_as_the_linear_model() -> None:
    flown = gusty()
    found = identify(rolling(), flown, free=list(TRUTH), outputs=OUTPUTS, biases=["ay"], horizon=FURTHER)
    how = {"method": "filter-error", "shifts": False, "biases": ["ay"]}
    other = identify(parse(SAME), flown, horizon=FURTHER, **how)
    once = identify(parse(SAME), flown, **how)
    assert found.converged
    assert found.settings["horizon"] == list(FURTHER)
    assert "horizon" not in once.settings
    for name, value in TRUTH.items():
        assert found[name].value == pytest.approx(other[name].value, abs=0.05 * other[name].sigma)
        assert abs(found[name].value - value) < 3.0 * found[name].sigma_corrected
        assert found[name].sigma_corrected == pytest.approx(other[name].sigma_corrected, rel=0.02)
    assert other["Lb"].value != once["Lb"].value


@pytest.mark.proof
def test_bounds_of_errors_ahead_cover_the_truth_in_some_seeds() -> None:
    """Overlapping predictions are no independent ones: the corrected bound knows, the plain one does not."""
    apart, plainly = [], []
    for seed in range(10):
        fit = identify(
            parse(SAME), gusty(seed), outputs=("p",), method="filter-error", shifts=False, horizon=(0.1, 0.5)
        )
        assert fit.converged
        apart += [(fit[n].value - v) / fit[n].sigma_corrected for n, v in TRUTH.items()]
        plainly += [(fit[n].value - v) / fit[n].sigma for n, v in TRUTH.items()]
    assert np.mean(np.abs(apart) < 2.0) >= 0.85
    assert 0.5 < np.sqrt(np.mean(np.square(apart))) < 1.5
    assert np.sqrt(np.mean(np.square(plainly))) != pytest.approx(np.sqrt(np.mean(np.square(apart))), rel=0.1)


def test_the_search_makes_errors_ahead_smaller_and_backs_out_of_divergence() -> None:
    criterion = _criterion()
    found = minimise(criterion, Solver(iterations=5), start=criterion.start)
    assert found.history[-1] < 0.8 * found.history[0]
    wild = criterion.start.copy()
    wild[criterion.row.names.index("tau")] *= -1e-4  # unstable beyond any number
    assert criterion.cost(wild) == np.inf


def test_what_cannot_be_predicted_is_refused() -> None:
    flown, free = gusty(), list(TRUTH)
    with pytest.raises(IdentificationError, match="output error has no filter"):
        identify(rolling(), flown, free=free, outputs=["p"], method="output-error", horizon=AHEAD)
    with pytest.raises(IdentificationError, match="Choose method filter-error or prediction-error") as told:
        sp.identify(parse(SAME), flown, method="output-error", horizon=AHEAD)
    assert told.value.channel == "horizon"
    base = _filter_error()
    with pytest.raises(IdentificationError, match="Choose a shorter horizon"):
        MultiStepErrors(base, base.row.starts(), base.records, horizon=Horizon(1.0, 1e4))
    wild = base.row.starts()
    wild[base.row.names.index("tau")] *= -1e-4
    with pytest.raises(IdentificationError, match=r"predictions up to 0\.1 s ahead diverge"):
        MultiStepErrors(base, wild, base.records, horizon=Horizon(*AHEAD))
