"""The vehicle in disturbed air: its step, its sensors, its linearisation and its filter."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from swashplate.arrays import Array
from swashplate.filtering.disturbances import DISTURBED, Noise
from swashplate.filtering.disturbed_model import FilterState, StochasticModel, stochastic_model
from swashplate.filtering.filter_code import RecordSeries, driving_rows
from swashplate.filtering.nuisance import Nuisance
from swashplate.filtering.riccati import steady_gain
from swashplate.identification.core.records import POSE
from swashplate.identification.time.beginning import (
    Begun,
    FilterNumbers,
    FirstMotion,
    joined_at,
    numbers_and_constants,
)
from swashplate.identification.time.record_filter import record_filter
from swashplate.models.catalogue import vehicle
from swashplate.physics.backend import ArrayBackend, FloatBackend
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Euler, Vector, body_to_local
from swashplate.simulation.integrate import simulate_open_loop
from swashplate.simulation.trim import trim

COAX = vehicle("coax")
DT = 0.01
TILTED = Nuisance(lever_x=0.05, lever_y=0.18, lever_z=-0.1, level_phi=0.02, level_theta=-0.03, level_psi=0.4)
VOLTAGE = 12.0
STILL = FirstMotion(np.zeros(6), np.zeros(6), np.zeros(3), np.array([VOLTAGE, VOLTAGE]))


@lru_cache(maxsize=1)
def _model() -> StochasticModel:
    return stochastic_model(COAX, POSE, DT)


def _step(x: Array, push: Array, u: Array, model: StochasticModel | None = None) -> Array:
    """One sample of each row."""
    rows, push = np.atleast_2d(x), np.atleast_2d(push)
    size, numbers = len(rows), numbers_and_constants(COAX, np.array(COAX.values(), dtype=np.float64))
    gust, drift = np.broadcast_to(push, (size, push.shape[1])), np.zeros((size, 6))
    commands, voltage = np.broadcast_to(u, (size, len(u))), np.full(size, VOLTAGE)
    return record_filter(model or _model()).step(rows, gust, drift, commands, voltage, numbers).reshape(x.shape)


def _measured(x: Array, nuisance: Nuisance) -> Array:
    return np.asarray(_model().measure(x, nuisance, ArrayBackend()), dtype=np.float64)


@lru_cache(maxsize=1)
def _steady() -> tuple[Array, Array]:
    hover = trim(COAX, voltage=VOLTAGE)
    return np.array(hover.state), np.array(hover.inputs)


def _numbers(noise: Noise, nuisance: Nuisance) -> FilterNumbers:
    return FilterNumbers(*(np.array(row, dtype=np.float64) for row in (COAX.values(), noise, nuisance, _steady()[1])))


def _linear(model: StochasticModel, noise: Noise) -> tuple[Array, ...]:
    rows = FilterNumbers(*(part[None] for part in _numbers(noise, TILTED)))
    return tuple(part[0] for part in joined_at(model, rows, STILL))


def _state(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    x = np.array(trim(COAX, voltage=VOLTAGE).state)
    return np.asarray(x + rng.uniform(-0.2, 0.2, x.size) * np.where(np.arange(x.size) < 16, 1.0, 10.0))


def test_a_calm_step_is_what_simulate_does() -> None:
    x = _state(1)
    start = dict(zip(COAX.state_names, x, strict=True))
    row = {"motor_lower": 0.6, "motor_upper": 0.5, "servo_roll": 0.1, "servo_pitch": -0.2}
    flight = simulate_open_loop(
        COAX, {**row, "servo_roll": np.full(2, 0.1)}, start=start, environment=Environment(voltage=VOLTAGE)
    )
    found = _step(x, np.zeros(6), np.array(list(row.values())))
    np.testing.assert_allclose(np.asarray(found), flight.array(COAX.state_names)[1], rtol=1e-12, atol=1e-13)


def test_a_disturbance_is_an_acceleration() -> None:
    """Over one short sample a push of a on a rate changes it by a dt, and nothing else to first order."""
    x, u = _state(2), np.array(trim(COAX, voltage=VOLTAGE).inputs)
    calm = np.asarray(_step(x, np.zeros(6), u))
    for i, name in enumerate(DISTURBED):
        pushed = np.asarray(_step(x, 0.5 * np.eye(6)[i], u))
        change = pushed - calm
        assert change[COAX.index(name)] == pytest.approx(0.5 * DT, rel=0.02)
        others = np.delete(change, COAX.index(name))
        assert np.abs(others).max() < 0.05 * 0.5 * DT


def test_the_tracked_point_lies_at_its_lever_in_body_axes() -> None:
    x = _state(3)
    at = dict(zip(COAX.state_names, x, strict=True))
    found = np.asarray(_measured(x, TILTED))
    lever = body_to_local(Vector(0.05, 0.18, -0.1), Euler(at["phi"], at["theta"], at["psi"]), FloatBackend())
    expected = [at["x"] + lever.x, at["y"] + lever.y, at["z"] + lever.z]
    attitude = Rotation.from_euler("ZYX", [at["psi"], at["theta"], at["phi"]])
    psi, theta, phi = (attitude * Rotation.from_euler("Z", 0.4)).as_euler("ZYX")
    expected += [phi + 0.02, theta - 0.03, psi]
    np.testing.assert_allclose(found, expected, atol=1e-14)


def test_the_joined_system_is_the_slope_of_one_sample() -> None:
    """A and C against central differences of the nonlinear step; gusts fade, drifts stay, both push alike."""
    A, C, _, _ = _linear(_model(), Noise())
    x, u = (np.asarray(part) for part in _steady())
    n, step = x.size, 1e-5
    for i in range(n):
        away = step * np.eye(n)[i]
        slope = (_step(x + away, np.zeros(6), u) - _step(x - away, np.zeros(6), u)) / (2 * step)
        np.testing.assert_allclose(A[:n, i], np.asarray(slope), atol=1e-7)
        seen = (_measured(x + away, TILTED) - _measured(x - away, TILTED)) / (2 * step)
        np.testing.assert_allclose(C[:, i], np.asarray(seen), atol=1e-9)
    for i in range(6):
        away = 0.1 * np.eye(6)[i]
        slope = (_step(x, away, u) - _step(x, -away, u)) / 0.2
        np.testing.assert_allclose(A[:n, n + i], np.asarray(slope), atol=2e-8)  # p |p| bends the difference
        np.testing.assert_array_equal(A[:n, n + 6 + i], A[:n, n + i])
    np.testing.assert_allclose(np.diag(A[n : n + 6, n : n + 6]), np.exp(-DT / 0.5))
    np.testing.assert_array_equal(A[n + 6 :], np.concatenate([np.zeros((6, n + 6)), np.eye(6)], axis=1))
    assert not C[:, n:].any()


def test_wind_acts_through_the_equations_with_the_slope_of_the_speeds_flown() -> None:
    """Against central differences of the step with the wind in its surroundings, averaged over many drawn speeds."""
    noise = Noise(wind=0.4, tau_wind=0.5, speed=0.1)
    model = stochastic_model(COAX, POSE, DT, noise=noise)
    x, u = _steady()
    A, C, Q, _ = _linear(model, noise)
    n = x.size
    assert A.shape == (n + 8 + 6, n + 8 + 6)
    assert C.shape == (6, n + 8 + 6)
    np.testing.assert_allclose(np.diag(A)[n + 6 : n + 8], np.exp(-DT / 0.5))
    np.testing.assert_allclose(np.diag(Q)[n + 6 : n + 8], 0.4**2 * DT)
    sigma, tiny = np.sqrt(0.1**2 + 0.4**2 * 0.5 / 2.0), 1e-4
    drawn = np.tile(np.asarray(x), (4000, 1))
    drawn[:, [COAX.index("u"), COAX.index("v")]] += sigma * np.random.default_rng(5).standard_normal((4000, 2))
    rows = np.array([COAX.index(name) for name in ("u", "v", "p", "q")])
    for i in range(2):
        away = np.tile(tiny * np.eye(8)[6 + i], (4000, 1))
        slope = np.mean((_step(drawn, away, u, model) - _step(drawn, -away, u, model)) / (2.0 * tiny), axis=0)[rows]
        # Four points stand for a bell: |speed| has a kink, and their mean of it is 1.13 times that of the bell.
        np.testing.assert_allclose(A[rows, n + 6 + i], slope, rtol=0.2, atol=0.05 * np.abs(slope).max())


def test_the_noise_has_its_units() -> None:
    """Per square root of hertz: over one second a white push of w leaves a velocity of scatter w, a walk of d, d."""
    _, _, Q, R = _linear(_model(), Noise())
    n, noise = len(COAX.state_names), Noise()
    p, u = COAX.index("p"), COAX.index("u")
    assert Q[p, p] / DT == pytest.approx(noise.white_tilt**2, rel=0.05)
    assert Q[u, u] / DT == pytest.approx(noise.white_horizontal**2, rel=0.05)
    assert np.diag(Q)[n + 5] / DT == pytest.approx(noise.gust_yaw**2)
    assert np.diag(Q)[n + 9] / DT == pytest.approx(noise.drift_moment**2)
    assert np.diag(Q)[n + 6] / DT == pytest.approx(noise.drift_force**2)
    np.testing.assert_allclose(np.diag(R), [noise.sensor_position**2] * 3 + [noise.sensor_angle**2] * 3)
    assert np.linalg.eigvalsh(Q).min() > -1e-18


def _filtered(y: Array, u: Array, nuisance: Nuisance, heading: float) -> tuple[Array, FilterState]:
    model, numbers, (x, _) = _model(), _numbers(Noise(), nuisance), _steady()
    rows = FilterNumbers(*(part[None] for part in numbers))
    K, S, _ = steady_gain(*(part[0] for part in joined_at(model, rows, STILL)))
    begin = Begun(model.gain_of(K, S), x + heading * (np.arange(x.size) == COAX.index("psi")))
    run = record_filter(model).along(begin, numbers, RecordSeries(y, driving_rows(u, np.full(len(y), VOLTAGE))))
    return run.innovations, run.states


def _turned(y: np.ndarray, heading: float) -> np.ndarray:
    """The same measurements in a room that is turned about the vertical."""
    c, s = np.cos(heading), np.sin(heading)
    out = y.copy()
    out[:, 0], out[:, 1] = c * y[:, 0] - s * y[:, 1], s * y[:, 0] + c * y[:, 1]
    out[:, 5] += heading
    return out


def test_the_filter_does_not_care_where_north_is() -> None:
    """The gain is computed with the nose north; horizontal errors are turned into the heading and back."""
    rng = np.random.default_rng(4)
    n = 150
    y = np.cumsum(0.002 * rng.standard_normal((n, 6)), axis=0)
    u = np.tile(trim(COAX, voltage=VOLTAGE).inputs, (n, 1)) + 0.01 * rng.standard_normal((n, 4))
    north, states = _filtered(y, u, Nuisance(), 0.0)
    turned, others = _filtered(_turned(y, 2.0), u, Nuisance(), 2.0)
    np.testing.assert_allclose(turned, north, atol=1e-10)
    body = [COAX.index(name) for name in ("u", "v", "w", "p", "q", "r", "phi", "theta")]
    np.testing.assert_allclose(np.asarray(others.x)[:, body], np.asarray(states.x)[:, body], atol=1e-10)
    np.testing.assert_allclose(np.asarray(others.drift), np.asarray(states.drift), atol=1e-10)


def test_without_a_surprise_the_filter_is_the_simulation_and_a_steady_push_becomes_a_drift() -> None:
    n = 150
    u = np.tile(trim(COAX, voltage=VOLTAGE).inputs, (n, 1))
    x0 = np.asarray(_steady()[0])
    still = np.tile(np.asarray(_measured(x0, Nuisance())), (n, 1))
    innovations, states = _filtered(still, u, Nuisance(), 0.0)
    assert np.abs(innovations).max() < 1e-9
    # Something pushes north with 0.3 m/s^2: what the filter believes of it is a gust or a drift of that size.
    pushed = still.copy()
    pushed[:, 0] += 0.15 * (DT * np.arange(n)) ** 2
    _, states = _filtered(pushed, u, Nuisance(), 0.0)
    believed = np.asarray(states.gust + states.drift)[-1]
    assert believed[0] == pytest.approx(0.3, rel=0.2)
    assert np.abs(believed[[1, 2, 5]]).max() < 0.02  # a push sideways is not taken for one in yaw, east or height
