"""The steady Kalman filter: against SciPy's solver, against recursion, and its derivatives against differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from swashplate.filtering.riccati import (
    covariances_beside,
    followed,
    gain_at,
    settled_covariance,
    steady_gain,
    steady_gain_moved,
    through,
)

System = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def _system(seed: int, *, largest: float) -> System:
    """A random observable system of five states and two outputs whose largest eigenvalue is given."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((5, 5))
    A *= largest / np.abs(np.linalg.eigvals(A)).max()
    root, noise = rng.standard_normal((5, 5)), rng.standard_normal((2, 2))
    return A, rng.standard_normal((2, 5)), root @ root.T, noise @ noise.T + 0.1 * np.eye(2)


@pytest.mark.parametrize("largest", [0.5, 0.99, 1.2])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_covariance_is_scipys(seed: int, largest: float) -> None:
    """Also where the system is unstable: only the filter has to be stable."""
    A, C, Q, R = _system(seed, largest=largest)
    expected = solve_discrete_are(A.T, C.T, Q, R)
    found = steady_gain(A, C, Q, R)[2]
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-10 * np.abs(expected).max())


def test_the_gain_is_what_the_recursion_settles_at() -> None:
    A, C, Q, R = _system(4, largest=1.02)
    P = np.eye(5)
    for _ in range(4000):
        S = C @ P @ C.T + R
        K = P @ C.T @ np.linalg.inv(S)
        P = A @ (P - K @ C @ P) @ A.T + Q
    gain, covariance, _ = steady_gain(A, C, Q, R)
    np.testing.assert_allclose(gain, K, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(covariance, S, rtol=1e-9)


def test_a_covariance_beside_another_is_right_to_first_order() -> None:
    """A step a tenth as long leaves a hundredth of the error."""
    here, rng = _system(8, largest=1.01), np.random.default_rng(9)
    ways = [rng.standard_normal((3, *part.shape)) for part in here[:2]]
    noises = [np.abs(rng.standard_normal((3, 1, 1))) * part for part in here[2:]]
    P, errors = steady_gain(*here)[2], []
    for size in (1e-3, 1e-4):
        beside = [part + size * way for part, way in zip(here, (*ways, *noises), strict=True)]
        exact = np.array([steady_gain(*system)[2] for system in zip(*beside, strict=True)])
        errors.append(float(np.max(np.abs(covariances_beside(P, here, beside) - exact))))
        assert errors[-1] < 0.1 * float(np.max(np.abs(exact - P)))
    assert 50.0 < errors[0] / errors[1] < 200.0
    assert covariances_beside(P, here, [part[:0] for part in beside]).shape == (0, 5, 5)


def test_a_cycle_settles_where_its_recursion_does() -> None:
    """Two samples that differ in everything, the second without a reading."""
    one, two = _system(5, largest=1.01), _system(6, largest=0.9)
    deaf = (two[0], 0.0 * two[1], two[2], two[3])
    P = np.eye(5)
    for _ in range(2000):
        for A, C, Q, R in (one, deaf):
            P = A @ (P - gain_at(P, C, R) @ C @ P) @ A.T + Q
    found = settled_covariance(followed(through(*one), through(*deaf)))
    np.testing.assert_allclose(found, P, rtol=1e-9)
    other = settled_covariance(followed(through(*deaf), through(*one)))
    assert np.max(np.abs(other - P)) > 1e-3 * np.max(P)  # where the cycle begins matters


def test_what_lasts_and_is_not_seen_does_not_settle() -> None:
    A, C, Q, R = _system(7, largest=1.02)
    with pytest.raises(np.linalg.LinAlgError, match="does not settle"), np.errstate(all="ignore"):
        settled_covariance(through(A, 0.0 * C, Q, R))


@pytest.mark.parametrize("q", [1e-6, 1e-4, 1.0])
def test_a_random_walk_in_noise_has_its_closed_form(q: float) -> None:
    """P = (q + sqrt(q^2 + 4 q r)) / 2 for one state that drifts and is measured."""
    covariance = float(steady_gain(np.eye(1), np.eye(1), q * np.eye(1), np.eye(1))[2][0, 0])
    assert covariance == pytest.approx(0.5 * (q + np.sqrt(q**2 + 4.0 * q)), rel=1e-9)


def test_a_very_slow_drift_is_that_of_a_long_flight() -> None:
    """From P = 0 the covariance grows as sqrt(q) tanh(n sqrt(q)); the filter has run for n = 2^16 samples."""
    q = 1e-9
    covariance = float(steady_gain(np.eye(1), np.eye(1), q * np.eye(1), np.eye(1))[2][0, 0])
    assert covariance == pytest.approx(np.sqrt(q) * np.tanh(2**16 * np.sqrt(q)), rel=1e-4)


def test_a_state_that_nobody_sees_grows_no_further_than_the_horizon() -> None:
    """Unobserved drift has no steady covariance: it is that of a filter that has run for 2^16 samples."""
    A, C = np.eye(2), np.array([[1.0, 0.0]])
    P = steady_gain(A, C, 1e-6 * np.eye(2), np.eye(1))[2]
    assert P[1, 1] == pytest.approx(1e-6 * 2**16, rel=1e-9)
    assert P[0, 0] == pytest.approx(1e-3, rel=1e-3)


@pytest.mark.parametrize("seed", [5, 6, 7])
def test_its_derivatives_are_the_differences(seed: int) -> None:
    """Along a random change of all four matrices at once."""
    system, rng, step = _system(seed, largest=1.05), np.random.default_rng(seed), 1e-5
    dA, dC, dQ, dR = (rng.standard_normal(part.shape) for part in system)
    changes = 0.1 * dA, dC, dQ + dQ.T, 0.05 * (dR + dR.T)
    high, low = (
        steady_gain(*(part + away * change for part, change in zip(system, changes, strict=True)))
        for away in (step, -step)
    )
    A, C, Q, R = changes
    found = steady_gain_moved(system, steady_gain(*system)[2], (A[None], C[None], Q[None], R[None]))
    for moved, above, below in zip(found, high, low, strict=False):
        slope = (above - below) / (2.0 * step)
        np.testing.assert_allclose(moved[0], slope, rtol=1e-6, atol=1e-7 * np.abs(slope).max())
