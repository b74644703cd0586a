"""`posterior`: the slopes that NUTS follows are those of what was minimised, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from rolling import OUTPUTS_OF_ROLL, SAME, TRUTH, gusty, rolling
from simulated_flights import FREE, ten_seconds
from swashplate.errors import IdentificationError
from swashplate.identification.core import nuts
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import POSE, records
from swashplate.identification.time.filter_error import FilterError
from swashplate.identification.time.output_error import OutputError
from swashplate.models.linear.state_space_file import parse


@lru_cache(maxsize=4)
def fitted(method: str) -> sp.Result[Any, Any]:
    return sp.identify(rolling(), gusty(), free=list(TRUTH), outputs=OUTPUTS_OF_ROLL, method=method)


@pytest.mark.parametrize("method", ["output-error", "filter-error"])
@pytest.mark.parametrize("model", [rolling(), parse(SAME)], ids=["vehicle", "state-space"])
def test_the_slope_that_nuts_follows_is_that_of_the_cost(method: str, model: Any) -> None:
    how = {"free": list(TRUTH), "outputs": OUTPUTS_OF_ROLL} if isinstance(model, sp.Vehicle) else {}
    found = sp.identify(model, gusty(), method=method, **how).fitted
    assert found is not None
    likelihood, row = found.likelihood, found.row + 0.02 * np.sin(np.arange(found.row.size))
    likelihood.refresh(row)
    cost, gradient = likelihood.slope(row)
    assert cost == pytest.approx(likelihood.cost(row), rel=1e-12)
    step = 1e-5
    sides = [
        (likelihood.cost(row + step * e) - likelihood.cost(row - step * e)) / (2.0 * step) for e in np.eye(row.size)
    ]
    np.testing.assert_allclose(gradient, sides, rtol=1e-5, atol=1e-5 * np.max(np.abs(gradient)))


@pytest.mark.parametrize("kind", [FilterError, OutputError])
def test_the_slope_of_a_tracked_flight_is_its_cost_and_gradient(kind: Any) -> None:
    coax = sp.vehicle("coax")
    likelihood = kind(
        parameterize(coax, list(FREE)), records((ten_seconds().condition(rate=100.0, cutoff=0.0),), coax, outputs=POSE)
    )
    row = likelihood.row.starts()
    likelihood.refresh(row)
    cost, gradient = likelihood.slope(row)
    assert cost == pytest.approx(likelihood.cost(row), rel=1e-12)
    np.testing.assert_allclose(gradient, likelihood.scores(row)[1], rtol=1e-9)


@pytest.mark.proof
def test_nuts_agrees_with_the_normal_posterior_of_a_long_flight() -> None:
    fit = fitted("output-error")
    drawn = sp.posterior(fit, method="nuts", chains=2, warmup=60, seed=1)
    assert drawn.posterior is not None
    values = drawn.posterior.values
    assert np.all(drawn.posterior.ess[:3] >= 400.0)
    information = fit.fitted.likelihood.scores(fit.fitted.row)[2]  # type: ignore[union-attr]
    scale = fit.fitted.likelihood.row.scale[:3]  # type: ignore[union-attr]
    sigma = np.sqrt(np.diag(np.linalg.inv(information)))[:3] * scale
    np.testing.assert_allclose(values.std(axis=0), sigma, rtol=0.15)
    assert np.all(np.abs(values.mean(axis=0) - [fit[n].value for n in fit.names]) < 0.3 * sigma)
    assert {type(one) for one in drawn.draw(3, seed=1)} == {type(fit.model)}


def test_laplace_draws_as_the_covariance_says_and_needs_no_flight(tmp_path: Path) -> None:
    fit = sp.load(fitted("output-error").save(tmp_path / "fit.json"), equations=rolling())
    drawn = sp.posterior(fit, draws=4000)
    assert drawn.posterior is not None
    np.testing.assert_allclose(np.cov(drawn.posterior.values.T), fit.covariance, rtol=0.1, atol=1e-7)
    assert not drawn.posterior.faults
    np.testing.assert_array_equal(drawn.draw_values(5, seed=2)["Lb"], fit.draw_values(5, seed=2)["Lb"])


def test_what_has_no_posterior_is_refused(tmp_path: Path) -> None:
    fit = fitted("output-error")
    from_file = sp.load(fit.save(tmp_path / "fit.json"), equations=rolling())
    for asked, words in (
        ({"method": "gibbs"}, "'gibbs' is no posterior; there are laplace, nuts"),
        ({"chains": 1}, "chains: is 1, expected at least 2"),
        ({"draws": 5}, "draws: is 5, expected at least 100"),
    ):
        with pytest.raises(IdentificationError, match=words):
            sp.posterior(fit, **asked)  # type: ignore[arg-type]
    for other, words in (
        (from_file, "has no likelihood beside it, and NUTS needs that"),
        (replace(fit, failed=True), "has failed"),
        (replace(fit, converged=False), "did not converge: chains would start from nowhere"),
    ):
        with pytest.raises(IdentificationError, match=words):
            sp.posterior(other, method="nuts")


def test_a_state_space_model_has_draws_too() -> None:
    fit = sp.identify(parse(SAME), gusty(), method="output-error")
    drawn = sp.posterior(fit, method="nuts", chains=2, draws=1000, seed=1).posterior
    assert drawn is not None
    assert drawn.names[:3] == fit.names
    sigma = np.sqrt(np.diag(fit.covariance))
    np.testing.assert_allclose(drawn.values.std(axis=0), sigma, rtol=0.3)


@pytest.mark.proof
def test_too_few_draws_are_refused_with_their_diagnostics(monkeypatch: pytest.MonkeyPatch) -> None:
    """200 draws would do, each as far from the last as a new one; with every fourth of them four times they do not."""
    plain = nuts._Chain.draw

    def sluggish(self: Any, *given: Any) -> None:
        done = len(self.rows)
        plain(self, *given)
        self.rows[done:] = [row for row in self.rows[done::4] for _ in range(4)][: len(self.rows) - done]

    monkeypatch.setattr(nuts._Chain, "draw", sluggish)
    with pytest.raises(IdentificationError, match=r"the posterior did not converge: .*400 effective draws are needed"):
        sp.posterior(fitted("output-error"), method="nuts", chains=2, warmup=60, draws=100)
