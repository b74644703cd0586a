"""Linear models on the live page: sticks that mean what they say, what is drawn, and what they do not have."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from flown_by_hand import PHI, Z, flown_rows, fly, fresh, holds_what_is_held, moves_its_way, recorded
from flown_here import World
from swashplate.errors import CardError, FlightError, SwashError
from swashplate.flights.flight import Flight
from swashplate.links.live.axes import STICKS, axes_of
from swashplate.links.live.identifying import commands
from swashplate.links.live.picture import picture, pose_of
from swashplate.links.live.pilots import MODES
from swashplate.links.live.replay import Replay, as_json, replay
from swashplate.links.live.session import LiveSession
from swashplate.links.live.world import steps_back
from swashplate.models.linear.linear_vehicle import linear_vehicle
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import parse, structure, to_toml
from swashplate.models.surroundings import input_delays
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.linearize import linearize


@pytest.fixture(scope="module")
def model() -> StateSpaceModel:
    return structure("thirteen_state")


@pytest.fixture(scope="module")
def thirteen(model: StateSpaceModel) -> World:
    return World(linear_vehicle(model))


@pytest.fixture(scope="module", params=["thirteen_state", pytest.param("coaxial", marks=pytest.mark.proof)])
def world(request: pytest.FixtureRequest, thirteen: World) -> World:
    return thirteen if request.param == "thirteen_state" else World(linear_vehicle(structure(request.param)))


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("axis", STICKS)
def test_a_stick_moves_the_aircraft_its_way(world: World, mode: str, axis: str) -> None:
    moves_its_way(world, mode, axis)


@pytest.mark.parametrize("mode", [pytest.param("velocity", marks=pytest.mark.proof), "position"])
def test_what_is_held_is_held(world: World, mode: str) -> None:
    holds_what_is_held(world, mode)


def test_there_is_no_ground_and_a_flight_ends_where_angles_are_no_small_ones(thirteen: World) -> None:
    world = fresh(thirteen, "velocity")
    assert fly(world, 15.0, heave=-1.0)[Z] > 1.0, "it sinks through the level that is drawn"
    assert not world.trouble
    fresh(world, "raw")
    last = fly(world, 20.0, roll=1.0)
    assert world.trouble.startswith("Leans 60 deg")
    assert np.radians(50.0) < abs(last[PHI]) < np.radians(60.0)
    world.reset()
    assert not world.trouble


def test_the_ghost_is_the_aircraft_with_the_decoupling_the_other_way(thirteen: World) -> None:
    world = fresh(thirteen, "raw", ghost=True)
    own = fly(world, 0.52, pitch=0.4).copy()
    ghost = world.moment().crafts["ghost"][0].copy()
    fresh(world, "raw")
    world.setting.decoupled = False
    alone = fly(world, 0.52, pitch=0.4).copy()
    world.setting.decoupled = True
    assert np.max(np.abs(ghost - alone)) < 1e-12
    assert abs(ghost[PHI]) > 1e-3
    assert abs(own[PHI]) < 0.1 * abs(ghost[PHI]), "half a second after the stick arrived, pitch has left roll alone"


def test_input_delays_are_flown(thirteen: World) -> None:
    """20 ms of every input: the flight of the matrices under inputs that are moved by ten physics steps by hand."""
    world = fresh(thirteen, "raw")
    vehicle, start = world.vehicle, world.moment().crafts["own"][0].copy()
    assert set(input_delays(vehicle).values()) == {0.02}
    given, rows = [], []
    for k in range(60):
        rows.append(fly(world, 0.01, roll=0.5 * (k % 20 < 10), pitch=-0.3 * (k > 30)).copy())
        given.append(world.moment().crafts["own"][1].copy())
    assert np.array_equal(rows[1], start), "nothing moves before the first stick arrives"
    assert not np.array_equal(rows[2], start)
    driven = np.repeat(given, 5, axis=0)
    driven = np.vstack([np.tile(world.trim.inputs, (10, 1)), driven, driven[-1:]])[: len(driven) + 1]
    flown = sp.simulate(vehicle, driven, start=world.trim, rate=500.0, delays=0.0)
    found = flown.array(vehicle.state_names)[5::5]
    assert np.max(np.abs(found - rows)) < 1e-9


def test_delays_that_are_no_whole_controller_steps() -> None:
    late = linear_vehicle(parse(to_toml(structure("thirteen_state")).replace("value = 0.02", "value = 0.034")))
    (back,) = World(late).steps_back
    ago = np.arange(5)[:, None] * 2 + 10 * back  # ms from when the input was given to the substep
    assert np.all((ago >= 34) & (ago < 44))
    assert not steps_back(np.zeros(4), 5, 500.0).any()


@pytest.fixture(scope="module")
def recording(thirteen: World, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[np.ndarray]]:
    world = fresh(thirteen, "position")
    rows = flown_rows(world, 4.0, pitch=0.3, heave=0.2)
    folder = tmp_path_factory.mktemp("recorded")
    assert recorded(world, rows, folder).number == 1
    return folder, rows


def far_off(shown: Replay, channels: slice = slice(0, 12)) -> float:
    assert shown.predicted is not None
    there = np.isfinite(shown.predicted[:, 0])
    assert np.mean(there) > 0.7
    return float(np.max(np.abs(shown.predicted - shown.states[:, :12])[there][:, channels]))


def test_a_recording_is_a_flight_and_replays_with_its_own_model(
    thirteen: World, recording: tuple[Path, list[np.ndarray]]
) -> None:
    folder, rows = recording
    vehicle = thirteen.vehicle
    assert {"x", "lateral", "collective"} <= set(Flight.load(folder / "recording-1.nc").channels)
    truth = Flight.load(folder / "recording-1-truth.nc")
    names = (*vehicle.state_names, *vehicle.input_names)
    assert np.array_equal(truth.array(names), np.array(rows)[:, : len(names)])
    shown = replay(truth, model=vehicle, ahead=1.0)
    second = shown.time > 1.0  # what was on its way when the log began is not in it
    assert np.nanmax(np.abs(shown.predicted - shown.states[:, :12])[second]) < 0.002
    assert far_off(shown) < 0.1
    assert not as_json(shown)["picture"]["ground"]


def test_a_log_of_absolute_inputs_is_replayed_about_its_mean(
    thirteen: World, recording: tuple[Path, list[np.ndarray]]
) -> None:
    truth, model = Flight.load(recording[0] / "recording-1-truth.nc"), thirteen.vehicle
    moved = {home: data.assign(collective=data.collective + 5.0) for home, data in truth.streams.items()}
    log = replace(truth.with_streams(moved), provenance=replace(truth.provenance, vehicle="X8"))
    shown = replay(log, model=model, ahead=1.0)
    trims = shown.vehicle.card.values()
    assert trims["trim_collective"] == pytest.approx(5.0 + np.mean(truth.values("collective")))
    assert trims["trim_theta"] == pytest.approx(np.mean(truth.values("theta")))
    assert far_off(shown, slice(2, 3)) < 0.2, "five units of collective are no deviation: it does not shoot up"
    bare = log.with_streams({home: data.drop_vars("pedal") for home, data in log.streams.items()})
    with pytest.raises(FlightError, match=r"lacks pedal: .* without them there is no prediction"):
        replay(bare, model=model)


def test_flapping_is_drawn_and_thrust_is_the_weight(model: StateSpaceModel) -> None:
    vehicle = linear_vehicle(model)
    shape, pose = picture(vehicle), pose_of(vehicle)
    at = dict.fromkeys(vehicle.state_names, 0.0)
    row = [0.0] * 4
    told = pose(list(at.values()), row, Environment())
    assert told["rotors"][0][3:] == pytest.approx([0.0, 0.0, -shape["weight"]])
    assert not shape["ground"]
    assert not shape["rpm"]
    tilted = pose(list((at | {"a": 0.02, "b": 0.05, "c": -0.1, "d": 0.2}).values()), row, Environment())
    assert tilted["rotors"][0][:2] == [0.05, 0.02]
    assert tilted["bar"] == [0.2, -0.1]
    assert tilted["rotors"][0][3] < 0.0 < tilted["rotors"][0][4], "aft and right, as the disc"
    rigid = linear_vehicle(structure("six_dof"))
    assert pose_of(rigid)([0.0] * 12, row, Environment())["bar"] is None
    coax = linear_vehicle(structure("coaxial"))
    two = pose_of(coax)([0.0] * len(coax.state_names), row, Environment())
    assert len(two["rotors"]) == len(picture(coax)["rotors"]) == 2


def test_a_file_may_say_how_large_it_is(model: StateSpaceModel) -> None:
    text = to_toml(model)
    assert picture(linear_vehicle(model))["size"] == 1.0
    large = parse(text + "\n[shape]\nrotor_radius = 1.535\n")
    assert picture(linear_vehicle(parse(to_toml(large))))["size"] == 1.535, "kept when the file is written"
    with pytest.raises(CardError, match=r"shape\.rotor_radius.* expected 0 to 100 m"):
        parse(text + '\n[shape]\nrotor_radius = "large"\n')
    with pytest.raises(CardError, match=r"shape\.colour"):
        parse(text + "\n[shape]\ncolour = 3\n")


def test_inputs_of_other_names_are_found_by_what_they_move(model: StateSpaceModel, thirteen: World) -> None:
    text = to_toml(model)
    for old, new in (("lateral", "k2"), ("longitudinal", "k0"), ("pedal", "k3"), ("collective", "k1")):
        text = text.replace(f"{old} =", f"{new} =")
    matrices = linearize(thirteen.vehicle, thirteen.trim)  # the names are all that differs
    found = axes_of(linear_vehicle(parse(text)), matrices)
    expected = axes_of(thirteen.vehicle, matrices)
    assert dict(found.excited) == {"roll": "k2", "pitch": "k0", "yaw": "k3", "heave": "k1"}
    assert np.allclose(found.mixing[True], expected.mixing[True])
    still = replace(matrices, B=np.where(np.arange(4) == 3, 0.0, matrices.B))
    with pytest.raises(SwashError, match="no input that moves z"):
        axes_of(thirteen.vehicle, still)


def test_what_it_does_not_have_is_hidden_and_refused(
    model: StateSpaceModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("swashplate.links.live.session.web_assembly", lambda source: b"")
    session = LiveSession(linear_vehicle(model), controller=None, folder=tmp_path)
    told = session.hello()["model"]["hello"]
    assert (told["wind"], told["bar"], told["voltages"], told["hows"]) == (False, False, None, ["responses"])
    assert told["about"].startswith("A linear model: deviations from one trim")
    with pytest.raises(SwashError, match="has no bar"):
        asyncio.run(session.obey({"type": "bar", "value": True}))


def test_identify_leads_to_its_responses_only(thirteen: World) -> None:
    vehicle: Vehicle = thirteen.vehicle
    found = commands(vehicle, Path("f.nc"), card=Path("c.toml"), out=Path("out"), how="model")
    assert len(found) == 1
    assert "respond" in found[0]
    assert "lateral,longitudinal,pedal,collective" in found[0]
