"""A linear model fitted to a controller's answer says so in its file, and a whole autopilot gets no gains from it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simulated_loops import Case, fly
from swashplate.control.analysis.gain_premises import refused_by_card
from swashplate.errors import CardError
from swashplate.flights.flight import Flight
from swashplate.identification.frequency.state_space_fit import fit_state_space
from swashplate.identification.identify import identify
from swashplate.identification.responses.respond import respond
from swashplate.models.catalogue import vehicle
from swashplate.models.linear.linear_vehicle import linear_vehicle
from swashplate.models.linear.state_space import UNMOVED, StateSpaceModel
from swashplate.models.linear.state_space_file import parse, to_toml

LOOP = Case(21, gains=(0.15, 0.1, 0.0, 1.2, 0.0), log=100.0, seconds=60.0)
ROLL = parse("""kind = "state-space"
name = "roll"
[states]
p = "rad/s"
[inputs]
command = "1"
[equations]
p = {p = "Lp", command = "Lc"}
[outputs]
p = {of = {p = "1"}}
[delays]
command = "tau"
[parameters]
Lp = {value = -2.0, unit = "1/s"}
Lc = {value = 40.0, unit = "1/s^2"}
tau = {value = 0.02, unit = "s", lower = 0.0, upper = 0.2}
""")


@pytest.fixture(scope="module")
def flown() -> dict[str, Flight]:
    cases = {"gusts": LOOP, "steps": replace(LOOP, shape="steps", place="rate", size=1.5)}
    return {name: one.flight for name, one in zip(cases, fly(list(cases.values())), strict=True)}


def fitted(flight: Flight, method: str) -> StateSpaceModel:
    if method == "responses":
        found = respond([flight], inputs=["command"], outputs=["p"], band=(0.3, 5.0))
        return fit_state_space(ROLL, found, starts=1, least_coherence=0.3).solution
    return identify(ROLL, flight.condition(rate=100.0), outputs=["p"], shifts=False).solution


@pytest.mark.parametrize("method", ["responses", "output-error"])
def test_what_only_a_controller_moved_is_named_in_the_file(
    flown: dict[str, Flight], method: str, tmp_path: Path
) -> None:
    answered = fitted(flown["gusts"], method)
    (tmp_path / "model.toml").write_text(to_toml(answered), encoding="utf-8")
    again = vehicle(tmp_path / "model.toml")
    assert refused_by_card(again.card).startswith("command: fitted although no flight moved it from outside.")
    moved = fitted(flown["steps"], method)
    assert refused_by_card(linear_vehicle(moved).card) == ""
    assert UNMOVED not in to_toml(moved)


def test_a_later_fit_of_what_was_moved_takes_the_mark_away() -> None:
    marked = ROLL.with_unmoved(["command", "no input of it"])
    assert parse(to_toml(marked)).document[UNMOVED] == {"command": 1.0}
    assert UNMOVED not in marked.with_unmoved([]).document


def test_a_mark_of_no_input_is_refused() -> None:
    text = to_toml(ROLL.with_unmoved(["command"])).replace("[unmoved]\ncommand", "[unmoved]\nrudder")
    with pytest.raises(CardError, match=r"unmoved\.rudder: is no input"):
        parse(text)


def test_numbers_are_those_without_the_mark(flown: dict[str, Flight]) -> None:
    marked, plain = ROLL.with_unmoved(["command"]), ROLL
    omega = np.array([1.0, 10.0])
    np.testing.assert_array_equal(marked.response(omega), plain.response(omega))
