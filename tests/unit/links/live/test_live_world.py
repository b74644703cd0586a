"""What is flown on the live page: the same equations as offline, sticks that mean what they say, recordings."""

from __future__ import annotations

import threading
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

import swashplate as sp
from flown_by_hand import U, V, X, Y, Z, flown_rows, fly, fresh, holds_what_is_held, moves_its_way, recorded
from flown_here import Turbulence, World
from swashplate.control.laws.linear_decoupling import static_decoupling
from swashplate.control.lqg.design import design
from swashplate.errors import ControllerError, FlightError
from swashplate.filtering.sensor_suite import suite
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.series import Maneuver
from swashplate.links.live import world as live_world
from swashplate.links.live.axes import STICKS
from swashplate.links.live.picture import picture, pose_of
from swashplate.links.live.pilots import MODES
from swashplate.links.live.world import FAN_SECONDS, NOT_HELD
from swashplate.models.card import packaged_cards
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.wind import Gusts, dryden

ROLL_RATE = 9
"""Its place in a state row."""


@lru_cache
def world_of(name: str) -> World:
    """One for all tests: every one begins in a fresh hover."""
    return World(sp.vehicle(name))


@pytest.fixture(params=["coax", "raptor50"])
def world(request: pytest.FixtureRequest) -> World:
    return world_of(request.param)


@pytest.fixture
def coax() -> World:
    return world_of("coax")


def test_flies_as_the_offline_closed_loop(coax: World) -> None:
    fresh(coax, "held")
    found = [fly(coax, 0.01, pitch=0.3).copy() for _ in range(300)]
    controller = sp.autopilot(coax.vehicle, coax.trim, mode="manual")
    flown = sp.simulate_closed_loop(
        coax.vehicle, controller, duration=3.0, reference={"pitch": 0.15}, start=coax.trim, rate=500.0
    )
    expected = flown.array(coax.vehicle.state_names)[5::5]
    assert np.max(np.abs(np.array(found) - expected)) < 1e-9


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("axis", STICKS)
def test_a_stick_moves_the_aircraft_its_way(world: World, mode: str, axis: str) -> None:
    moves_its_way(world, mode, axis)


@pytest.mark.parametrize(
    ("world", "mode"),
    [
        ("coax", "position"),
        ("raptor50", "velocity"),
        pytest.param("coax", "velocity", marks=pytest.mark.proof),
        pytest.param("raptor50", "position", marks=pytest.mark.proof),
    ],
    indirect=["world"],
)
def test_what_is_held_is_held(world: World, mode: str) -> None:
    holds_what_is_held(world, mode)


def test_velocity_mode_flies_the_speed_that_the_stick_asks_for(coax: World) -> None:
    fresh(coax, "velocity")
    assert fly(coax, 12.0, pitch=0.8)[U] == pytest.approx(0.8 * coax.pilot.speed, abs=0.1)


def test_the_ghost_is_the_aircraft_with_the_decoupling_the_other_way(coax: World) -> None:
    fresh(coax, "held", ghost=True)
    own = fly(coax, 4.0, pitch=0.4).copy()
    ghost = coax.moment().crafts["ghost"][0].copy()
    fresh(coax, "held")
    coax.setting.decoupled = False
    alone = fly(coax, 4.0, pitch=0.4)
    assert np.max(np.abs(ghost - alone)) < 1e-12
    # Fankhauser et al., Fig. 10: without the decoupling the path bends away.
    assert abs(ghost[Y] - own[Y]) > 0.3
    assert own[X] > 3.0


def test_drawn_models_fly_beside_it_and_begin_anew_where_it_is(coax: World) -> None:
    values = coax.vehicle.card.values()
    heavy = coax.vehicle.with_values({"mass": 1.05 * values["mass"]})
    world = World(coax.vehicle, draws=[coax.vehicle, heavy])
    own = fly(world, 1.0, pitch=0.4).copy()
    same, other = (row for row in world.moment().fan if row is not None)
    np.testing.assert_array_equal(same, own)
    assert other[Z] > own[Z] + 0.02, "it is heavier and sinks"
    fly(world, FAN_SECONDS - 1.0 + world.period, pitch=0.4)
    now = world.moment()
    assert now.fan_begun == pytest.approx(FAN_SECONDS)
    assert now.fan[1] is not None
    assert abs(now.fan[1][Z] - now.crafts["own"][0][Z]) < 2e-3


def test_decoupling_of_a_single_rotor_is_the_matrix_of_its_linear_model() -> None:
    for name in ("raptor50", "lynx"):  # rotors of both senses
        world = World(sp.vehicle(name, in_plane="blade-element"))
        mixing = world.pilot.gains["raw", True][3:19].reshape(4, 4)
        model = sp.linearize(world.vehicle, world.trim)
        matrix = static_decoupling(model, inputs=["A1", "B1", "theta0T", "theta0"], outputs=["p", "q", "r", "w"]).matrix
        rows = [world.vehicle.input_names.index(entry) for entry in ("A1", "B1", "theta0T", "theta0")]
        shares = np.linalg.solve(matrix, mixing[rows])
        assert np.allclose(shares, np.diag(np.diag(shares)), atol=1e-12)
        # Nose right and up, whatever the rotor's sense.
        B = model.B[[world.vehicle.index("r"), world.vehicle.index("w")]] @ mixing[:, 2:]
        assert B[0, 0] > 0.0
        assert B[1, 1] < 0.0


def test_axes_that_first_derivatives_do_not_tell_apart_are_decoupled_a_moment_later() -> None:
    """With the thrust perpendicular to the disc collective pitches at once and the cyclic does not: half a second."""
    world = World(sp.vehicle("lynx"))
    mixing = world.pilot.gains["raw", True][3:19].reshape(4, 4)
    model = sp.linearize(world.vehicle, world.trim)
    n, m = model.B.shape
    step = scipy.linalg.expm(0.5 * np.block([[model.A, model.B], [np.zeros((m, n + m))]]))[:n, n:]
    moved = step[[world.vehicle.index(name) for name in ("phi", "theta", "psi", "z")]] @ mixing
    assert np.allclose(moved, np.diag(np.diag(moved)), atol=1e-9 * np.abs(moved).max())
    assert (np.sign(np.diag(moved)) == [1.0, -1.0, 1.0, -1.0]).all()


def test_in_the_mode_it_opens_in_short_presses_and_long_ones_end_level(world: World) -> None:
    """Keys are all or nothing: pressed for a second on every axis, then let go, it levels out and flies on."""
    fresh(world, "attitude")
    phi, theta = (world.vehicle.index(name) for name in ("phi", "theta"))
    ahead = fly(world, 1.0, pitch=1.0)
    assert -np.radians(15.0) < ahead[theta] < -np.radians(0.5)
    assert ahead[3] > 0.2
    right = fly(world, 1.0, pitch=0.0, roll=1.0)
    assert np.radians(0.5) < right[phi] < np.radians(15.0)
    for axis in ("roll", "pitch", "yaw", "heave"):
        for way in (1.0, -1.0):
            fly(world, 1.0, **{"roll": 0.0, "pitch": 0.0, "yaw": 0.0, "heave": 0.0, axis: way})
    rests = fly(world, 8.0, roll=0.0, pitch=0.0, yaw=0.0, heave=0.0)
    assert world.trouble == ""
    assert np.max(np.abs(rests[[phi, theta]])) < np.radians(5.0)


def test_it_opens_in_attitude(world: World) -> None:
    assert world.mode == "attitude"


def test_modes_change_in_flight_without_a_jump(coax: World) -> None:
    fresh(coax, "held")
    fly(coax, 2.0, pitch=0.3)
    for mode in ("position", "velocity", "attitude", "held"):
        before = coax.moment().crafts["own"][0].copy()
        coax.set_mode(mode)  # type: ignore[arg-type]
        after = fly(coax, coax.period)
        assert np.max(np.abs(after[:3] - before[:3])) < 0.05
    coax.set_mode("position")
    there = coax.moment().crafts["own"][0][:2].copy()
    assert np.hypot(*(fly(coax, 15.0)[:2] - there)) < 0.3


def test_a_reset_is_in_still_air(coax: World) -> None:
    fresh(coax, "attitude")
    coax.setting.wind = (3.0, -1.0, 0.0)
    coax.set_gusts(1.0)
    fly(coax, 0.5)
    coax.reset()
    assert (coax.setting.wind, coax.setting.gusts) == ((0.0, 0.0, 0.0), 0.0)
    flown = fly(coax, 2.0)
    assert np.hypot(flown[U], flown[V]) < 0.02


def test_the_ground_ends_a_flight_and_reset_begins_another(coax: World) -> None:
    fresh(coax, "raw")
    fly(coax, 5.0, heave=-1.0)
    assert coax.trouble.startswith("Touched the ground at")
    ticks, state = coax.ticks, coax.moment().crafts["own"][0].copy()
    assert np.array_equal(fly(coax, 0.5), state)
    assert coax.ticks == ticks
    coax.reset()
    assert not coax.trouble
    assert fly(coax, 0.1)[Z] == pytest.approx(-coax.start_height, abs=1e-3)


def test_wind_gusts_and_voltage_reach_the_aircraft(coax: World) -> None:
    calm = fly(fresh(coax, "held"), 2.0).copy()
    fresh(coax, "held")
    coax.setting.wind = (0.0, 2.0, 0.0)
    assert fly(coax, 2.0)[Y] > calm[Y] + 0.05
    fresh(coax, "held")
    coax.set_gusts(1.0)
    assert np.hypot(*(fly(coax, 2.0)[:2] - calm[:2])) > 0.005
    fresh(coax, "raw")
    coax.setting.voltage = 11.0
    assert fly(coax, 1.0)[Z] > calm[Z] + 0.05, "an emptier battery lifts less"
    coax.setting.voltage = coax.nominal_voltage or 0.0


def test_turbulence_one_by_one_is_that_of_the_series() -> None:
    gusts = Gusts((1.0, 1.0, 0.6), (5.0, 5.0, 5.0), 2.0)
    source = Turbulence(gusts, rate=20.0, seed=1)
    found = np.array([source.sample() for _ in range(20_000)])
    series = dryden(gusts, samples=20_000, rate=20.0, seed=2)
    assert np.std(found, axis=0) == pytest.approx([1.0, 1.0, 0.6], rel=0.15)
    for i, name in enumerate(("wind_north", "wind_east", "wind_down")):
        own, other = (np.corrcoef(wind[1:], wind[:-1])[0, 1] for wind in (found[:, i], series[name][:, 0]))
        assert own == pytest.approx(other, abs=0.01)


def test_a_maneuver_is_added_to_the_inputs_and_ends(coax: World) -> None:
    fresh(coax, "held")
    coax.fly_maneuver(Maneuver("doublet", ("roll",), 0.4, 0.1))
    assert coax.maneuver_left == pytest.approx(0.4)
    coax.step()
    assert coax.moment().crafts["own"][1][2] == pytest.approx(coax.trim.inputs[2] + 0.1, abs=0.02)
    fly(coax, 0.5)
    assert coax.maneuver_left == 0.0


@pytest.mark.parametrize("world", ["coax", pytest.param("raptor50", marks=pytest.mark.proof)], indirect=True)
def test_a_recording_is_a_flight(world: World, tmp_path: Path) -> None:
    fresh(world, "position")
    rows = flown_rows(world, 2.5, pitch=0.3)
    (tmp_path / "identified-6").mkdir()  # of an earlier session
    for number in range(1, 6):
        (tmp_path / f"recording-{number}.nc").write_text("mine")
    saved = recorded(world, rows, tmp_path)
    path = saved.path
    assert (saved.number, path) == (7, tmp_path / "recording-7.nc")
    assert saved.period == pytest.approx(world.period)
    n = len(world.vehicle.state_names)
    assert np.array_equal(saved.inputs, np.array(rows)[:, n : n + len(world.vehicle.input_names)])
    assert sp.load(tmp_path / "card-7.toml").values() == world.vehicle.values()
    truth, log = Flight.load(tmp_path / "recording-7-truth.nc"), Flight.load(path)
    names = (*world.vehicle.state_names, *world.vehicle.input_names)
    assert np.array_equal(truth.array(names), np.array(rows)[:, : len(names)])
    assert truth.rate("x") == pytest.approx(100.0)
    assert truth.provenance.simulated
    assert set(log.streams) >= {"motion", "inputs"}
    again = sp.simulate(
        world.vehicle,
        {name: truth.values(name) for name in world.vehicle.input_names},
        start=dict(zip(world.vehicle.state_names, rows[0], strict=False)),
        substeps=5,
    )
    assert np.max(np.abs(again.array(names) - truth.array(names))) < 1e-9, "its inputs are those that flew it"
    with pytest.raises(FlightError, match=r"0\.5 s, expected at least 2 s"):
        recorded(world, rows[:50], tmp_path)
    threads = [threading.Thread(target=recorded, args=(world, rows, tmp_path)) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(path.name for path in tmp_path.glob("recording-*-truth.nc")) == [
        f"recording-{k}-truth.nc" for k in (7, 8, 9)
    ]
    assert {(tmp_path / f"recording-{k}.nc").read_text() for k in range(1, 6)} == {"mine"}
    assert not list(tmp_path.glob("*.growing"))


def test_it_flies_through_the_vertical_and_begins_again() -> None:
    world = fresh(world_of("raptor50"), "raw")
    world._crafts["own"].x[2] = -300.0
    lowest = 1.0
    for _ in range(40):
        x = fly(world, 0.1, pitch=-1.0)
        assert np.isfinite(x).all()
        lowest = min(lowest, float(np.cos(x[6]) * np.cos(x[7])))
        if world.trouble:
            break
    assert lowest < -0.3, "it has been upside down"
    world.reset()
    assert not world.trouble
    assert np.abs(fly(world, 0.2)[6:9]).max() < 0.1


@pytest.mark.parametrize("sensors", ["", pytest.param("imu@100,mocap@50+20ms", marks=pytest.mark.proof)])
def test_a_controller_on_its_own_sensors_flies_where_the_sticks_move_its_place(sensors: str) -> None:
    """In short: one that is given the states."""
    coax = sp.vehicle("coax")
    made = design(coax, sensors=suite(sensors) if sensors else (), rate=100.0)
    world = World(coax, controller=made)
    assert world.setting.mode == "position"
    with pytest.raises(ControllerError, match="flies position only, not attitude"):
        world.set_mode("attitude")
    world.setting.sticks["pitch"] = 1.0
    for _ in range(100):
        world.step()
    world.setting.sticks["pitch"] = 0.0
    for _ in range(500):
        world.step()
    assert world.trouble == ""
    own = world.moment()
    assert own.target[0] == pytest.approx(1.0)
    np.testing.assert_allclose(own.crafts["own"][0][:3], own.target[:3], atol=0.1)
    # Noise of its own sensors is in what it does: without it a hover's commands rest.
    before = own.crafts["own"][1].copy()
    world.step()
    assert np.any(world.moment().crafts["own"][1] != before) or not sensors


def test_a_controller_of_another_vehicle_is_refused() -> None:
    coax, raptor = sp.vehicle("coax"), sp.vehicle("raptor50")
    controller = sp.autopilot(coax, sp.trim(coax))
    with pytest.raises(ControllerError, match="is for 'coax', not for 'conventional'"):
        World(raptor, controller=controller)


@pytest.mark.parametrize("name", sorted(packaged_cards()))
def test_every_card_has_a_picture_and_its_thrust_carries_the_weight(name: str) -> None:
    vehicle = sp.vehicle(name)
    hover = sp.trim(vehicle, height=20.0, voltage=vehicle.card.values().get("voltage_nominal"))
    shape = picture(vehicle)
    told = pose_of(vehicle)(hover.state.tolist(), hover.inputs.tolist(), hover.environment)
    assert shape["size"] > 0.0
    assert len(shape["rotors"]) == len(told["rotors"])
    lift = -sum(rotor[5] for rotor in told["rotors"])
    # A lean, the fin and the drag of the downwash take a few per cent.
    assert lift == pytest.approx(shape["weight"], rel=0.12)
    assert (shape["bar"] is None) == (told["bar"] is None)


def test_a_place_that_the_wind_takes_is_told_and_one_that_is_held_is_not(coax: World) -> None:
    fresh(coax, "position").setting.wind = (1.2, 0.0, 0.0)
    fly(coax, 12.0)
    assert coax.doubts() == ()
    fresh(coax, "position").setting.wind = (2.0, 0.0, 0.0)
    moved = fly(coax, 12.0)
    assert np.hypot(*moved[[X, Y]]) > 5.0
    (words,) = coax.doubts()
    assert "The place is not held, it is" in words
    assert "too little against this wind" in words
    fresh(coax, "position")


def identified(nuisance: dict[str, float]) -> Vehicle:
    """A CoaX whose card remembers these numbers of a record."""
    coax = sp.vehicle("coax")
    return coax.with_card(replace(coax.card, observer={"nuisance": nuisance}))


@pytest.mark.parametrize(("servo", "cause"), [(0.03, ""), (0.08, "delays")])
def test_identified_delays_are_flown_and_a_pilot_that_does_not_hold_them_is_told(servo: float, cause: str) -> None:
    """The verdict of the linear loop is that of the flight: a kick fades, or grows."""
    world = World(identified({"delay_motor": 0.06, "delay_servo": servo}))
    assert world.delays.tolist() == [0.06, 0.06, servo, servo]
    assert world.steps_back[0, 0].tolist() == [6, 6, round(100 * servo), round(100 * servo)]
    assert world.not_held == (NOT_HELD.format(cause=cause) if cause else "")
    assert world.pilot.title.endswith(world.not_held)
    fresh(world, "attitude")
    fly(world, 0.2, roll=1.0)
    early = max(np.abs(fly(world, 0.01)[ROLL_RATE]) for _ in range(50))
    fly(world, 4.0)
    assert (max(np.abs(fly(world, 0.01)[ROLL_RATE]) for _ in range(50)) < early) == (not cause)
    assert not live_world.World(world.vehicle, at_once=True).delays.any()


@pytest.mark.parametrize(
    ("heading", "delay", "cause"), [(0.6, 0.0, ""), (1.2, 0.0, "sensors"), (0.92, 0.03, "delays and sensors")]
)
def test_sensors_that_the_pilot_does_not_hold_the_hover_with_are_told(heading: float, delay: float, cause: str) -> None:
    """Markers whose heading is not the nose's: the place that is held comes back, or is circled ever wider."""
    world = World(identified({"level_psi": heading, "delay_servo": delay}))
    assert world.not_held == (NOT_HELD.format(cause=cause) if cause else "")
    fresh(world, "position")
    fly(world, 0.5, roll=1.0)

    def farthest() -> float:
        places = [fly(world, 0.05)[[X, Y]] - world.moment().target[:2] for _ in range(60)]
        return float(np.max(np.hypot(*np.transpose(places))))

    early = farthest()
    fly(world, 6.0)
    assert (farthest() < early) == (not cause)
