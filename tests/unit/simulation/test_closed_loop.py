"""The hover hold, maneuvers flown under it, and what sensors make of them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from swashplate.control.laws.hold import hover_hold
from swashplate.errors import SwashError
from swashplate.models.catalogue import vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.closed_loop import simulate_closed_loop, simulate_maneuver
from swashplate.simulation.linearize import linearize
from swashplate.simulation.sensors import QUIET, InertialUnit, MotionCapture, Sensors, observe, specific_forces
from swashplate.simulation.trim import trim


@pytest.fixture(scope="module")
def coax() -> Vehicle:
    return vehicle("coax")


def test_the_hold_comes_back_to_place_height_and_heading(coax: Vehicle) -> None:
    controller = hover_hold(coax, trim(coax))
    start = {"x": 1.0, "z": -1.0, "phi": 0.1, "psi": 0.5}
    flight = simulate_closed_loop(
        coax, controller, duration=60.0, start=start, reference={"x": 0.0, "z": -2.0, "psi": 0.0}
    )
    end = flight.between(50.0, 60.0)
    for name, wanted, width in (("x", 0.0, 0.05), ("y", 0.0, 0.05), ("z", -2.0, 0.01), ("psi", 0.0, 0.01)):
        np.testing.assert_allclose(end.values(name), wanted, atol=width)


def test_a_sweep_stays_in_the_room_while_the_battery_empties(coax: Vehicle) -> None:
    flight = simulate_maneuver(coax, "sweep:pitch,0.5-8Hz,60s", controller=hover_hold, sag=0.01)
    assert flight.duration == pytest.approx(66.0)
    for name, width in (("x", 0.5), ("y", 0.5), ("z", 0.1), ("psi", 0.1)):
        assert np.max(np.abs(flight.values(name))) < width
    assert np.max(np.abs(flight.values("q"))) > 0.5
    assert flight.values("voltage")[-1] == pytest.approx(12.22 - 0.66)


def test_a_rate_that_is_no_multiple_of_the_controllers_is_refused(coax: Vehicle) -> None:
    with pytest.raises(SwashError, match=r"multiple of the controller's 30 Hz\. Give 90 Hz"):
        simulate_closed_loop(coax, hover_hold(coax, trim(coax), rate=30.0), duration=1.0)


def test_the_controller_runs_at_its_own_rate(coax: Vehicle) -> None:
    controller = hover_hold(coax, trim(coax), rate=25.0)
    flight = simulate_closed_loop(coax, controller, duration=3.0, start={"phi": 0.1})
    command = flight.values("servo_roll")
    changes = np.flatnonzero(np.diff(command)) + 1
    assert changes.size > 60
    assert np.all(changes % 4 == 0)


def test_motion_capture_has_the_faults_of_a_real_log(coax: Vehicle) -> None:
    flight = simulate_maneuver(coax, "sweep:roll,0.5-8Hz,40s", controller=hover_hold)
    log = observe(flight, coax, seed=1)
    assert set(log.streams) == {"motion", "inputs", "battery"}
    time, q = log.time("x"), log.array(("qw", "qx", "qy", "qz"))
    steps = np.diff(time)
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, atol=1e-12)
    assert steps.max() > 3.0 / 200.0  # gaps
    assert steps.std() > 1e-5  # jitter
    assert np.sum(np.sum(q[1:] * q[:-1], axis=1) < -0.9) >= 1  # sign flips
    apart = np.abs(log.values("x") - np.interp(time, flight.time("x"), flight.values("x")))
    assert np.sum(apart > 0.02) >= 1  # outliers
    assert np.median(apart) == pytest.approx(0.6745 * MotionCapture().position_noise, rel=0.1)
    quiet = observe(flight, coax, sensors=QUIET, seed=1)
    x, y, z, w = (quiet.values(name) for name in ("qx", "qy", "qz", "qw"))
    _, _, roll = Rotation.from_quat(np.stack([x, y, z, w], axis=1)).as_euler("ZYX").T
    error = roll - np.interp(quiet.time("qw"), flight.time("phi"), flight.values("phi"))
    assert error.std() == pytest.approx(MotionCapture().attitude_noise, rel=0.1)


def test_accelerometers_feel_gravity_in_hover_and_thrust_loss_in_descent(coax: Vehicle) -> None:
    flight = simulate_closed_loop(coax, hover_hold(coax, trim(coax)), duration=3.0, reference={"z": 0.5})
    force = specific_forces(flight, coax)
    np.testing.assert_allclose(force[0], [0.0, 0.0, -9.81], atol=1e-9)
    # In level flight wdot = az + g.
    w = flight.values("w")
    np.testing.assert_allclose(np.gradient(w, 0.01)[5:-5], force[5:-5, 2] + 9.81, atol=0.02)
    imu = observe(flight, coax, sensors=Sensors(motion=None, imu=InertialUnit()), seed=0)
    assert set(imu.streams) == {"imu", "inputs", "battery"}
    assert imu.values("az").mean() == pytest.approx(force[:, 2].mean(), abs=0.3)


def test_the_linear_model_predicts_a_small_flight(coax: Vehicle) -> None:
    model = linearize(coax)
    state_space = model.to_control()
    assert state_space.state_labels == list(coax.state_names)
    import control

    time = np.arange(101) / 100.0
    inputs = np.zeros((4, time.size))
    inputs[2] = 1e-5
    response = control.forced_response(state_space, time, inputs)
    flight = simulate_small(coax, inputs)
    phi = coax.index("phi")
    np.testing.assert_allclose(flight, response.states[phi], atol=1e-4 * np.max(np.abs(response.states[phi])))


def simulate_small(coax: Vehicle, inputs: np.ndarray) -> np.ndarray:
    from swashplate.simulation.integrate import simulate_open_loop

    return simulate_open_loop(coax, trim(coax).inputs + inputs.T, substeps=2).values("phi")


def test_a_maneuver_beyond_half_the_sample_rate_is_refused(coax: Vehicle) -> None:
    """It would fold back: 80 Hz sampled at 100 Hz flies as 20 Hz."""
    with pytest.raises(SwashError, match=r"100 samples a second hold no more than 50 Hz.*--rate 2000"):
        simulate_maneuver(coax, "sweep:pitch,0.5-80Hz,60s", controller=hover_hold)
