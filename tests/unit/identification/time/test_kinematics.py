"""Velocities and rates from a pose: against motions whose truth is a formula, and against the equations' own start."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import stochastic_model
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.records import POSE, Record
from swashplate.identification.time.beginning import FilterNumbers, FirstMotion, starting_row, steady_rows
from swashplate.identification.time.kinematics import PREDICTED, measured_states
from swashplate.identification.time.start_states import mean_velocity, slopes
from swashplate.models.catalogue import vehicle
from swashplate.simulation.trim import trim

COAX = vehicle("coax")
LEVER = Nuisance(lever_x=0.05, lever_y=0.18, lever_z=-0.1, level_phi=0.02, level_theta=-0.03, level_psi=0.4)
RATE = 100.0


def _tumble(time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Position and rotation vector rates of a smooth three-axis motion: position, velocity, attitude, body rates.

    The attitude is a product of rotations about fixed axes, whose body rates add up by the chain rule.
    """
    position = np.stack([np.sin(time), 0.5 * np.cos(0.7 * time), -1.0 + 0.2 * np.sin(1.3 * time)], axis=1)
    velocity = np.stack([np.cos(time), -0.35 * np.sin(0.7 * time), 0.26 * np.cos(1.3 * time)], axis=1)
    angles = np.stack([0.5 * np.sin(0.9 * time), 0.3 * np.sin(1.1 * time), 0.4 * np.cos(0.8 * time)], axis=1)
    rates = np.stack([0.45 * np.cos(0.9 * time), 0.33 * np.cos(1.1 * time), -0.32 * np.sin(0.8 * time)], axis=1)
    turns = [Rotation.from_euler(axis, angles[:, i : i + 1]) for i, axis in enumerate("ZYX")]
    axes = np.eye(3)[::-1]
    omega = rates[:, 2:] * axes[2]
    omega = omega + turns[2].apply(rates[:, 1:2] * axes[1], inverse=True)
    omega = omega + (turns[1] * turns[2]).apply(rates[:, :1] * axes[0], inverse=True)
    return position, velocity, (turns[0] * turns[1] * turns[2]), omega  # type: ignore[return-value]


def _record(nuisance: Nuisance, seconds: float = 4.0) -> tuple[Record, np.ndarray]:
    """What is measured of that motion at a point off the centre of gravity, and the true body states."""
    time = np.arange(round(seconds * RATE) + 1) / RATE
    position, velocity, attitude, omega = _tumble(time)
    arm = np.array([float(getattr(nuisance, f"lever_{axis}")) for axis in "xyz"])
    euler = attitude.as_euler("ZYX")[:, ::-1]
    shown = (attitude * Rotation.from_euler("Z", float(nuisance.level_psi))).as_euler("ZYX")[:, ::-1]
    shown = shown + np.array([float(nuisance.level_phi), float(nuisance.level_theta), 0.0])
    outputs = np.concatenate([position + attitude.apply(arm), shown], axis=1)
    body = attitude.apply(velocity, inverse=True)
    inputs = np.tile(trim(COAX).inputs, (time.size, 1))
    record = Record("a", time, inputs, outputs, np.full(time.size, 12.0), POSE, True)
    return record, np.concatenate([position, body, euler, omega], axis=1)


@pytest.mark.parametrize("nuisance", [Nuisance(), LEVER])
def test_states_come_back_from_the_pose_of_any_point(nuisance: Nuisance) -> None:
    record, truth = _record(nuisance)
    found = measured_states(record, nuisance)
    inside = slice(10, -10)
    np.testing.assert_allclose(found[inside], truth[inside], atol=2e-4)


def test_a_lever_that_is_forgotten_shows_as_a_velocity() -> None:
    """omega x arm, in body axes: the sign of every lever component."""
    record, truth = _record(Nuisance(lever_x=0.05, lever_y=0.18, lever_z=-0.1))
    found = measured_states(record, Nuisance())
    expected = truth[:, 3:6] + np.cross(truth[:, 9:12], [0.05, 0.18, -0.1])
    np.testing.assert_allclose(found[10:-10, 3:6], expected[10:-10], atol=2e-4)


def _start(record: Record, place: int, nuisance: Nuisance, *, more: float = 0.0, voltage: float = 12.0) -> np.ndarray:
    """The state that a filter would begin with at a sample, one motor's command more or less."""
    value, rate = (part[0] for part in slopes(record, np.array([place])))
    inputs = record.inputs[place] + more * (np.array(COAX.input_names) == "motor_lower")
    numbers = (np.array(row, dtype=np.float64) for row in (COAX.values(), Noise(), nuisance, inputs))
    seen = FirstMotion(value, rate, np.zeros(3), np.array([voltage, voltage]))
    return starting_row(stochastic_model(COAX, POSE, record.dt), FilterNumbers(*numbers), seen)


@pytest.mark.parametrize("nuisance", [Nuisance(), LEVER])
def test_the_first_guess_of_the_equations_agrees(nuisance: Nuisance) -> None:
    """From slopes of the same pose to a flat state of the vehicle."""
    record, truth = _record(nuisance)
    place = 150
    x = _start(record, place, nuisance)
    found = x[[COAX.index(name) for name in PREDICTED]]
    np.testing.assert_allclose(found, truth[place], atol=8e-3)  # straight lines over 0.3 s of a curved motion
    assert x[COAX.index("eta_bar")] == pytest.approx(truth[place, 6], abs=2e-3)
    assert x[COAX.index("zeta_bar")] == pytest.approx(truth[place, 7], abs=2e-3)


@pytest.mark.parametrize("voltage", [11.1, 12.22])
def test_the_closed_form_of_hover_is_the_trim(voltage: float) -> None:
    found, row = trim(COAX, voltage=voltage), np.array([COAX.values()], dtype=np.float64)
    (x,), (u,) = steady_rows(stochastic_model(COAX, POSE, 0.01), row, voltage, np.zeros(3))
    np.testing.assert_allclose(u, found.inputs, atol=1e-9)
    speeds = [COAX.index("omega_lower"), COAX.index("omega_upper")]
    np.testing.assert_allclose(x[speeds], found.state[speeds], rtol=1e-9)
    assert np.abs(np.delete(x, speeds)).max() == 0.0


def test_the_first_guess_of_rotor_speeds_is_steady() -> None:
    """One percent of motor is 4.4 rad/s at the lower rotor, one volt 13.6 rad/s: the card's slopes."""
    record, _ = _record(Nuisance())

    def speed(more: float, voltage: float) -> float:
        return float(_start(record, 100, Nuisance(), more=more, voltage=voltage)[COAX.index("omega_lower")])

    card = COAX.card.values()
    assert speed(0.01, 12.0) - speed(0.0, 12.0) == pytest.approx(0.01 * card["k_drive_lower"])
    assert speed(0.0, 12.0) - speed(0.0, 11.0) == pytest.approx(card["k_drive_voltage"])


def test_slopes_are_those_of_a_straight_line_also_at_the_ends() -> None:
    record, _ = _record(Nuisance())
    line = np.outer(record.time, [1.0, -2.0, 0.5, 0.1, 0.2, 3.0]) + 1.0
    straight = Record("a", record.time, record.inputs, line, record.voltage, POSE, True)
    value, rate = slopes(straight, np.array([0, 200, 400]))
    np.testing.assert_allclose(value, line[[0, 200, 400]], atol=1e-12)
    np.testing.assert_allclose(rate, np.tile([1.0, -2.0, 0.5, 0.1, 0.2, 3.0], (3, 1)), atol=1e-12)


def test_a_filter_is_linearised_about_the_mean_flight_of_a_helicopter_that_is_fast() -> None:
    """Ahead and right of the heading, whatever that is; hover for what is slow, coaxial or cannot be flown steadily."""
    time = np.arange(0.0, 3.0, 0.01)

    def flying(velocity: tuple[float, float, float]) -> Record:
        rows = np.zeros((time.size, 6))
        rows[:, 5] = 0.9
        c, s = np.cos(0.9), np.sin(0.9)
        ahead, right, down = velocity
        rows[:, :3] = time[:, None] * [c * ahead - s * right, s * ahead + c * right, down]
        return Record("a", time, np.zeros((time.size, 4)), rows, np.full(time.size, 12.0), POSE, True)

    raptor = vehicle("raptor50")
    np.testing.assert_allclose(mean_velocity(raptor, flying((10.0, 1.0, -0.5))), (10.0, 1.0, -0.5), atol=1e-9)
    for flown, velocity in ((raptor, (2.0, 1.0, 0.0)), (raptor, (60.0, 0.0, 0.0)), (COAX, (10.0, 0.0, 0.0))):
        np.testing.assert_array_equal(mean_velocity(flown, flying(velocity)), np.zeros(3))
