"""Simulate a helicopter with known numbers, identify it from the log, get the numbers back."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from swashplate.cli.app import app
from swashplate.control.laws.state_hold import state_hold
from swashplate.errors import IdentificationError
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.frequency.start_values import from_linear_model
from swashplate.identification.frequency.state_space_fit import fit_state_space
from swashplate.identification.responses.respond import respond
from swashplate.models.catalogue import vehicle
from swashplate.models.linear.state_space_file import structure
from swashplate.simulation.closed_loop import simulate_maneuver
from swashplate.simulation.linearize import linearize
from swashplate.simulation.trim import trim

TRUE = {"hub_stiffness": 35.0, "wake_distortion": 1.0, "blade_inertia": 0.023}


def _swash(*arguments: object) -> str:
    outcome = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert outcome.exit_code == 0, outcome.output
    return outcome.output


def _recovered(folder: Path, method: str, *, free: str, seconds: int) -> dict[str, float]:
    """Fly the Raptor with other numbers, identify it from motion capture by the command line, and read the model."""
    vehicle("raptor50").with_values(TRUE).save(folder / "true.toml")
    maneuver = f"multisine:roll+pitch,0.6-5Hz,{seconds}s,0.02"
    _swash("simulate", "--vehicle", folder / "true.toml", "--maneuver", maneuver, "--sensors", "clean", "--seed", 1,
           "--out", folder / "flight.nc", "-q")  # fmt: skip
    _swash("identify", "--vehicle", "raptor50", "--flight", folder / "flight.nc", "--free", free,
           "--method", method, "--out", folder / "fit", "-q")  # fmt: skip
    card = vehicle(folder / "fit" / "model.toml").card
    assert card.parameters["hub_stiffness"].status == "identified"
    assert card.parameters["mass"].status == "published"
    return card.values()


def _fits(document: dict[str, Any]) -> dict[tuple[str, str], float]:
    return {(score["predictor"], score["channel"]): score["fit"] for score in document["scores"]}


@pytest.mark.proof
def test_hub_spring_blades_and_wake_distortion_come_back_by_output_error(tmp_path: Path) -> None:
    """A card with estimates becomes a card with identified values."""
    found = _recovered(tmp_path, "output-error", free="hub_stiffness,blade_inertia,wake_distortion", seconds=9)
    assert found["hub_stiffness"] == pytest.approx(35.0, rel=0.01)
    assert found["blade_inertia"] == pytest.approx(0.023, rel=0.02)
    assert found["wake_distortion"] == pytest.approx(1.0, abs=0.03)


@pytest.mark.proof
def test_they_come_back_by_filter_error_and_the_model_predicts_another_flight(tmp_path: Path) -> None:
    """The default method; compiling its derivatives for a helicopter takes minutes.

    The rival of the validation is the card that the model came from, without being named.
    """
    found = _recovered(tmp_path, "filter-error", free="rotor", seconds=15)
    assert found["hub_stiffness"] == pytest.approx(35.0, rel=0.02)
    assert found["blade_inertia"] == pytest.approx(0.023, rel=0.02)
    assert found["wake_distortion"] == pytest.approx(1.0, abs=0.05)
    _swash("simulate", "--vehicle", tmp_path / "true.toml", "--maneuver", "multisine:roll+pitch,0.6-5Hz,9s,0.02",
           "--sensors", "clean", "--seed", 2, "--out", tmp_path / "again.nc", "-q")  # fmt: skip
    compare = (
        "validate",
        "--vehicle",
        tmp_path / "fit" / "model.toml",
        "--flight",
        tmp_path / "again.nc",
        "--horizons",
        1,
    )
    _swash(*compare, "--out", tmp_path / "check", "-q")
    fits = _fits(json.loads((tmp_path / "check" / "validation.json").read_text(encoding="utf-8")))
    against_truth = _fits(
        json.loads(_swash(*compare, "--settings", f"published={tmp_path / 'true.toml'}", "--json", "-q"))
    )
    for channel in ("phi", "theta", "p", "q"):
        assert fits["model", channel] > fits["published card", channel], channel
        # What even the truth cannot predict is noise in the start: no better is to be had, and not much less.
        assert against_truth["model", channel] > against_truth["published card", channel] - 2.0, channel
    assert (tmp_path / "check" / "report.html").is_file()


def test_ready_choices_follow_the_card_and_its_options() -> None:
    plain, barred = (vehicle("raptor50", bar=switch).choices for switch in (False, True))
    assert "bar_gain" not in {free.name for free in plain["full"].free}
    assert {"bar_gain", "bar_inertia"} < {free.name for free in barred["full"].free}
    prior = next(free for free in plain["full"].free if free.name == "hub_stiffness")
    entry = vehicle("raptor50").card.parameters["hub_stiffness"]
    assert (prior.mean, prior.sigma) == (entry.value, entry.sigma)
    assert parameterize(vehicle("raptor50"), "rotor").names == ("hub_stiffness", "blade_inertia", "wake_distortion")


def test_a_choice_for_coaxial_helicopters_is_refused() -> None:
    with pytest.raises(
        IdentificationError, match=r"has neither a ready choice nor a parameter 'flight'.\s+Ready here: rotor, full"
    ):
        parameterize(vehicle("raptor50"), "flight")


@pytest.mark.proof
def test_state_space_fit_that_starts_from_the_card_finds_the_flown_rotor() -> None:
    """Rotor spring, flap time constant and flap coupling of the ten-state structure, from two sweeps under a hold.

    The structure lets the whole thrust lean with the disc, so the flown helicopter does too. Left at the card's values:
    what sweeps above 0.7 Hz cannot tell. The commands are held for 10 ms: 5 ms of delay.
    """
    card = vehicle("raptor50", in_plane="thrust-tilt")
    real = card.with_values({"hub_stiffness": 35.0, "wake_distortion": 1.0})
    called = {"A1": "lateral", "B1": "longitudinal", "p": "p", "q": "q"}
    flights = []
    for axis, seed in (("roll", 0), ("pitch", 1)):
        flown = simulate_maneuver(real, f"sweep:{axis},0.5-6Hz,40s,0.02", controller=state_hold, lead=2.0, tail=2.0)
        noise = np.random.default_rng(seed).standard_normal((4, len(flown.values("p")))) * 0.005
        columns = {new: flown.values(old) + noise[i] * (old in "pq") for i, (old, new) in enumerate(called.items())}
        units = {"lateral": "1", "longitudinal": "1"}
        flights.append(Flight({"uniform": stream(flown.time("p"), columns, units)}, Provenance(axis)))
    responses = respond(flights, inputs=["lateral", "longitudinal"], outputs=["p", "q"], band=(0.7, 6.0))
    truth, start = (from_linear_model(structure("hybrid"), linearize(v, trim(v))) for v in (real, card))
    free = ("Lb", "Ma", "tau_f", "Ab", "Ba")
    known = {name: start.parameters[name].value for name in start.free if name not in free}
    known |= {"Alon": -1.0, "Blat": 1.0, "Alat": 0.0, "Blon": 0.0, "tau_lat": 0.005, "tau_lon": 0.005}
    found = fit_state_space(start.with_values(known, free=False), responses, starts=1).solution.parameters
    for name in free:
        assert found[name].value == pytest.approx(truth.parameters[name].value, rel=0.05), name
    assert abs(start.parameters["Lb"].value / truth.parameters["Lb"].value - 1.0) > 0.15
