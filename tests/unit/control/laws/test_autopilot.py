"""The autopilot on the nonlinear CoaX: the paper's Fig. 10, height, heading, battery, limits, trim, place and speed."""

from __future__ import annotations

import math

import numpy as np
import pytest

from swashplate.control.analysis.stability import loop_modes
from swashplate.control.analysis.straightness import step_paths
from swashplate.control.laws.autopilot import Autopilot, Memory, Reference, autopilot, step, unpack
from swashplate.control.laws.height_yaw import (
    HeightYawGains,
    HeightYawMemory,
    coaxial_rotors,
    motors_for,
    thrust_and_torque,
)
from swashplate.errors import ControllerError, SwashError
from swashplate.flights.flight import Flight
from swashplate.models.catalogue import vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.closed_loop import simulate_closed_loop
from swashplate.simulation.trim import Trim, trim

RATE = 500.0


@pytest.fixture(scope="module")
def coax() -> Vehicle:
    return vehicle("coax")


@pytest.fixture(scope="module")
def hover(coax: Vehicle) -> Trim:
    return trim(coax)


def six_metres(coax: Vehicle, controller: Autopilot, *, command: float = 0.20) -> Flight:
    """The paper's Fig. 10: a step of the pitch command from hover, until 6 m are flown."""
    flight = simulate_closed_loop(coax, controller, duration=7.0, reference={"pitch": command}, rate=RATE)
    far = np.flatnonzero(np.hypot(flight.values("x"), flight.values("y")) >= 6.0)
    return flight.between(0.0, float(flight.time("x")[far[0]]))


def test_figure_10(coax: Vehicle, hover: Trim) -> None:
    """Numbers of an independent calculation: 1.80 m/s and y from +0.69 to -0.80 m without, 0.65 m straight with it."""
    without = six_metres(coax, autopilot(coax, hover, mode="manual", decoupled=False))
    y = without.values("y")
    assert without.values("u").max() == pytest.approx(1.80, abs=0.01)
    assert y.max() == pytest.approx(0.69, abs=0.05)  # to the right first,
    assert y[-1] == pytest.approx(-0.80, abs=0.08)  # then to the left
    assert np.argmax(y) < 0.7 * y.size

    by_law = six_metres(coax, autopilot(coax, hover, mode="manual"))
    x, y = by_law.values("x"), by_law.values("y")
    # What remains is a straight line off by the bar's own misalignment, D_up = 6.4 deg.
    assert math.degrees(math.atan2(y[-1], x[-1])) == pytest.approx(6.4, abs=0.3)
    assert np.max(np.abs(y - x * y[-1] / x[-1])) < 0.05

    constant = six_metres(coax, autopilot(coax, hover, mode="manual", lag=math.radians(20.0)))
    assert abs(constant.values("y")[-1]) < 0.15
    assert np.max(np.abs(constant.values("y"))) < 0.15
    for flight in (without, by_law, constant):
        assert np.max(np.abs(flight.values("z"))) < 0.01
        assert math.degrees(np.max(np.abs(flight.values("psi")))) < 1.1


@pytest.mark.proof
def test_a_law_wrong_by_three_degrees(coax: Vehicle) -> None:
    """An independent calculation without the bar's misalignment: +0.78 m and -0.74 m at 6 m for a lag 3 deg off."""
    aligned = coax.with_values({"k_zeta_upper": 0.0, "o_zeta_upper": 0.0})
    hover = trim(aligned)
    controller = autopilot(aligned, hover, mode="manual")
    lag = coax.card.values()["o_zeta_lower"] + np.radians([-3.0, 0.0, 3.0])
    paths = step_paths(aligned, controller, hover, command=0.2, duration=7.0, size=3, parameters={"o_zeta_lower": lag})
    np.testing.assert_allclose(paths.drift, [-0.74, 0.0, 0.78], atol=0.06)
    assert paths.drift[1] == pytest.approx(six_metres(aligned, controller).values("y")[-1], abs=0.005)
    with pytest.raises(ControllerError, match="no flight covers 6 m in 1 s"):
        step_paths(coax, controller, hover, command=0.2, duration=1.0)


def test_a_bar_without_misalignment_leaves_no_drift(coax: Vehicle) -> None:
    aligned = coax.with_values({"k_zeta_upper": 0.0, "o_zeta_upper": 0.0})
    flight = six_metres(aligned, autopilot(aligned, trim(aligned), mode="manual"))
    # The residue is the drive train's: D follows the command, the rotor follows 0.115 s later.
    assert np.max(np.abs(flight.values("y"))) < 0.02


def test_printed_law_on_a_rotation_steers_wrong(coax: Vehicle, hover: Trim) -> None:
    flight = six_metres(coax, autopilot(coax, hover, mode="manual", mixing="as_printed"), command=0.25)
    assert abs(flight.values("y")[-1]) > 3.0


def test_the_thrust_lost_to_lean_is_given_back(coax: Vehicle, hover: Trim) -> None:
    """A nod to 20 deg and back by the pilot's command: height lost with and without the feed-forward."""
    time = np.arange(round(3.0 * RATE) + 1) / RATE
    nod = np.select([time < 0.5, time < 1.1, time < 1.7], [0.0, 0.57, -0.57], 0.0)
    lost = {}
    for feedforward in (0.0, 1.0):
        controller = autopilot(coax, hover, mode="manual").with_gains(tilt_feedforward=feedforward)
        flight = simulate_closed_loop(coax, controller, duration=3.0, reference={"pitch": nod}, rate=RATE)
        assert math.degrees(np.min(flight.values("theta"))) == pytest.approx(-20.0, abs=1.5)
        lost[feedforward] = float(np.max(flight.values("z")))
    assert lost[1.0] < 0.5 * lost[0.0], lost


def test_the_bars_oscillation_grows_by_itself_and_is_damped_by_the_loops(coax: Vehicle, hover: Trim) -> None:
    """Coupling effect 2: the misaligned bar circles at 1.6 Hz (+0.247 +- 9.99j)."""
    alone = loop_modes(coax, autopilot(coax, hover, mode="manual"), hover)
    assert alone[0].real == pytest.approx(0.247, abs=0.002)
    assert abs(alone[0].imag) == pytest.approx(9.99, abs=0.01)
    held = loop_modes(coax, autopilot(coax, hover), hover)
    assert held[0].real < -0.15
    bar = held[np.abs(np.abs(held.imag) - 12.0) < 4.0]
    assert bar.size
    assert np.all(bar.real < -0.2)


def test_motors_are_the_inverse_of_rotors_and_drive_trains(coax: Vehicle, hover: Trim) -> None:
    xp, rotors = FloatBackend(), coaxial_rotors(coax, gravity=9.81)
    motors = motors_for(3.1, 0.002, 11.4, rotors, xp)
    np.testing.assert_allclose(thrust_and_torque(motors, 11.4, rotors, xp), (3.1, 0.002), rtol=1e-12)
    held = motors_for(rotors.weight, 0.0, 12.22, rotors, xp)
    np.testing.assert_allclose(held, hover.inputs[:2], rtol=1e-9)  # the trim was found by Newton's method


def test_a_falling_battery_is_compensated(coax: Vehicle, hover: Trim) -> None:
    time = np.arange(round(10.0 * RATE) + 1) / RATE
    voltage = 12.5 - 2.0 / (1.0 + np.exp(-4.0 * (time - 4.0)))  # 12.5 to 10.5 V in about a second
    lost = []
    for battery in (True, False):
        controller = autopilot(coax, hover, battery=battery)
        start = trim(coax, voltage=12.5)
        flight = simulate_closed_loop(coax, controller, duration=10.0, voltage=voltage, start=start, rate=RATE)
        lost.append(np.max(np.abs(flight.values("z") - flight.values("z")[0])))
    assert lost[0] < 0.02
    assert lost[1] > 10.0 * lost[0]


def test_saturated_motors_do_not_wind_up(coax: Vehicle, hover: Trim) -> None:
    """A climb of 20 m saturates the thrust for seconds; the overshoot is that of an unsaturated step."""
    controller = autopilot(coax, hover)
    small = simulate_closed_loop(coax, controller, duration=30.0, reference={"z": -1.0}, rate=RATE)
    large = simulate_closed_loop(coax, controller, duration=30.0, reference={"z": -20.0}, rate=RATE)
    assert np.max(large.values("motor_upper")) > 1.15 * hover.commands()["motor_upper"]
    overshoot = [-np.min(f.values("z")) - wanted for f, wanted in ((small, 1.0), (large, 20.0))]
    assert overshoot[1] < 20.0 * overshoot[0]
    np.testing.assert_allclose(large.values("z")[-1], -20.0, atol=0.05)


def test_place_heading_height_and_speed_are_held(coax: Vehicle, hover: Trim) -> None:
    wanted = {"x": 1.0, "y": -0.5, "z": -1.0, "psi": 1.0}
    flight = simulate_closed_loop(coax, autopilot(coax, hover), duration=30.0, reference=wanted, rate=RATE)
    for name, value in wanted.items():
        np.testing.assert_allclose(flight.between(25.0, 30.0).values(name), value, atol=0.01)
    fast = autopilot(coax, hover, mode="speed")
    flight = simulate_closed_loop(coax, fast, duration=30.0, reference={"ahead": 1.0, "right": -0.5}, rate=RATE)
    np.testing.assert_allclose(flight.between(25.0, 30.0).values("u"), 1.0, atol=0.02)
    np.testing.assert_allclose(flight.between(25.0, 30.0).values("v"), -0.5, atol=0.02)


def test_a_soft_start_raises_the_motors_slowly_and_winds_nothing_up(coax: Vehicle, hover: Trim) -> None:
    controller = autopilot(coax, hover, motors=HeightYawGains(soft_start=0.5))
    gains, xp = unpack(controller.gains), FloatBackend()
    memory = Memory(HeightYawMemory(*controller.memory[:3]), 0.0, 0.0)
    standing, wanted = RigidBody(*(0.0,) * 12), Reference(0.0, 0.0, -1.0, 0.5, 0.0, 0.0, 0.0, 0.0)
    lower = []
    for _ in range(150):
        memory, commands = step(memory, standing, 12.22, wanted, gains, xp)
        lower.append(commands.motor_lower)
    assert lower[0] == pytest.approx(0.005)
    assert np.max(np.diff(lower)) < 0.005 + 1e-12
    assert memory.motors.height == memory.motors.heading == memory.ahead == 0.0
    assert lower[-1] > hover.commands()["motor_lower"]


def test_bad_input_is_named(coax: Vehicle, hover: Trim) -> None:
    with pytest.raises(SwashError, match="mode: is 'acro', expected manual, speed, place"):
        autopilot(coax, hover, mode="acro")  # type: ignore[arg-type]
    with pytest.raises(SwashError, match="not a gain of the autopilot: leen"):
        autopilot(coax, hover).with_gains(leen=1.0)
