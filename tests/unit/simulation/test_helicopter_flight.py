"""The single-rotor helicopter flies: trims and their limits, hold, spin-up, take-off, landing, autorotation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from link_bench import QUICK
from swashplate.control.laws.state_hold import state_hold
from swashplate.errors import CardError, TrimError
from swashplate.flights.flight import Flight, stream
from swashplate.models.catalogue import from_card, vehicle
from swashplate.models.doubts import doubts
from swashplate.models.vehicle import Vehicle
from swashplate.physics import actuators, engine
from swashplate.physics.backend import FloatBackend
from swashplate.physics.engine import RotorSpeed
from swashplate.physics.environment import Environment, air_density
from swashplate.simulation.closed_loop import simulate_closed_loop, simulate_maneuver
from swashplate.simulation.integrate import simulate_open_loop
from swashplate.simulation.standing import at_rest, standing
from swashplate.simulation.stepping import Stepping
from swashplate.simulation.trim import Trim, trim
from swashplate.simulation.trim_curve import trims_over_speed

RAPTOR = vehicle("raptor50")


@pytest.mark.parametrize("name", ["raptor50", "xcell60", "helion", "rmax"])
def test_trims_from_hover_to_fast_flight(name: str) -> None:
    """The power bucket: collective falls, then rises; the nose goes down."""
    top = 15.0 if name == "raptor50" else 20.0
    found = trims_over_speed(vehicle(name), np.linspace(0.0, top, 9))
    collective = [at.commands()["theta0"] for at in found]
    assert max(at.residual for at in found) < 1e-10
    assert 0 < int(np.argmin(collective)) < 8
    assert np.all(np.diff([at.states()["theta"] for at in found]) < 0.0)


def test_climb_turn_wind_weight_and_altitude() -> None:
    hover = trim(RAPTOR).commands()
    assert (
        trim(RAPTOR, climb=2.0).commands()["theta0"] > hover["theta0"] > trim(RAPTOR, climb=-1.0).commands()["theta0"]
    )
    turning = trim(RAPTOR, speed=10.0, turn=0.5)
    assert turning.states()["phi"] == pytest.approx(np.arctan(10.0 * 0.5 / 9.81), abs=0.06)
    assert turning.states()["r"] > 0.3
    windy = trim(RAPTOR, environment=Environment(wind_north=-6.0)).commands()
    moving = trim(RAPTOR, speed=6.0).commands()
    assert windy == pytest.approx(moving, abs=1e-9)  # the air knows only relative motion
    thin = Environment(air_density=air_density(3000.0))
    assert air_density(3000.0) == pytest.approx(0.9093, abs=2e-4)  # ISO 2533
    assert trim(RAPTOR, environment=thin).commands()["theta0"] > hover["theta0"]
    assert trim(RAPTOR.with_values({"mass": 5.5})).commands()["theta0"] > hover["theta0"]


def test_a_trim_that_does_not_exist_says_what_stops_it() -> None:
    with pytest.raises(TrimError, match=r"raptor50\.toml: theta0: 50 m/s.* theta0 = .* deg, but its limit is 15.0 deg"):
        trim(RAPTOR, speed=50.0)
    with pytest.raises(TrimError, match="limit is"):
        trim(RAPTOR.with_values({"mass": 20.0}))
    with pytest.raises(TrimError, match="a turn in wind is no steady flight"):
        trim(RAPTOR, turn=0.1, environment=Environment(wind_east=2.0))
    with pytest.raises(TrimError, match="30 m/s ahead"):
        trims_over_speed(RAPTOR.with_values({"collective_high": 0.1}), [0.0, 30.0])


def test_where_the_equations_are_not_to_be_trusted() -> None:
    def said(**course: float) -> str:
        at = trim(RAPTOR, **course)
        return " ".join(doubts(RAPTOR, at.state, at.inputs, at.environment))

    assert said() == said(speed=10.0) == said(climb=3.0) == ""
    assert "vortex ring" in said(climb=-4.0)
    assert said(climb=-4.0, speed=8.0) == ""
    flat = trim(RAPTOR)
    settling, inputs = np.array(flat.state), np.array(flat.inputs)
    inputs[RAPTOR.input_names.index("theta0")], settling[RAPTOR.index("w")] = 0.0, 0.02
    assert "vortex ring" not in " ".join(doubts(RAPTOR, settling, inputs, flat.environment))
    heavy = RAPTOR.with_values({"mass": 16.0, "collective_high": 0.4, "tail_high": 0.8})
    at = trim(heavy)
    assert "blades would stall" in " ".join(doubts(heavy, at.state, at.inputs, at.environment))
    steep = from_card(RAPTOR.card.with_values({"collective_high": 0.4}))
    at = trim(steep, climb=17.0)
    assert "air comes through the disc at 0.16 of the tip speed" in " ".join(
        doubts(steep, at.state, at.inputs, at.environment)
    )


@pytest.mark.proof
def test_a_hold_keeps_the_helicopter_through_a_maneuver() -> None:
    for options in ({"bar": True, "inflow": "pitt-peters"},):
        flight = simulate_maneuver(
            vehicle("raptor50", **options), "doublet:roll,0.5s,0.03", controller=state_hold, tail=8.0
        )
        assert abs(flight.values("p")).max() > 0.3
        assert abs(flight.values("p")[-1]) < 0.01
        assert abs(flight.values("z")).max() < 0.5


GROUNDED = vehicle("raptor50", ground=True, rotor_speed="throttle")


def _start(**states: float) -> dict[str, float]:
    return {**dict.fromkeys(GROUNDED.state_names, 0.0), **states}


def _low(flight: Flight) -> float:
    return float(flight.values("z").max())


@pytest.mark.proof
def test_spin_up_on_the_skids_take_off_and_landing() -> None:
    """From rest: the rotor comes up to speed, collective lifts it off, and a slow descent puts it down again."""
    rate, depth = 500.0, RAPTOR.card.values()["skid_depth"]
    time = np.arange(round(18.0 * rate)) / rate
    still = {"theta0": -0.03, "B1": 0.0, "A1": 0.0, "theta0T": 0.0}
    inputs = {name: np.full(time.size, value) for name, value in still.items()}
    inputs["throttle"] = np.interp(time, [0.0, 2.0, 9.0, 11.0], [0.02, 0.1, 0.1, 1.0])  # the clutch slips at first
    spun = simulate_open_loop(GROUNDED, inputs, start=_start(z=-depth), rate=rate)
    speed = spun.values("omega")
    assert speed[0] == 0.0
    assert speed[-1] == pytest.approx(RAPTOR.card.values()["rotor_speed"], rel=0.02)
    assert abs(spun.values("z") + depth).max() < 0.02
    assert abs(spun.values("r")).max() < 0.2  # friction lets it creep, no more

    hover = trim(GROUNDED, height=2.0)
    ready = {name: float(spun.values(name)[-1]) for name in GROUNDED.state_names}
    time = np.arange(round(20.0 * rate) + 1) / rate
    height = np.interp(time, [0.0, 4.0, 8.0, 16.0], [depth, 2.0, 2.0, depth - 0.3])
    flown = simulate_closed_loop(
        GROUNDED,
        state_hold(GROUNDED, hover, rate=100.0),
        duration=20.0,
        start={**ready, "psi": 0.0},
        reference={"z": -height},
        rate=rate,
    )
    assert flown.values("z").min() < -1.7
    assert _low(flown) < -depth + 0.05
    assert flown.values("z")[-1] == pytest.approx(-depth, abs=0.05)
    assert abs(flown.values("w")[-1]) < 0.05


def _parked(east: float) -> Flight:
    """A Raptor on its skids, rotor at rest, in a wind that begins when it has settled; 100 Hz is the slowest in use."""
    stands = vehicle("raptor50", rotor_speed="throttle", ground=True, grip=True)
    time = np.arange(1200) / 100.0
    inputs = dict.fromkeys(stands.input_names, np.zeros(time.size)) | {"wind_east": np.where(time > 2.0, east, 0.0)}
    start = {**dict.fromkeys(stands.state_names, 0.0), "z": -stands.card.values()["skid_depth"]}
    return simulate_open_loop(stands, inputs, start=start, rate=100.0)


def _parked_by_c(east: float) -> Flight:
    """The same as links step it."""
    stands, stopped = standing(RAPTOR), Environment()
    stepping = Stepping(stands, at_rest(stands, stopped), stopped, engine=QUICK)
    rows = []
    for k in range(1200):
        stepping.surround(wind_east=east if k > 200 else 0.0)
        rows.append(stepping.advance(np.zeros(len(stands.input_names)), 0.01).states)
    columns = dict(zip(stands.state_names, np.transpose(rows), strict=True))
    return Flight({"uniform": stream(np.arange(len(rows)) / 100.0, columns)})


@pytest.mark.parametrize("parked", [_parked_by_c, pytest.param(_parked, marks=pytest.mark.proof)])
def test_what_is_parked_stays_where_it_is_until_friction_gives_way(parked: Callable[[float], Flight]) -> None:
    """In 10 m/s of wind it stands, held against the drag of fuselage and fin; in 30 m/s, ten times that, it slides."""
    held = parked(10.0)
    for name in ("x", "y", "psi"):
        assert abs(held.values(name)[-1] - held.values(name)[600]) < 1e-6
    card = RAPTOR.card.values()
    pull = card["skid_stiffness"] * sum(held.values(f"grip_{end}_y")[-1] for end in ("fr", "fl", "ar", "al"))
    pressure = 0.5 * 1.225 * 10.0**2
    assert pressure * card["fuselage_area_y"] < pull < pressure * (card["fuselage_area_y"] + card["fin_area"])
    greatest = (9.0 * pull - card["skid_friction"] * card["mass"] * 9.81) / card["mass"]
    assert 0.08 * greatest < parked(30.0).values("v")[210] < 0.1 * greatest  # 0.1 s later; then it turns into the wind


def test_grip_lets_go_in_the_air_and_trims_have_none() -> None:
    """Flight is as without it, and its states vanish."""
    stands = vehicle("raptor50", ground=True, grip=True)
    at = trim(stands, speed=5.0)
    assert at.states()["z"] == -10.0
    assert all(abs(at.states()[name]) < 1e-12 for name in stands.state_names if name.startswith("grip"))
    np.testing.assert_allclose(at.inputs, trim(RAPTOR, speed=5.0).inputs, atol=1e-12)
    with pytest.raises(CardError, match="grip: needs ground to hold"):
        vehicle("raptor50", grip=True)


def _simulated(flying: Vehicle, inputs: dict[str, np.ndarray], start: Trim) -> Flight:
    return simulate_open_loop(flying, inputs, start=start, rate=500.0)


def _by_c(flying: Vehicle, inputs: dict[str, np.ndarray], start: Trim) -> Flight:
    """As links step it, with ground far below."""
    stands = standing(flying)
    first = at_rest(stands, start.environment)
    first[: len(start.state)] = start.state
    first[2] = -100.0
    stepping = Stepping(stands, first, start.environment, engine=QUICK)
    moves = np.stack([inputs[name] for name in stands.input_names], axis=1)
    rows = [first, *(stepping.advance(row, 1.0 / 500.0).states for row in moves[:-1])]
    columns = dict(zip(stands.state_names, np.transpose(rows), strict=True))
    return Flight({"uniform": stream(np.arange(len(rows)) / 500.0, columns)})


@pytest.mark.parametrize("flown", [_by_c, pytest.param(_simulated, marks=pytest.mark.proof)])
def test_autorotation(flown: Callable[[Vehicle, dict[str, np.ndarray], Trim], Flight]) -> None:
    """The throttle is cut: the rotor slows and the aircraft sinks; sinking at 10 m/s the air alone keeps it turning."""
    flying = vehicle("raptor50", rotor_speed="throttle")
    start, n = trim(flying, speed=8.0), 400
    time = np.arange(n) / 500.0
    inputs = {name: np.full(n, value) for name, value in start.commands().items()}
    inputs["throttle"] = np.where(time < 0.2, 1.0, 0.0)
    inputs["theta0"] = np.interp(time, [0.2, 0.4], [start.commands()["theta0"], -0.04])
    inputs["theta0T"] = np.interp(time, [0.2, 0.4], [start.commands()["theta0T"], 0.0])
    entry = flown(flying, inputs, start)
    assert 0.8 < entry.values("omega")[-1] / entry.values("omega")[0] < 0.95
    assert entry.values("w")[-1] > 3.0

    gliding = trim(flying, speed=8.0, climb=-10.0)
    assert gliding.states()["omega"] >= flying.card.values()["rotor_speed"]
    without = {name: np.full(n, value) for name, value in gliding.commands().items()} | {"throttle": np.zeros(n)}
    glide = flown(flying, without, gliding)
    np.testing.assert_allclose(glide.values("omega"), gliding.states()["omega"], rtol=1e-3)
    assert gliding.commands()["theta0"] < 0.0 < start.commands()["theta0"]


def test_a_pure_delay_is_one_up_to_its_own_frequency() -> None:
    """From its two states' rates: exp(-j omega T) within 0.5 deg and 1.5 % up to 1/T; a step stays where it went."""
    T = 0.02
    columns = [actuators.delay_rates(*unit, delay=T) for unit in np.eye(3)]
    A, B = np.array(columns[:2]).T, np.array(columns[2])
    C = np.array([actuators.delayed(*unit, delay=T) for unit in np.eye(2)])
    omega = np.array([0.0, *np.geomspace(1.0, 1.0 / T, 10)])
    answer = np.array([C @ np.linalg.solve(1j * w * np.eye(2) - A, B) for w in omega])
    ratio = answer / np.exp(-1j * omega * T)
    assert answer[0] == pytest.approx(1.0)
    assert np.max(np.abs(np.degrees(np.angle(ratio)))) < 0.5
    assert np.max(np.abs(np.abs(ratio) - 1.0)) < 0.015


def test_delay_and_engine_lag_change_no_steady_flight_and_show_among_the_states() -> None:
    late = vehicle("raptor50", rotor_speed="governed", delay=True, engine_lag=True, servos=True)
    assert late.state_names[-9:] == (
        *(f"{name}_late" for name in late.input_names), *(f"{name}_late_rate" for name in late.input_names), "share",
    )  # fmt: skip
    at = trim(late)
    plain = trim(RAPTOR)
    np.testing.assert_allclose(at.inputs, plain.inputs, atol=1e-9)
    known = at.states()
    assert known["theta0_late"] == pytest.approx(known["theta0_servo"]) == pytest.approx(at.commands()["theta0"])
    assert known["share"] == pytest.approx(known["governor"])


def test_an_engine_that_lags_needs_a_rotor_that_turns_freely() -> None:
    with pytest.raises(CardError, match="engine_lag: needs a rotor speed that the engine can change"):
        vehicle("raptor50", engine_lag=True)


def _spun_up(throttle: Callable[[float], float], load: Callable[[float], float], seconds: float) -> list[RotorSpeed]:
    """A Raptor's rotor and governor alone, from rest, in steps of 2 ms; `load` is a torque by rotor speed."""
    c, xp = RAPTOR.card.values(), FloatBackend()
    state, passed = RotorSpeed(0.0, 0.0), []
    for k in range(round(seconds / 0.002)):
        opened = throttle(0.002 * k)
        share = opened * engine.wanted_share(state, wanted=c["rotor_speed"], gain=c["governor_gain"], xp=xp)
        torque = engine.engine_torque(state, share, wanted=c["rotor_speed"], power=c["engine_power"], xp=xp)
        rates = engine.rotor_speed_rates(
            state, torque, load(state.omega), opened, wanted=c["rotor_speed"], inertia=c["rotor_inertia"],
            gain=c["governor_gain"], integral_gain=c["governor_integral"], xp=xp,
        )  # fmt: skip
        state = RotorSpeed(state.omega + 0.002 * rates.omega, state.governor + 0.002 * rates.governor)
        passed.append(state)
    return passed


def test_a_governor_does_not_wind_up_while_the_engine_gives_all_or_nothing() -> None:
    """From rest at full power the speed passes the wanted one by less than 1 %; a closed throttle is not remembered."""
    wanted, torque = RAPTOR.card.values()["rotor_speed"], 3.0
    drag = torque / wanted**2
    spun = _spun_up(lambda t: 1.0, lambda omega: drag * omega**2, 10.0)
    assert max(state.omega for state in spun) < 1.01 * wanted
    assert spun[-1].omega == pytest.approx(wanted, rel=1e-3)
    cut = _spun_up(lambda t: 0.0 if 10.0 < t < 13.0 else 1.0, lambda omega: drag * omega**2, 25.0)
    before, during, after = (cut[round(t / 0.002)] for t in (9.9, 12.9, 24.0))
    assert during.omega < 0.7 * before.omega
    assert during.governor == pytest.approx(before.governor, rel=0.02)
    assert max(state.omega for state in cut) < 1.01 * wanted
    assert after.omega == pytest.approx(wanted, rel=1e-3)


def test_a_flight_far_out_of_reach_still_names_the_limit() -> None:
    """Where Newton's method finds no way from hover in one go, it walks: the limit that stops it is known."""
    with pytest.raises(TrimError, match=r"60 m/s ahead.* needs theta0 = 61.2 deg, but its limit is 15.0 deg"):
        trim(RAPTOR, speed=60.0)


@pytest.mark.proof
def test_a_flight_that_nothing_reaches_says_how_far_it_got() -> None:
    with pytest.raises(TrimError, match=r"1000 m/s ahead.* is out of reach: [0-9]+% of the way there needs theta0 = "):
        trim(RAPTOR, speed=1000.0)
