"""Any vehicle's equations fitted in time: against the linear route, and what is said where it cannot be done."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hfb320 import OUTPUTS, START, flight, hfb320
from rolling import SAME, TRUTH, gusty, rolling
from swashplate.control.analysis.gain_premises import refused_by_card
from swashplate.errors import IdentificationError
from swashplate.flights.excitation import Excitation
from swashplate.flights.flight import Flight
from swashplate.flights.provenance import Problem
from swashplate.identification.identify import identify
from swashplate.identification.time import vehicle_problem
from swashplate.models.linear.state_space_file import parse


def test_a_linear_vehicle_is_fitted_as_the_linear_model() -> None:
    """Runge-Kutta steps, series and forward derivatives against matrix exponentials and complex steps."""
    flown, outputs = gusty(), ("p", "pdot", "ay")
    found = identify(rolling(), flown, free=list(TRUTH), outputs=outputs, biases=["ay"])
    other = identify(parse(SAME), flown, method="filter-error", shifts=False, biases=["ay"])
    assert found.converged
    assert other.converged
    assert found.history[-1] == pytest.approx(other.history[-1], abs=0.05)
    for name, value in TRUTH.items():
        assert found[name].value == pytest.approx(other[name].value, abs=0.01 * other[name].sigma)
        assert found[name].sigma == pytest.approx(other[name].sigma, rel=1e-3)
        assert abs(found[name].value - value) < 3.0 * found[name].sigma
    entry = found.model.card.parameters["tau"]
    assert (entry.value, entry.status) == (found["tau"].value, "identified")
    assert found.to_document()["estimates"][0]["name"] == "Lb"


def test_a_fit_carries_a_channel_that_is_off_by_a_factor_and_is_not_failed() -> None:
    flown = gusty()
    scaled = Problem("p: is 1.25 ± 0.004 times what the attitude's change gives", (1.25, 0.004))
    told = (scaled, Problem("arrays: 2 gaps"))
    flown = replace(flown, provenance=replace(flown.provenance, source="log.csv", problems=told))
    found = identify(parse(SAME), flown, method="filter-error", shifts=False, biases=["ay"])
    assert found.problems == (f"log.csv: {scaled.text}",)
    assert not found.failed
    assert found.data[0].problems == told
    assert f"! log.csv: {scaled.text}" in repr(found)
    assert identify(rolling(), flown, free=list(TRUTH), outputs=("p", "pdot", "ay"), biases=["ay"]).problems == (
        f"log.csv: {scaled.text}",
    )


def test_priors_and_ties_of_any_vehicle_are_told() -> None:
    """A prior that lies two of its own deviations below the truth is told from what the flight says."""
    free, prior = [name for name in TRUTH if name != "A"], (0.8 * TRUTH["Lb"], 0.1 * abs(TRUTH["Lb"]))
    how: dict[str, Any] = {"outputs": ("p", "pdot", "ay"), "biases": ["ay"], "free": free, "tie": ["A = 2 * tau"]}
    alone, found = identify(rolling(), gusty(), **how), identify(rolling(), gusty(), prior={"Lb": prior}, **how)
    share = (found["Lb"].sigma / prior[1]) ** 2
    assert (found["Lb"].prior_share, alone["Lb"].prior_share) == (pytest.approx(share), 0.0)
    assert found["Lb"].alone == pytest.approx(alone["Lb"].value, abs=0.1 * alone["Lb"].sigma)
    assert found["Lb"].disagreement == pytest.approx((found["Lb"].alone - prior[0]) / prior[1], rel=0.1)
    assert found["A"].sigma == pytest.approx(2.0 * found["tau"].sigma)
    assert "A" not in found.names


@pytest.mark.parametrize("kind", ["controller", "sticks"])
def test_what_only_a_controller_moved_is_told_and_gets_no_gains(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def moved(*_: object, **__: object) -> tuple[Excitation, ...]:
        return (Excitation("log", "stick", kind, "past motion explains it."),)

    monkeypatch.setattr(vehicle_problem, "excitations", moved)
    found = identify(rolling(), gusty(), free=list(TRUTH), outputs=("p", "pdot", "ay"), biases=["ay"], iterations=2)
    refused = refused_by_card(found.model.card)
    assert ("stick: fitted although no flight moved it from outside" in refused) == (kind == "controller")
    assert any("stick: past motion explains it." in text for text in found.warnings) == (kind == "controller")


def test_a_delay_of_a_stick_that_rests_is_what_was_known_before() -> None:
    """Nothing tells it, and its prior keeps it; the fit divided by its information, which is zero."""
    late = SAME.replace("[parameters]", '[delays]\nstick = "late"\n[parameters]\nlate = {value = 0.05, lower = 0.0}')
    model = parse(late.replace("A = {value = 0.4}", "A = {value = 0.5, fixed = true}"))
    flown = gusty()
    stick = np.zeros_like(flown.values("stick"))
    flown = Flight({"uniform": flown.streams["uniform"].assign(stick=("time", stick, {"units": "1"}))})
    found = identify(model, flown, method="filter-error", shifts=False, biases=["ay"])
    assert found["late"].insensitivity == np.inf
    assert found["Lb"].insensitivity < found["Lb"].sigma < np.inf
    assert "late" in repr(found)


def test_what_cannot_be_fitted_is_said() -> None:
    n = 100
    columns = {name: np.linspace(1.0, 2.0, n) for name in ("elevator", "thrust", *OUTPUTS, "beta")}
    flown = flight(columns)
    with pytest.raises(IdentificationError, match="method is 'magic'"):
        identify(hfb320(), flown, free=list(START), outputs=OUTPUTS, method="magic")
    with pytest.raises(IdentificationError, match="does not predict it"):
        identify(hfb320(), flown, free=list(START), outputs=("V", "beta"))
    with pytest.raises(IdentificationError, match="is none of the outputs"):
        identify(hfb320(), flown, free=list(START), outputs=OUTPUTS, biases=["ay"])
    with pytest.raises(IdentificationError, match="has no such parameter"):
        identify(hfb320(), flown, free=["CYb"], outputs=OUTPUTS)
