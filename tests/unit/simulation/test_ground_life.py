"""Life on the ground: flapping settles at every rotor speed, what is parked stands still, and it flies afterwards."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

import swashplate as sp
from heli_autopilot import EKF_WAIT, Gains, HeliAutopilot
from link_bench import QUICK, bench
from swashplate.control.analysis.cascade_gains import cascade_gains
from swashplate.links.ardupilot.gains import ASSUMED_DELAY, ardupilot_law
from swashplate.links.plant import Plant, Surroundings
from swashplate.links.servos import servo_mapping
from swashplate.models.card import packaged_cards
from swashplate.models.catalogue import vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.physics import flapping, inflow
from swashplate.physics.backend import FloatBackend
from swashplate.physics.blade_element import FlapMoments
from swashplate.physics.environment import Environment
from swashplate.physics.inflow import Inflow
from swashplate.simulation.standing import at_rest, skids_of, standing
from swashplate.simulation.stepping import MakeEngine, Motion, Stepping

XP = FloatBackend()
HELICOPTERS = [name for name, card in packaged_cards().items() if card.vehicle == "conventional"]
assert HELICOPTERS, "else nothing is tried"
SPEEDS = (0.0, 0.02, 0.05, 0.09, 0.12, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0)
"""Rotor speeds over the governed one."""


def slowest_flapping(made: Vehicle, *, wind: float = 0.0) -> float:
    """The largest real part [1/s] of the tip-path plane's eigenvalues over rotor speeds, pitch and cyclic."""
    around, par = Environment(wind, 0.3 * wind, 0.0), made.values()
    disc = [made.index("a1"), made.index("b1")]
    low, high = np.array(made.input_limits).T
    random, worst = np.random.default_rng(0), -math.inf
    parked = at_rest(made, around)
    for speed in SPEEDS:
        parked[made.index("omega")] = speed * par.rotor_speed
        for share in (0.5, 0.0, *random.random((3, len(low)))):
            inputs = low + share * (high - low)

            def rates(tilt: np.ndarray, inputs: np.ndarray = inputs) -> np.ndarray:
                row = parked.copy()
                row[disc] = tilt
                return np.array(made.rates(row, inputs, par, around, XP))[disc]

            columns = [(rates(step) - rates(-step)) / 2e-5 for step in 1e-5 * np.eye(2)]
            worst = max(worst, float(np.linalg.eigvals(np.stack(columns, axis=1)).real.max()))
    return worst


@pytest.mark.parametrize("name", HELICOPTERS)
def test_flapping_settles_at_every_rotor_speed(name: str) -> None:
    made = standing(vehicle(name))
    assert slowest_flapping(made) < -3.0
    assert slowest_flapping(made, wind=5.0) < -3.0


def test_flapping_diverges_where_the_wake_keeps_up_with_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    """What this contract is for: with K_R = 1.5 in force at rest, a tilt grows by e in 1.3 s."""
    monkeypatch.setattr(flapping, "wake_follows", lambda excess, v2, xp: 1.0)
    assert slowest_flapping(standing(vehicle("raptor50"))) == pytest.approx(0.7913, abs=1e-3)


@pytest.mark.parametrize("name", HELICOPTERS)
def test_the_wake_keeps_up_in_flight_exactly(name: str) -> None:
    """From hover's thrust down to a seventh of it, where V is 0.38 of hover's; no wake, no distortion."""
    par = vehicle(name).values()
    held = flapping.hinge(
        blade_inertia=par.blade_inertia,
        blades=par.rotor_blades,
        hub_stiffness=par.hub_stiffness,
        hinge_offset=par.hinge_offset,
        omega=par.rotor_speed,
        density=1.225,
        lift_slope=par.rotor_lift_slope,
        chord=par.rotor_chord,
        radius=par.rotor_radius,
    )
    loading = par.mass * 9.81 / (2.0 * 1.225 * math.pi * par.rotor_radius**2)
    hover2 = loading / (par.rotor_speed * par.rotor_radius) ** 2
    assert flapping.wake_follows(held.excess, hover2 / 7.0, XP) == 1.0
    assert flapping.wake_follows(held.excess, 1e-16, XP) < 1e-9


@pytest.mark.parametrize("excess", [0.1, 3.0, 6.0, 20.0])
@pytest.mark.parametrize("lam0", [0.03, 0.06])
def test_the_wake_falls_behind_as_dynamic_inflow_does(excess: float, lam0: float) -> None:
    """In phase with a disc turning at excess / 2: Pitt and Peters' own equation, against the quasi-static share."""

    def change(lam_c: float, q: float) -> float:
        return inflow.pitt_peters_rates(
            Inflow(lam0, lam_c, 0.0),
            2.0 * lam0 * lam0,
            FlapMoments(0.0, 0.0, 0.0),
            (0.0, q),
            (0.0, 0.0),
            (lam0, 2.0 * lam0),
            wake_distortion=1.0,
            solidity=0.05,
            lift_slope=5.5,
        ).lam_c

    decay, drive = -change(1.0, 0.0), change(0.0, 1.0)
    in_phase = (drive / (decay + 0.5j * excess)).real
    k2 = flapping.wake_lateness(excess, lam0 * lam0)
    assert in_phase == pytest.approx(1.0 / (1.0 + k2), rel=1e-12)
    share = flapping.wake_follows(excess, lam0 * lam0, XP)
    # Slow discs: what dynamic inflow loses is part of a card's K_R. Quick ones: both fall like 1 / k^2.
    assert share == 1.0 if k2 < 1.0 else share == pytest.approx(1.0 / k2, rel=0.45)
    assert share == pytest.approx(in_phase, abs=0.05) or k2 < 9.0


def parked(name: str, seconds: float, *, wind: float, engine: MakeEngine | None = None) -> np.ndarray:
    """State rows, two a second, of a vehicle with stopped rotors and servos stirred at random."""
    made, around = standing(vehicle(name)), Environment(wind, 0.5 * wind, 0.0)
    low, high = np.array(made.input_limits).T
    motors = [k for k, each in enumerate(made.input_names) if each.startswith(("motor", "throttle"))]
    assert motors
    stepping = Stepping(made, at_rest(made, around), around, engine=engine)
    random, rows = np.random.default_rng(1), []
    for _ in range(round(10.0 * seconds)):
        inputs = random.uniform(low, high)
        inputs[motors] = 0.0
        rows.append(stepping.advance(inputs, 0.1).states)
    return np.array(rows[4::5])


def stands(rows: np.ndarray, name: str) -> None:
    made = standing(vehicle(name))
    body = rows[:, :12]
    settled = body[2 * len(body) // 3 :]
    assert np.ptp(settled[:, :3], axis=0).max() < 1e-5, "it creeps"
    assert np.ptp(settled[:, 6:9], axis=0).max() < 1e-4, "it turns"
    # Half of what would lift a skid end, which is much for 27 g on assumed skids, and hardly anything for a card's own.
    skids = skids_of(made)
    lifts = made.card.values()["mass"] * 9.81 / (4.0 * skids.stiffness) / min(skids.half_width, skids.half_length)
    assert np.abs(body[:, 6:9]).max() < max(math.radians(1.0), 0.5 * lifts)
    tilts = [k for k, each in enumerate(made.state_names) if each in ("a1", "b1", "alpha_lower", "beta_lower")]
    assert np.abs(rows[:, tilts]).max(initial=0.0) < math.radians(6.0)


@pytest.mark.proof
@pytest.mark.parametrize("name", ["raptor50", "helion", "xcell60", "coax"])
def test_what_is_parked_stands_still(name: str) -> None:
    """As XLA compiles it; the quick form is the same by C, below."""
    stands(parked(name, 6.0, wind=3.0), name)


@pytest.mark.proof
@pytest.mark.parametrize("wind", [0.0, 5.0])
@pytest.mark.parametrize("name", packaged_cards())
def test_what_is_parked_stands_still_for_two_minutes(name: str, wind: float) -> None:
    stands(parked(name, 120.0, wind=wind), name)


def lived(pilot: HeliAutopilot, *, hover: float, expected: float | None) -> None:
    """Run-up, lift-off, hover, landing, and the rotor stopped again."""
    assert pilot.arm() == ""
    pilot.interlock = True
    first = len(pilot.answers)
    pilot.fly(9.0)
    headings = np.unwrap([answer["attitude"][2] for answer in pilot.answers[first:]])
    turned = math.degrees(np.ptp(headings))
    assert turned < 2.0 if expected is None else turned == pytest.approx(expected, abs=0.1)
    pilot.height, pilot._lift = 2.0, 0.5
    hovering = pilot.fly(hover)
    assert hovering["position"][2] == pytest.approx(-2.0, abs=0.4)
    pilot.height = 0.01
    pilot.fly(4.0)
    pilot.height, pilot.armed, pilot.interlock = 0.0, False, False
    down = pilot.fly(12.0)
    assert down["position"][2] == pytest.approx(0.0, abs=0.02)
    assert max(map(abs, down["attitude"][:2])) < math.radians(2.0)


def test_the_firmware_refuses_until_its_ekf_is_ready() -> None:
    pilot = HeliAutopilot(bench("raptor50", engine=QUICK).send, rate=100)
    pilot.ekf.begun = 15.0 - EKF_WAIT  # aligned after 15 s: its other checks take 12
    pilot.fly(1.0)
    assert pilot.arm() == "Gyros still settling"
    pilot.fly(13.0)
    assert pilot.arm() == "Need Position Estimate"
    pilot.fly(2.0)
    pilot.interlock = True
    assert pilot.arm() == "Motor Interlock Enabled"
    pilot.interlock = False
    assert pilot.arm() == ""


def test_an_ekf_on_ground_that_shakes_never_settles() -> None:
    shaken = bench("raptor50", engine=QUICK)

    def send(data: bytes) -> bytes | None:
        answer = shaken.send(data)
        return answer and re.sub(rb'"gyro":\[[^,]*', b'"gyro":[0.05', answer)

    pilot = HeliAutopilot(send, rate=100)
    with pytest.raises(AssertionError, match="does not settle in 5 s: Gyros still settling"):
        pilot.wait_for_ekf(5.0)


@pytest.mark.proof
@pytest.mark.parametrize(("name", "rounds"), [("raptor50", 2), ("raptor50", 3), ("helion", 3), ("xcell60", 3)])
def test_a_helicopter_lives_on_the_ground_and_flies(name: str, rounds: int) -> None:
    """From a cold start, as long as the EKF takes, and again after a landing while the rotor runs down."""
    at = bench(name, engine=QUICK)
    pilot = HeliAutopilot(at.send, rate=200, gains=written_gains(name))
    for round_ in range(rounds):
        assert round_ > 0 or pilot.arm() != ""
        if round_ == 0:
            pilot.wait_for_ekf(seed=round_)
        random = np.random.default_rng(round_)
        for _ in range(240 if rounds > 2 else 20):  # 120 s
            pilot.sticks = tuple(random.uniform((-1.0, -1.0, -1.0, 0.0), 1.0).tolist())
            parked_still = pilot.fly(0.5)
        pilot.sticks = (0.0, 0.0, 0.0, 0.0)
        assert parked_still["position"][2] == pytest.approx(0.0, abs=0.02)
        assert max(map(abs, parked_still["attitude"][:2])) < math.radians(2.0)
        pilot.place = (pilot.answers[-1]["position"][0], pilot.answers[-1]["position"][1])
        # From rest the how-to says how far; while the rotor still runs down there is less left to spin up.
        lived(pilot, hover=6.0, expected=1.35 if (name, round_) == ("raptor50", 0) else None)
    assert not at.plant.broken


def written_gains(name: str) -> Gains:
    """Those of `--write-parameters`."""
    free = vehicle(name, rotor_speed="throttle")
    hover = sp.trim(free)
    late = dict.fromkeys(free.input_names, ASSUMED_DELAY)
    found = cascade_gains(
        free, hover, ardupilot_law(servo_mapping(name, free), free, hover), delays=late
    ).law.parameters
    rows = {key: [found[f"ATC_RAT_{axis}_{key}"] for axis in ("RLL", "PIT", "YAW")] for key in ("FF", "P", "I")}
    angle = tuple(found[f"ATC_ANG_{axis}_P"] for axis in ("RLL", "PIT", "YAW"))
    kept = tuple(found[f"ATC_RAT_{axis}_ILMI"] for axis in ("RLL", "PIT"))
    return Gains(angle, tuple(rows["FF"]), tuple(rows["P"]), tuple(rows["I"]), kept)


@pytest.mark.parametrize("seconds", [4.0, pytest.param(120.0, marks=pytest.mark.proof)])
@pytest.mark.parametrize("which", ["ardupilot", "px4"])
def test_a_coaxial_lives_on_the_ground_and_hops(which: str, seconds: float) -> None:
    """Parked with its servos stirred, spooled up, off the ground, down, stopped, and again; at both links' rates."""
    made = standing(vehicle("coax"))
    mapping = servo_mapping("coax" if which == "ardupilot" else "coax_px4", made)
    plant = Plant(made, mapping, Surroundings(Environment()), engine=QUICK)
    (lower, upper), (roll, pitch) = mapping.motors, mapping.servos
    dt, random = 1.0 / (400.0 if which == "ardupilot" else 250.0), np.random.default_rng(2)

    def held(lift: float, tilt: tuple[float, float], duration: float) -> Motion:
        pulses = [0.0] * 16
        for servo, value in ((lower, 1000 + 1000 * lift), (upper, 1000 + 1000 * lift)):
            pulses[servo.channel - 1] = value
        for servo, value in zip((roll, pitch), tilt, strict=True):
            pulses[servo.channel - 1] = 1500 + 500 * value
        for _ in range(round(duration / dt)):
            moved = plant.advance(pulses, dt)
        return moved

    for _ in range(2):
        places = []
        for _ in range(round(2.0 * seconds)):
            moved = held(0.0, tuple(random.uniform(-1.0, 1.0, 2).tolist()), 0.5)
            places.append((*moved.body[:3], *moved.body[6:9]))
        assert np.ptp(np.array(places)[len(places) // 2 :], axis=0).max() < 1e-4, "it creeps"
        held(0.3, (0.0, 0.0), 2.0)
        top = held(0.6, (0.0, 0.0), 1.2)
        assert -top.body.z - plant.standing_depth > 0.05, "it does not lift off"
        down = held(0.45, (0.0, 0.0), 2.0)
        down = held(0.0, (0.0, 0.0), 3.0)
        assert not plant.broken
        assert down.body.z == pytest.approx(-plant.standing_depth, abs=0.005)


@pytest.mark.parametrize(
    "name",
    [name if name in ("raptor50", "coax") else pytest.param(name, marks=pytest.mark.proof)
     for name in (*HELICOPTERS, "coax")],
)  # fmt: skip
def test_exported_c_stands_still(name: str) -> None:
    """The C that links and exports share, 10 s on the ground at random servo positions."""
    rows = parked(name, 10.0, wind=3.0, engine=QUICK)
    stands(rows, name)
