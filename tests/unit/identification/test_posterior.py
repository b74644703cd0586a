"""`posterior`: the costs that NUTS differentiates are those that were minimised, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest

import swashplate as sp
from rolling import OUTPUTS_OF_ROLL, SAME, TRUTH, gusty, rolling
from simulated_flights import FREE, ten_seconds
from swashplate.errors import IdentificationError
from swashplate.identification.core import nuts
from swashplate.identification.core.called_cost import called_cost
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import POSE, records
from swashplate.identification.time.output_error import OutputError
from swashplate.identification.time.prediction_error import PredictionError
from swashplate.models.linear.state_space_file import parse
from swashplate.simulation.compilation import RUN_RARELY


@lru_cache(maxsize=4)
def fitted(method: str) -> sp.Result[Any, Any]:
    return sp.identify(rolling(), gusty(), free=list(TRUTH), outputs=OUTPUTS_OF_ROLL, method=method)


@pytest.mark.parametrize("method", ["output-error", pytest.param("filter-error", marks=pytest.mark.proof)])
def test_the_cost_that_jax_differentiates_is_the_cost(method: str) -> None:
    found = fitted(method).fitted
    assert found is not None
    for row in (found.row, found.row + 0.02 * np.sin(np.arange(found.row.size))):
        found.likelihood.refresh(row)
        traced = found.likelihood.traced()
        compiled = jax.jit(traced.function, static_argnums=0, compiler_options=RUN_RARELY)
        np.testing.assert_allclose(compiled(traced.plan, traced.data, row), found.likelihood.cost(row), rtol=1e-9)


class _TracedError(PredictionError):
    compiled_by = "XLA"  # type: ignore[assignment]


@pytest.mark.parametrize("kind", [PredictionError, pytest.param(_TracedError, marks=pytest.mark.proof), OutputError])
def test_the_traced_cost_of_a_tracked_flight_is_its_cost(kind: Any) -> None:
    coax = sp.vehicle("coax")
    likelihood = kind(
        parameterize(coax, list(FREE)), records((ten_seconds().condition(rate=100.0, cutoff=0.0),), coax, outputs=POSE)
    )
    row = likelihood.row.starts()
    likelihood.refresh(row)
    traced = likelihood.traced()
    compiled = jax.jit(traced.function, static_argnums=0, compiler_options=RUN_RARELY)
    np.testing.assert_allclose(compiled(traced.plan, traced.data, row), likelihood.cost(row), rtol=1e-9)
    if traced.function is called_cost:
        both = jax.jit(jax.value_and_grad(lambda row: traced.function(traced.plan, traced.data, row)))
        cost, gradient = both(row)
        assert float(cost) == pytest.approx(likelihood.cost(row), rel=1e-12)
        np.testing.assert_allclose(gradient, likelihood.scores(row)[1], rtol=1e-9)
        lost = traced.function(traced.plan, traced.data, np.full_like(row, np.nan))
        assert not np.isfinite(lost)


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
        (from_file, "comes from a file, and NUTS needs the likelihood"),
        (replace(fit, failed=True), "has failed"),
        (replace(fit, converged=False), "did not converge: chains would start from nowhere"),
    ):
        with pytest.raises(IdentificationError, match=words):
            sp.posterior(other, method="nuts")


def test_a_method_without_a_traced_likelihood_says_so() -> None:
    model = parse(SAME)
    fit = sp.identify(model, gusty(), method="output-error")
    with pytest.raises(IdentificationError, match="is by output-error, and NUTS needs the likelihood"):
        sp.posterior(fit, method="nuts")


@pytest.mark.proof
def test_too_few_draws_are_refused_with_their_diagnostics(monkeypatch: pytest.MonkeyPatch) -> None:
    """200 draws would do, each as far from the last as a new one; with every fourth of them four times they do not."""
    plain = nuts._drawn

    def sluggish(*given: Any) -> Any:
        state, rows, stats = plain(*given)
        return state, np.repeat(rows[::4], 4, axis=0)[: len(rows)], stats

    monkeypatch.setattr(nuts, "_drawn", sluggish)
    with pytest.raises(IdentificationError, match=r"the posterior did not converge: .*400 effective draws are needed"):
        sp.posterior(fitted("output-error"), method="nuts", chains=2, warmup=60, draws=100)
