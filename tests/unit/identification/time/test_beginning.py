"""Where a filter begins, and how that moves with its numbers."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.arrays import Array
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import stochastic_model
from swashplate.filtering.nuisance import Nuisance
from swashplate.filtering.riccati import steady_gain
from swashplate.identification.core.records import POSE
from swashplate.identification.time.beginning import (
    Begun,
    FilterNumbers,
    FirstMotion,
    begun,
    begun_moved,
    joined_at,
    steady_rows,
)
from swashplate.models.catalogue import vehicle as load_vehicle
from swashplate.simulation.trim import trim


def _seen(velocity: tuple[float, float, float]) -> FirstMotion:
    value = np.array([0.1, -0.2, -10.0, 0.01, -0.02, 0.3])
    rate = np.array([velocity[0], velocity[1], velocity[2], 0.02, 0.01, -0.03])
    return FirstMotion(value, rate, np.array(velocity), np.array([12.1, 12.0]))


def _numbers(name: str) -> tuple[FilterNumbers, FilterNumbers]:
    """Numbers of a vehicle's filter, and a direction in which all of them move a little."""
    vehicle = load_vehicle(name)
    inputs = np.array([0.5 * (low + high) for low, high in vehicle.input_limits])
    nuisance = np.array(Nuisance(lever_x=0.02, lever_z=-0.1, level_psi=0.05), dtype=np.float64)
    at = FilterNumbers(*(np.array(row, dtype=np.float64) for row in (vehicle.values(), Noise(), nuisance, inputs)))
    draw = np.random.default_rng(1)
    # Each by its own size: a noise of zero is one that is not there, and no direction leads out of that.
    return at, FilterNumbers(*(1e-2 * draw.standard_normal(row.shape) * row for row in at))


def test_where_nothing_settles_the_gain_is_not_a_number() -> None:
    vehicle = load_vehicle("coax")
    at, _ = _numbers("coax")
    lost = at._replace(parameters=np.where(np.array(vehicle.parameter_names) == "mass", np.nan, at.parameters))
    found = begun(stochastic_model(vehicle, POSE, 0.01), lost, _seen((0.0, 0.0, 0.0)))
    assert np.isnan(found.gain.state).all()


_LINE = Noise(line_hertz=34.4, line_angle=1.4e-3, line_height=2e-4, line_time=0.2)


def _hover(noise: Noise) -> tuple[Array, Array, Array, Array]:
    at, _ = _numbers("coax")
    rows = FilterNumbers(*(row[None] for row in at._replace(noise=np.array(noise, dtype=np.float64))))
    model = stochastic_model(load_vehicle("coax"), POSE, 0.01, noise=noise)
    A, C, Q, R = (part[0] for part in joined_at(model, rows, _seen((0.0, 0.0, 0.0))))
    return A, C, Q, R


def test_a_rotors_line_turns_at_its_frequency_and_keeps_its_size() -> None:
    A, C, Q, _ = _hover(_LINE)
    line = slice(len(A) - 4, None)
    turn, size = A[line, line], np.diag([1.4e-3, 1.4e-3, 2e-4, 2e-4]) ** 2
    np.testing.assert_allclose(turn @ size @ turn.T + Q[line, line], size, atol=1e-18)
    roll_and_pitch = (np.linalg.matrix_power(turn, 7) @ [1.0, 0.0, 0.0, 0.0])[:2]
    wanted = np.exp(2j * np.pi * 34.4 * 0.07 - 0.07 / 0.2)  # a rotor that turns clockwise: roll + i pitch
    np.testing.assert_allclose(C[3:5, line] @ [*roll_and_pitch, 0.0, 0.0], [wanted.real, wanted.imag], atol=1e-12)
    backwards, _, _, _ = _hover(_LINE._replace(line_hertz=-34.4))
    np.testing.assert_allclose(backwards[line, line], turn.T, atol=1e-15)


def test_a_filter_that_knows_of_the_line_has_white_innovations_and_one_that_does_not_has_not() -> None:
    """Twenty seconds of the linear system with a line, through the gain with it and through that of its white like."""
    A, C, Q, R = _hover(_LINE)
    rng = np.random.default_rng(1)
    roots = [np.diag(np.sqrt(np.diag(part))) for part in (R,)] + [np.linalg.cholesky(Q + 1e-18 * np.eye(len(Q)))]
    x, seen = np.zeros(len(A)), []
    for _ in range(2000):
        seen.append(C @ x + roots[0] @ rng.standard_normal(len(R)))
        x = A @ x + roots[1] @ rng.standard_normal(len(A))
    white = Noise(sensor_angle=float(np.hypot(Noise().sensor_angle, _LINE.line_angle)), sensor_position=3.6e-4)

    def related(matrices: tuple[Array, Array, Array, Array]) -> Array:
        """Correlation with what came three samples before, by channel: 34.4 Hz is nearly a third of 100 Hz."""
        A, C, _, _ = matrices
        K, _, _ = steady_gain(*matrices)
        x, errors = np.zeros(len(A)), []
        for y in seen:
            errors.append(y - C @ x)
            x = A @ (x + K @ errors[-1])
        e = np.array(errors)[200:]
        return np.asarray(np.sum(e[3:] * e[:-3], axis=0) / np.sum(e**2, axis=0))

    knows, does_not = related((A, C, Q, R)), related(_hover(white))
    assert np.abs(knows).max() < 3.0 / np.sqrt(1800.0)
    assert np.all(does_not[[2, 3, 4]] > 0.2)  # z, phi, theta


@pytest.mark.parametrize(("name", "speed"), [("coax", 0.0), ("crazyflie", 0.0), ("raptor50", 0.0), ("raptor50", 10.0)])
def test_slopes_of_the_beginning_are_those_of_beginnings(name: str, speed: float) -> None:
    """Closed forms, and one step of Newton's method beside the row for the rest."""
    model = stochastic_model(load_vehicle(name), POSE, 0.01)
    (at, to), seen = _numbers(name), _seen((speed, 0.0, 0.0))
    found, step = begun_moved(model, at, seen, FilterNumbers(*(row[None] for row in to))), 1e-3
    one, back, two, far_back = (
        begun(model, FilterNumbers(*(a + factor * step * b for a, b in zip(at, to, strict=True))), seen)
        for factor in (1.0, -1.0, 2.0, -2.0)
    )
    for moved, *sides in zip(*(_parts(each) for each in (found, one, back, two, far_back)), strict=True):
        slope = (8.0 * (sides[0] - sides[1]) - (sides[2] - sides[3])) / (12.0 * step)
        np.testing.assert_allclose(moved[0], slope, rtol=1e-6, atol=1e-6 * np.abs(slope).max())


@pytest.mark.parametrize(("speed", "climb"), [(0.0, 0.0), (10.0, -0.5)])
def test_a_helicopter_is_linearised_about_its_trim(speed: float, climb: float) -> None:
    model = stochastic_model(raptor := load_vehicle("raptor50"), POSE, 0.01)
    flown = trim(raptor, speed=speed, climb=climb, voltage=12.0)
    at = FilterNumbers(*(np.array([row], dtype=np.float64) for row in (raptor.values(), Noise(), Nuisance(), [0.0])))
    found, _ = steady_rows(model, at.parameters, 12.0, np.array([speed, 0.0, -climb]))
    np.testing.assert_allclose(found[0], flown.state, atol=1e-10)


def _parts(begin: Begun) -> list[np.ndarray]:
    return [part for part in (*begin.gain, begin.x) if isinstance(part, np.ndarray)]
