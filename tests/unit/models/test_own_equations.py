"""A model of a user's own equations, added by an entry point: everything that ours can do, it can."""

from __future__ import annotations

import dataclasses
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import own_package
import pytest

import swashplate as sp
from flown_here import World
from swashplate.control.lqg.design import design
from swashplate.errors import CardError, SwashError
from swashplate.export.formats import export_model
from swashplate.flights.flight import Flight
from swashplate.links.live.picture import picture, pose_of
from swashplate.models.catalogue import cards_by_name, from_card, started_from
from swashplate.physics.backend import FloatBackend
from swashplate.simulation.standing import at_rest, standing
from swashplate.simulation.trim import Trim

TRUTH = {"k_vane": 0.95, "drag": 0.6, "fan_time": 0.16}


@pytest.fixture(scope="module")
def fan(tmp_path_factory: pytest.TempPathFactory) -> Iterator[sp.Vehicle]:
    with own_package.installed("ducted_fan", tmp_path_factory.mktemp("site")):
        yield sp.vehicle("ducted_fan")


@pytest.fixture(scope="module")
def hover(fan: sp.Vehicle) -> Trim:
    return sp.trim(fan)


@pytest.fixture(scope="module")
def held(fan: sp.Vehicle, hover: Trim) -> Flight:
    """Six seconds of the truth under a hold that is told to go about."""
    t = np.arange(301) / 50.0
    told = {"x": (0.6, 1.3), "y": (0.6, 1.7), "z": (-0.5, 0.9), "psi": (0.5, 1.1)}
    wanted = {name: size * np.sign(np.sin(rate * t)) for name, (size, rate) in told.items()}
    hold = sp.state_hold(fan, hover, rate=50.0)
    return sp.simulate_closed_loop(fan.with_values(TRUTH), hold, duration=6.0, reference=wanted, rate=50.0)


def measured(flown: Flight) -> Flight:
    """A flight with what sensors add."""
    rng, n = np.random.default_rng(4), flown.time("x").size
    noise = {name: 1e-3 * rng.standard_normal(n) for name in ("x", "y", "z", "phi", "theta", "psi", "p", "q", "r")}
    data = flown.streams["uniform"]
    return flown.with_streams({"uniform": data.assign({name: data[name] + own for name, own in noise.items()})})


def test_the_example_is_short_and_names_its_entry_point() -> None:
    folder = own_package.EXAMPLES / "ducted_fan"
    assert len((folder / "ducted_fan.py").read_text().splitlines()) < 60
    project = tomllib.loads((folder / "pyproject.toml").read_text())["project"]
    assert project["entry-points"]["swashplate.models"] == {"ducted_fan": "ducted_fan:ducted_fan"}


def test_it_is_trimmed_where_its_thrust_carries_it(fan: sp.Vehicle, hover: Trim) -> None:
    values = fan.card.values()
    omega = np.sqrt(values["mass"] * 9.81 / values["k_thrust"] / (hover.environment.air_density / 1.225))
    assert hover.states()["omega"] == pytest.approx(omega, rel=1e-3)
    assert hover.commands()["fan"] == pytest.approx(omega / values["fan_speed"], rel=1e-3)
    modes = sp.linearize(fan, hover).modes()
    assert modes[0].eigenvalue == pytest.approx(-1.0 / values["fan_time"], rel=1e-9)


def test_it_is_saved_with_other_numbers_and_loaded_again(fan: sp.Vehicle, tmp_path: Path) -> None:
    fan.with_values(TRUTH, status="identified", sigma=0.01).save(tmp_path / "mine.toml")
    again = sp.vehicle(tmp_path / "mine.toml")
    assert again.card.values()["k_vane"] == 0.95
    assert again.card.parameters["drag"].sigma == 0.01
    assert again.traits.axes == fan.traits.axes


def test_a_fit_finds_its_numbers(fan: sp.Vehicle, held: Flight, tmp_path: Path) -> None:
    truth, inputs = fan.with_values(TRUTH), {name: held.values(name) for name in fan.input_names}
    flight = measured(sp.simulate(truth, inputs, start=sp.trim(truth), rate=50.0))
    seen = ("x", "y", "z", "phi", "theta", "psi", "p", "q", "r")
    fit = sp.identify(fan, flight, free=list(TRUTH), outputs=seen)
    assert fit.converged
    found = fit.model.card.values()
    for estimate in fit.estimates:
        assert abs(estimate.value - TRUTH[estimate.name]) < 3.0 * estimate.sigma, estimate.name
        assert estimate.sigma < 0.03 * TRUTH[estimate.name]  # beside the record's delays, trims and gusts
    fit.model.save(tmp_path / "fit.toml")
    assert sp.vehicle(tmp_path / "fit.toml").card.values() == found


def test_what_was_fitted_remembers_the_card_that_it_began_with(fan: sp.Vehicle) -> None:
    fitted = fan.with_values(TRUTH, status="identified", sigma=0.05)
    assert started_from(fitted).card.values() == fan.card.values()
    assert fan.with_values(TRUTH, status="measured").card.started_from() is None


@pytest.mark.proof
def test_what_was_fitted_is_validated_against_that_card(fan: sp.Vehicle, held: Flight) -> None:
    fitted = fan.with_values({**TRUTH, "drag": 0.5}, status="identified", sigma=0.05)
    found = sp.validate(fitted, measured(held), calibration=3.0)
    assert found.published.card.values() == fan.card.values()
    assert found.log_likelihood["model"] > found.log_likelihood["published card"]


@pytest.mark.proof
def test_identify_frees_what_its_card_is_uncertain_of(fan: sp.Vehicle, held: Flight) -> None:
    fit = sp.identify(fan, measured(held))
    assert {e.name for e in fit.estimates} == {"k_vane", "drag", "fan_time", "damping"}
    for estimate in fit.estimates:
        if estimate.name in TRUTH:
            assert estimate.value == pytest.approx(TRUTH[estimate.name], rel=0.1), estimate.name
    assert {axis.axis for axis in fit.details.excitation} == {"roll", "pitch", "yaw", "heave"}


def test_a_linear_quadratic_controller_holds_it(fan: sp.Vehicle) -> None:
    flown = sp.simulate_closed_loop(fan, design(fan), duration=6.0, reference={"x": 0.5}, rate=100.0)
    assert flown.values("x")[-1] == pytest.approx(0.5, abs=0.05)


def test_it_is_exported_to_c(fan: sp.Vehicle) -> None:
    files = export_model(fan, "c", name="fan").files
    assert {name.rpartition(".")[2] for name in files} >= {"c", "h"}


def test_it_stands_on_skids_and_is_flown_on_the_live_page(fan: sp.Vehicle, hover: Trim) -> None:
    ground = standing(fan)
    row = at_rest(ground, hover.environment)
    rates = ground.rates(row.tolist(), [0.0] * 4, ground.values(), hover.environment, FloatBackend())
    assert abs(rates[fan.index("w")]) < 1e-6, "its weight is carried by the skids"
    shapes = picture(fan)
    assert shapes["size"] == fan.card.values()["rotor_radius"]
    thrust = pose_of(fan)(hover.state, hover.inputs, hover.environment)["rotors"][0][3:]
    assert thrust == pytest.approx([0.0, 0.0, -1.0], abs=1e-3), "in weights"
    world = World(fan)
    for _ in range(20):
        world.step()
    assert world.trouble == ""


def test_a_package_whose_card_is_missing_is_told(
    fan: sp.Vehicle, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.modules["ducted_fan"], "__file__", str(tmp_path / "ducted_fan.py"))
    with pytest.raises(CardError, match=r"ducted_fan: has no card of its own.*put ducted_fan.toml beside the module"):
        sp.vehicle("ducted_fan")
    assert "has no card of its own" in str(cards_by_name()[1][0])


def test_a_misspelt_name_is_told_with_the_nearest(fan: sp.Vehicle) -> None:
    with pytest.raises(CardError, match=r"Did you mean 'ducted_fan'\?"):
        sp.vehicle("ducted_fans")
    cards, faults = cards_by_name()
    assert cards["ducted_fan"] == fan.card
    assert faults == ()
    with pytest.raises(SwashError, match=r"expected one of .*ducted_fan"):
        from_card(dataclasses.replace(fan.card, vehicle="glider"))
