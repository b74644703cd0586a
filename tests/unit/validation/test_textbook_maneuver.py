"""A 3-2-1-1 whose elevator rests before and after is judged, whatever the noise is like; a loop's answer is not."""

from __future__ import annotations

from dataclasses import replace

import pytest

from simulated_loops import Case, fly
from swashplate.flights.flight import Flight
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import parse
from swashplate.validation.refutation import OPEN, REFUTED, STANDS
from swashplate.validation.verify import verify

POWER, DAMPING, LAG = 40.0, 3.0, 0.04
MODEL = f"""
kind = "state-space"
name = "roll"
[states]
p = "rad/s"
servo = "1"
[inputs]
command = "1"
[equations]
p = {{p = "Lp", servo = "Lservo"}}
servo = {{servo = "-{1 / LAG}", command = "{1 / LAG}"}}
[parameters]
Lp = {{value = {-DAMPING}, unit = "1/s"}}
Lservo = {{value = {POWER}, unit = "rad/s^2"}}
[outputs.p]
of = {{p = "1"}}
"""
TEXTBOOK = Case(
    31,
    shape="3-2-1-1",
    size=0.06,
    plant=(POWER, DAMPING, LAG, 0.0),
    gust=(0.02, 1.0, 0.0),
    gyro=0.0,
    corner=90.0,
    seconds=30.0,
)


@pytest.fixture(scope="module")
def model() -> StateSpaceModel:
    return parse(MODEL)


@pytest.fixture(scope="module")
def flights() -> dict[str, Flight]:
    """The same maneuver in white and in slow noise of a tenth of the motion, and a loop in gusts."""
    cases = {
        "white": replace(TEXTBOOK, sensor=(0.1, 0.0)),
        "slow": replace(TEXTBOOK, sensor=(0.1, 1.0)),
        "loop": replace(TEXTBOOK, shape="", gains=(0.15, 0.1, 0.0, 1.2, 0.0), gust=(1.0, 0.5, 0.0)),
    }
    return {name: one.flight for name, one in zip(cases, fly(list(cases.values())), strict=True)}


@pytest.mark.parametrize("noise", ["white", "slow"])
def test_the_truth_stands_and_a_wrong_model_is_refuted(
    model: StateSpaceModel, flights: dict[str, Flight], noise: str
) -> None:
    found = verify(model, flights[noise], outputs=["p"])
    assert found.verdict == STANDS, found
    assert found["p"].fit > 80.0
    for wrong in ({"Lservo": -POWER}, {"Lservo": 0.5 * POWER}):
        assert verify(model.with_values(wrong), flights[noise], outputs=["p"]).verdict == REFUTED


def test_a_loop_without_excitation_judges_nobody(model: StateSpaceModel, flights: dict[str, Flight]) -> None:
    for values in ({}, {"Lservo": -POWER}):
        found = verify(model.with_values(values), flights["loop"], outputs=["p"])
        assert found.verdict == OPEN
        assert "nothing from outside moved the controls" in found.headline[0]
