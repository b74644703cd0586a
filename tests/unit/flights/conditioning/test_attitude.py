"""Attitudes by our own formulas are SciPy's: from Euler angles, and between two samples."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from swashplate.flights.conditioning.attitude import (
    continuous,
    euler_from_quaternion,
    interpolate,
    quaternion_from_euler,
    to_body,
)


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    """The largest distance between two rows of attitudes; q and -q are the same."""
    return float(np.minimum(np.abs(one - other), np.abs(one + other)).max())


def test_euler_angles_make_scipys_quaternions() -> None:
    euler = np.random.default_rng(1).uniform(-4.0, 4.0, (500, 3))
    expected = Rotation.from_euler("ZYX", euler[:, ::-1]).as_quat(scalar_first=True)
    assert _apart(quaternion_from_euler(euler), expected) < 1e-14
    assert _apart(quaternion_from_euler(euler + 1e-6), expected) > 1e-8, "the distance can say no"


def test_euler_angles_of_quaternions_are_scipys() -> None:
    turned = continuous(np.random.default_rng(3).standard_normal((500, 4)))
    psi, theta, phi = Rotation.from_quat(turned, scalar_first=True).as_euler("ZYX").T
    found = euler_from_quaternion(turned)
    np.testing.assert_allclose(found[:, :2], np.stack([phi, theta], axis=1), atol=1e-14)
    np.testing.assert_allclose(found[:, 2], np.unwrap(psi), atol=1e-12)
    upright = quaternion_from_euler(np.array([[0.1, 0.5 * np.pi, 0.2]]))
    with pytest.warns(UserWarning, match="Gimbal lock"):
        assert euler_from_quaternion(upright)[0, 1] == pytest.approx(0.5 * np.pi)


def test_between_samples_lies_what_scipy_says() -> None:
    generator = np.random.default_rng(2)
    time = np.cumsum(generator.uniform(0.01, 0.5, 60))
    logged = generator.standard_normal((60, 4))  # any length, any sign, and turns up to 180 degrees
    logged[20] = logged[19]  # an attitude that stands still
    logged[31] = logged[30] * -1.0
    logged[41] = logged[40] + 1e-9  # one that hardly turns
    wanted = np.linspace(time[0], time[-1], 1000)
    expected = Slerp(time, Rotation.from_quat(logged, scalar_first=True))(wanted).as_quat(scalar_first=True)
    found = interpolate(time, logged, wanted)
    assert _apart(found, expected) < 1e-13
    assert np.all(np.sum(found[1:] * found[:-1], axis=1) > 0.0)
    assert np.allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-15)
    beyond = interpolate(time, logged, [time[0] - 1.0, time[-1] + 1.0])
    assert _apart(beyond, continuous(logged)[[0, -1]]) < 1e-15
    assert interpolate(time[:1], logged[:1], wanted).shape == (1000, 4)


def test_local_vectors_are_turned_into_body_axes_as_scipy_does() -> None:
    generator = np.random.default_rng(4)
    quaternion = continuous(generator.standard_normal((200, 4)))
    vectors = generator.standard_normal((200, 3))
    turn = Rotation.from_quat(quaternion, scalar_first=True)
    assert np.abs(to_body(quaternion, vectors) - turn.inv().apply(vectors)).max() < 1e-14
    assert np.abs(to_body(quaternion, vectors) - turn.apply(vectors)).max() > 1.0
    down = np.array([0.0, 0.0, 1.0])
    assert np.abs(to_body(quaternion, down) - turn.inv().apply(down)).max() < 1e-15 * 8
