"""A vehicle of a user's own equations is reported, validated, identified, drawn, saved and loaded like any other."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from rolling import TRUTH, gusty, rolling
from swashplate.errors import CardError, IdentificationError, SwashError
from swashplate.flights.flight import Flight
from swashplate.identification.core.result import Result
from swashplate.validation.verification import Verification

OUTPUTS = ("p", "pdot", "ay")


@lru_cache(maxsize=1)
def _flight() -> Flight:
    return gusty()


@lru_cache(maxsize=1)
def _fit() -> Result[Any, Any]:
    return sp.identify(rolling(), _flight(), free=list(TRUTH), outputs=OUTPUTS, biases=["ay"])


def test_its_fit_has_both_bounds_and_says_what_it_cannot_see() -> None:
    fit = _fit()
    assert not fit.failed
    for estimate in fit.estimates:
        assert estimate.sigma > 0.0
        assert 0.3 < estimate.sigma_corrected / estimate.sigma < 3.0
    np.testing.assert_allclose(np.sqrt(np.diag(fit.covariance_corrected)), [fit[n].sigma_corrected for n in fit.names])
    assert fit.start.card.values()["Lb"] == 45.0
    assert {c.name for c in fit.constants} == {"start p", "start b", "bias ay", "gust p", "gust b"}
    (comparison,) = fit.in_time
    residual = comparison.residuals.std(axis=0)
    np.testing.assert_allclose(residual, comparison.sigma, rtol=0.05)


def test_its_fit_is_reported(tmp_path: Path) -> None:
    page = sp.report(_fit(), path=tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Does it follow the flight it was fitted to?" in page
    assert "Is what is left over only noise?" in page
    assert page.count("σ corrected") > 0


def test_its_model_is_validated_and_reported_beside_the_fit(tmp_path: Path) -> None:
    checked = sp.validate(_fit().model, _flight())
    assert isinstance(checked, Verification)
    assert {o.output for o in checked.outputs} == set(OUTPUTS)
    assert checked["ay"].fit > 30.0  # the rest is gusts, which are no input
    poor = sp.validate(rolling().with_values({"A": -0.4, "Lb": 1.0}), _flight())
    assert isinstance(poor, Verification)
    assert poor["ay"].theil > 2.0 * checked["ay"].theil
    assert not poor.good
    page = sp.report(_fit(), checked, path=tmp_path / "report.html").read_text(encoding="utf-8")
    assert "J_rms" in page
    with pytest.raises(SwashError, match="published: is nothing for"):
        sp.validate(_fit(), _flight(), published=rolling())


def test_identify_takes_it_and_says_what_it_does_not_know() -> None:
    found = sp.identify(rolling(), _flight(), free=list(TRUTH), outputs=OUTPUTS, biases=["ay"])
    assert found.method == "filter-error"
    assert [e.value for e in found.estimates] == [e.value for e in _fit().estimates]
    with pytest.raises(IdentificationError, match="free: 'roll' has no ready choice of what may move"):
        sp.identify(rolling(), _flight())
    with pytest.raises(IdentificationError, match="wind: the method 'filter-error' does not know it"):
        sp.identify(rolling(), _flight(), free=list(TRUTH), wind=True)
    with pytest.raises(IdentificationError, match="method is 'nelder-mead', expected one of filter-error"):
        sp.identify(rolling(), _flight(), free=list(TRUTH), method="nelder-mead")


def test_its_result_is_loaded_again_with_its_equations(tmp_path: Path) -> None:
    path = _fit().save(tmp_path / "fit.json")
    again = sp.load(path, equations=rolling())
    assert repr(again) == repr(_fit())
    assert again.model.card == _fit().model.card
    with pytest.raises(CardError, match=r"fit.json: model: .* 'roll', which no package here has.*equations=\.\.\."):
        sp.load(path)


def test_models_that_the_data_cannot_tell_apart_fly_nearly_alike() -> None:
    drawn = _fit().draw(200, seed=4)
    spread = np.std([m.card.values()["tau"] for m in drawn])
    assert spread == pytest.approx(_fit()["tau"].sigma_corrected, rel=0.2)
