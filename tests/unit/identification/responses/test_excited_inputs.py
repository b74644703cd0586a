"""What `respond` says of what moved its inputs, and of the inputs that it was not given."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from simulated_loops import Case, fly
from swashplate.flights.flight import Flight, stream
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.responses.respond import respond

LOOP = Case(21, gains=(0.15, 0.1, 0.0, 1.2, 0.0), log=100.0, seconds=60.0)


@pytest.fixture(scope="module")
def flown() -> dict[str, Flight]:
    cases = {"gusts": LOOP, "steps": replace(LOOP, shape="steps", place="rate", size=1.5)}
    return {name: one.flight for name, one in zip(cases, fly(list(cases.values())), strict=True)}


def responses(*flights: Flight) -> FrequencyResponse:
    return respond(flights, inputs=["command"], outputs=["p"], band=(0.3, 5.0))


def test_an_answer_is_a_problem_and_kept_with_the_responses(flown: dict[str, Flight]) -> None:
    found = responses(flown["gusts"])
    assert found.settings["excitation"]["command"]["kind"] == "controller"
    (problem,) = [text for text in found.problems if "controller's answer" in text]
    assert problem.startswith("flight 21 0.00-59.99 s: input 'command' is a controller's answer: ")
    assert "minus the controller's inverse" in problem
    assert "Fly a sweep" in problem
    h, coherence, _ = found.pair("p", "command")
    assert np.nanmedian(coherence) > 0.9, "however coherent"
    assert np.nanmedian(np.abs(np.angle(h))) > np.radians(90.0)


def test_what_was_moved_is_none(flown: dict[str, Flight]) -> None:
    found = responses(flown["steps"])
    assert found.settings["excitation"]["command"]["kind"] in ("maneuver", "sweep")
    assert not [text for text in found.problems if "controller's answer" in text]


def test_one_moved_record_is_enough_and_the_kind_outlives_the_file(flown: dict[str, Flight], tmp_path: Path) -> None:
    found = responses(flown["gusts"], flown["steps"])
    assert found.settings["excitation"]["command"]["kind"] in ("maneuver", "sweep")
    found.save(tmp_path / "responses.nc")
    assert FrequencyResponse.load(tmp_path / "responses.nc").settings["excitation"] == found.settings["excitation"]


def test_what_cannot_be_told_is_a_warning(flown: dict[str, Flight]) -> None:
    time = np.arange(0.0, 20.0, 0.01)
    random = np.random.default_rng(1)
    p = lfilter([1.0], [1.0, -0.9], random.standard_normal(time.size))
    command = -p + 0.45 * p.std() * lfilter([0.44], [1.0, -0.9], random.standard_normal(time.size))
    flight = Flight({"uniform": stream(time, {"command": command, "p": p}, {"command": "1"})})
    found = responses(flight)
    assert found.settings["excitation"]["command"]["kind"] == "unknown"
    assert [text for text in found.warnings if "whether it answers the motion cannot be told" in text]


@pytest.mark.parametrize("other", [True, False])
def test_an_output_that_another_input_moves_names_it(other: bool) -> None:
    """Where gusts alone moved it nothing is named."""
    time = np.arange(0.0, 60.0, 0.01)
    random = np.random.default_rng(2)
    roll, pitch, gust = (lfilter([0.3], [1.0, -0.95], random.standard_normal(time.size)) for _ in range(3))
    mover = pitch if other else gust
    p = lfilter([0.0, 0.0, 0.06], [1.0, -0.94], 0.05 * roll + mover) + 0.001 * random.standard_normal(time.size)
    table = {"mixer_roll": roll, "mixer_pitch": pitch, "p": p}
    found = respond(Flight({"uniform": stream(time, table)}), inputs=["mixer_roll"], outputs=["p"], band=(0.3, 6.0))
    assert any("no input reaches a coherence" in text for text in found.problems)
    named = [text for text in found.warnings if "Add 'mixer_pitch' to the inputs" in text]
    assert bool(named) is other
