"""A card as the prior of a flight: what it holds, how it enters, and whether flight and card disagree."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

import report_samples
import swashplate as sp
from simulated_flights import FREE, TIE, ten_seconds
from swashplate.errors import CardError, IdentificationError
from swashplate.flights.flight import Flight
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.result import Result
from swashplate.models.card import Card
from swashplate.reporting.compose import compose
from swashplate.reporting.structure import Table, Text


def _card(measured: Mapping[str, tuple[float, float]], **correlations: dict[str, float]) -> Card:
    card = sp.vehicle("coax").card
    for name, (value, sigma) in measured.items():
        card = card.with_values({name: value}, sigma=sigma, status="measured", source="bench: somewhere")
    return replace(card, correlations=correlations)


def test_correlated_priors_are_a_parabola_whose_hessian_is_their_inverse_covariance() -> None:
    entries = (
        Entry("a", "parameter", 0.0, 2.0, mean=1.0, sigma=0.5),
        Entry("b", "parameter", 0.0, 10.0),
        Entry("c", "parameter", 0.0, 0.1, mean=-2.0, sigma=0.2),
    )
    row = Row(entries, ((0, 2, -0.6),))
    covariance = np.array([[0.25, -0.06], [-0.06, 0.04]])
    at = np.array([1.5, 7.0, 4.0])
    away = at[[0, 2]] * [2.0, 0.1] - np.array([1.0, -2.0])
    cost, gradient, hessian = row.prior(at)
    assert cost == pytest.approx(0.5 * away @ np.linalg.inv(covariance) @ away)
    np.testing.assert_allclose(
        hessian[np.ix_([0, 2], [0, 2])], np.linalg.inv(covariance) * np.outer([2.0, 0.1], [2.0, 0.1])
    )
    assert not hessian[1].any()
    assert gradient[1] == 0.0
    independent = Row(entries).prior(at)[2]
    np.testing.assert_allclose(np.diag(independent), [16.0, 0.0, 0.25])


def test_a_card_gives_priors_to_what_is_free_and_values_to_the_rest() -> None:
    card = _card(
        {"tau_f_upper": (1.5, 0.1), "linkage_lower": (0.12, 0.01), "k_thrust_lower": (3e-5, 1e-7)},
        tau_f_upper={"linkage_lower": 0.3},
        k_thrust_lower={"linkage_lower": -0.8},
    )
    table = parameterize(sp.vehicle("coax"), FREE, prior_card=card)
    by_name = {free.name: free for free in table.free}
    assert (by_name["tau_f_upper"].mean, by_name["tau_f_upper"].sigma) == (1.5, 0.1)
    assert by_name["tau_f_upper"].source == "card: bench: somewhere"
    assert table.held == ("k_thrust_lower",)
    held = table.vehicle.card.parameters["k_thrust_lower"]
    assert (held.value, held.status, held.sigma) == (3e-5, "measured", 1e-7)
    ((first, second, value),) = table.prior_correlations
    assert {table.names[first], table.names[second]} == {"tau_f_upper", "linkage_lower"}
    assert value == pytest.approx(0.3)
    assert table.without(["tau_f_upper"]).prior_correlations == ()


def test_what_the_user_says_goes_before_the_card() -> None:
    card = _card({"tau_f_upper": (1.5, 0.1), "linkage_lower": (0.12, 0.01)}, tau_f_upper={"linkage_lower": 0.3})
    table = parameterize(
        sp.vehicle("coax"), FREE, prior_card=card, priors={"tau_f_upper": (1.0, 0.5)}, fixed={"mass": 0.333}
    )
    by_name = {free.name: free for free in table.free}
    assert (by_name["tau_f_upper"].mean, by_name["tau_f_upper"].source) == (1.0, "given prior")
    assert table.prior_correlations == ()  # the correlation was with the card's number
    fixed = parameterize(sp.vehicle("coax"), "linkage_lower", prior_card=card, fixed={"tau_f_upper": 1.1})
    assert fixed.vehicle.card.values()["tau_f_upper"] == 1.1
    assert fixed.held == ()


def test_a_card_that_measured_nothing_or_is_of_another_vehicle_is_refused() -> None:
    coax = sp.vehicle("coax")
    with pytest.raises(CardError, match="no parameter with status measured or identified and a sigma"):
        parameterize(coax, FREE, prior_card=coax.card)
    with pytest.raises(CardError, match="is for 'kite', not for 'coax'"):
        parameterize(coax, FREE, prior_card=replace(_card({"mass": (0.3, 0.1)}), vehicle="kite"))
    with pytest.raises(IdentificationError, match="prior is 1"):
        parameterize(coax, FREE, prior_card=_card({"mass": (0.3, 0.01)}), priors={FREE[0]: (1.0, 0.0)})


@lru_cache(maxsize=1)
def _flight() -> Flight:
    return ten_seconds().condition(rate=100.0, cutoff=0.0)


def _fit(card: Card | None) -> Result[Any, Any]:
    start = sp.vehicle("coax")
    return sp.identify(start, _flight(), free=FREE, method="output-error", tie=[TIE], prior=card)


@lru_cache(maxsize=1)
def _flight_alone() -> Result[Any, Any]:
    return _fit(None)


def test_bench_and_flight_join_by_their_information() -> None:
    """As two measurements of the same numbers do: C = (F^-1 + P^-1)^-1, value = C (F^-1 flight + P^-1 bench)."""
    flight = _flight_alone()
    a, b = flight.names
    sigma = {name: flight[name].sigma for name in (a, b)}
    means = {name: flight[name].value + 1.0 * sigma[name] for name in (a, b)}
    card = _card({name: (means[name], sigma[name]) for name in (a, b)}, **{a: {b: 0.5}})
    joined = _fit(card)
    assert joined.names == flight.names
    P, F = card.covariance([a, b]), flight.covariance
    C = np.linalg.inv(np.linalg.inv(P) + np.linalg.inv(F))
    expected = C @ (
        np.linalg.solve(F, [flight[n].value for n in (a, b)]) + np.linalg.solve(P, [means[n] for n in (a, b)])
    )
    for i, name in enumerate((a, b)):
        assert joined[name].value == pytest.approx(expected[i], abs=0.1 * sigma[name])
        assert joined[name].sigma == pytest.approx(float(np.sqrt(C[i, i])), rel=0.05)
        assert joined[name].prior_source == "card: bench: somewhere"
        assert abs(joined[name].disagreement) < 2.0


def test_a_prior_that_is_wrong_is_told_in_sigmas() -> None:
    flight = _flight_alone()
    name = "linkage_lower"
    sigma = flight[name].sigma
    joined = _fit(_card({name: (flight[name].value + 12.0 * sigma, sigma), "mass": (0.30201, 1e-3)}))
    estimate = joined[name]
    assert estimate.alone == pytest.approx(flight[name].value, abs=1.5 * sigma)
    wider = max(1.0, (estimate.sigma_corrected / estimate.sigma) ** 2)
    assert estimate.disagreement == pytest.approx(-12.0 / np.sqrt(1.0 + wider), rel=0.2)
    assert joined.settings["held at the prior card"] == ["mass"]
    assert joined.model.card.parameters["mass"].status == "measured"
    assert joined.start.card.values()["mass"] == 0.302
    report = compose(joined, modes={})
    section = next(section for section in report.sections if section.identifier == "prior")
    verdict, estimates, held = section.blocks
    assert isinstance(verdict, Text)
    assert verdict.tone == ("bad" if abs(estimate.disagreement) > 3.0 else "good")
    assert isinstance(estimates, Table)
    assert isinstance(held, Table)
    assert [row[0].words for row in estimates.rows] == [name]
    assert [row[0].words for row in held.rows] == ["mass"]
    assert held.rows[0][-1].words == "bench: somewhere"


def test_a_fit_without_a_card_has_no_section_on_priors() -> None:
    report = compose(report_samples.fit(), modes=report_samples.modes())
    assert all(section.identifier != "prior" for section in report.sections)


def test_a_sharp_prior_does_not_hide_that_the_flight_disagrees() -> None:
    """A prior a hundred times surer than the flight, ten of the flight's sigmas away from it."""
    flight = _flight_alone()
    name = "linkage_lower"
    sigma = flight[name].sigma
    fit = _fit(_card({name: (flight[name].value + 10.0 * sigma, 0.01 * sigma)}))
    estimate = fit[name]
    assert estimate.prior_share > 0.999
    wider = max(1.0, (flight[name].sigma_corrected / sigma) ** 2)
    assert any("linkage_lower: the flight is -" in problem for problem in fit.problems)
    assert not fit.failed
    assert -12.0 < estimate.disagreement < -0.5 * 10.0 / np.sqrt(wider)
