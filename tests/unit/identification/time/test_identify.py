"""`identify` on a simulated flight: its result as a vehicle, as a file, as JSON and in words.

The flight, the free parameters and the method are those of the end-to-end test: the same compiled code.
"""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lacking
import swashplate as sp
from simulated_flights import FREE, TIE, ten_seconds
from swashplate.errors import IdentificationError
from swashplate.flights.flight import Flight
from swashplate.identification.core.result import Result
from swashplate.models.linear.linear_vehicle import structure_of


@lru_cache(maxsize=1)
def _flight() -> Flight:
    return ten_seconds().condition(rate=100.0, cutoff=0.0)


@lru_cache(maxsize=1)
def _fit() -> Result[Any, Any]:
    start = sp.vehicle("coax").with_values({"tau_f_upper": 1.2, "linkage_lower": 0.1})
    return sp.identify(start, _flight(), free=FREE, method="output-error", tie=[TIE])


def test_the_card_of_the_identified_vehicle_comes_back_from_its_file(tmp_path: Path) -> None:
    fit = _fit()
    fit.model.save(tmp_path / "model.toml")
    again = sp.vehicle(tmp_path / "model.toml")
    assert again.card.values() == fit.model.card.values()
    assert again.card.parameters == fit.model.card.parameters
    assert again.card.observer == fit.model.card.observer
    assert (again.card.title, again.card.trust) == (fit.model.card.title, fit.model.card.trust)


def test_the_card_says_what_was_identified_from_what() -> None:
    fit = _fit()
    card = fit.model.card.parameters
    for name in FREE:
        assert card[name].status == "identified"
        assert card[name].value == fit[name].value
        assert card[name].sigma == fit[name].sigma_corrected
        assert "output-error" in card[name].source
        assert "simulated coax" in card[name].source
    assert card["mass"] == fit.start.card.parameters["mass"]
    assert "identified from" in fit.model.card.title
    before = fit.model.card.started_from()
    assert before is not None
    assert before.values() == fit.start.card.values()
    assert "nuisance" in fit.model.card.observer


def test_the_estimates_are_within_their_bounds_of_the_truth_and_know_where_they_came_from() -> None:
    fit, truth = _fit(), sp.vehicle("coax").card.values()
    assert not fit.failed
    for name, before in zip(FREE, (1.2, 0.1), strict=True):
        estimate = fit[name]
        assert abs(estimate.value - truth[name]) < 4.0 * estimate.sigma_corrected
        assert estimate.start == before
        assert estimate.prior_share == 0.0
        assert not estimate.at_bound


def test_a_tied_parameter_follows_with_its_bound() -> None:
    fit = _fit()
    tied, free = fit["design_angle_lower"], fit["linkage_lower"]
    assert tied.tie == "2 * linkage_lower"
    assert tied.value == pytest.approx(2.0 * free.value)
    assert tied.sigma == pytest.approx(2.0 * free.sigma, rel=1e-6)
    assert tied.sigma_corrected == pytest.approx(2.0 * free.sigma_corrected, rel=1e-6)
    assert fit.model.card.values()["design_angle_lower"] == tied.value
    assert fit.names == FREE


def test_the_matrices_belong_together() -> None:
    fit = _fit()
    sigma = np.sqrt(np.diag(fit.covariance))
    np.testing.assert_allclose(sigma, [fit[name].sigma for name in FREE])
    np.testing.assert_allclose(np.sqrt(np.diag(fit.covariance_corrected)), [fit[name].sigma_corrected for name in FREE])
    np.testing.assert_allclose(fit.correlation, fit.covariance / np.outer(sigma, sigma))
    np.testing.assert_allclose(np.diag(fit.correlation), 1.0)


def test_flight_and_model_are_kept_side_by_side() -> None:
    (comparison,) = _fit().comparisons
    counted = np.asarray(comparison.counted, dtype=bool)
    assert counted.mean() > 0.7
    residual = comparison.residuals[counted]
    np.testing.assert_allclose(np.std(residual, axis=0), comparison.sigma, rtol=0.3)
    assert comparison.states.shape == (comparison.record.time.size, 12)
    assert np.isnan(comparison.model[~counted]).all()


def test_it_says_which_axes_were_moved() -> None:
    said = {item.axis: item for item in _fit().details.excitation}
    assert said["roll"].identifiable
    assert said["pitch"].identifiable
    assert said["yaw"].words.startswith("yaw: the command does not move.")


def test_it_prints_and_is_plain_json() -> None:
    fit = _fit()
    document = json.loads(json.dumps(fit.to_document()))
    assert document["names"] == list(FREE)
    assert document["settings"]["ties"] == [TIE]
    assert [entry["operation"] for entry in document["data"][0]["history"]][-1] == "derive"
    text = repr(fit)
    for part in ("coax by output-error: converged", "tau_f_upper", "= 2 * linkage_lower", "value"):
        assert part in text


def test_an_unknown_method_and_a_short_flight_are_refused() -> None:
    coax = sp.vehicle("coax")
    with pytest.raises(IdentificationError, match="method is 'magic', expected one of filter-error"):
        sp.identify(coax, _flight(), method="magic")
    with pytest.raises(IdentificationError, match=r"longest unbroken piece has 5\.0 s, expected at least"):
        sp.identify(coax, _flight().between(0.0, 5.0), free=FREE)


def test_a_stretch_that_is_nowhere_and_one_that_leaves_nothing_are_refused() -> None:
    coax = sp.vehicle("coax")
    for out in ((50.0, 60.0), (3.0, 2.0)):
        with pytest.raises(IdentificationError, match=r"lies in none of the records \(simulated coax"):
            sp.identify(coax, _flight(), free=FREE, leave_out=[out])
    with pytest.raises(IdentificationError, match=r"leaves [0-4]\.\d s of the longest record, expected at least 6 s"):
        sp.identify(coax, _flight(), free=FREE, leave_out=[(1.0, 7.0)])
    with pytest.raises(IdentificationError, match="'output-error' does not know it"):
        sp.identify(coax, _flight(), free=FREE, method="output-error", leave_out=[(1.0, 2.0)])


def test_a_structure_that_flies_is_fitted_by_its_named_parameters() -> None:
    """`sp.structure` gives a vehicle; without `free` its structure says what is free, as the file does."""
    flown = lacking.flights([1], "mixer_roll", gust=0.0, lacking=False, seconds=8.0)
    held = dict.fromkeys(("Ma", "Ba", "Ab", "Blon", "Alat", "Alon", "tau_pitch"), 0.0)
    model = structure_of(sp.structure("rotor_body")).with_values(held, free=False)
    fit = sp.identify(sp.structure("rotor_body").with_values(held, free=False), flown, method="output-error")
    assert fit.names == model.free
    assert abs(fit["Lb"].value - lacking.TRUTH["Lb"]) < 4.0 * fit["Lb"].best_sigma
