"""Linear models flown along recorded inputs: straight between samples, delays and all."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from swashplate.flights.flight import Array


def hold_matrices(a: Array, b: Array, dt: float) -> tuple[Array, Array, Array]:
    """Exact step for inputs that run straight between samples: x+ = P x + Q0 u + Q1 (u+ - u) (Van Loan 1978).

    Args:
        a, b: of dx/dt = A x + B u, shapes (n, n) and (n, m).
        dt: step [s].
    """
    n, m = b.shape
    block = np.zeros((n + 2 * m, n + 2 * m))
    block[:n, :n], block[:n, n : n + m] = a, b
    block[n : n + m, n + m :] = np.eye(m) / dt
    step = expm(block * dt)
    return step[:n, :n], step[:n, n : n + m], step[:n, n + m :]


def delayed(values: Array, lag: float) -> Array:
    """A sampled signal later by `lag` samples (need not be whole); its first value stands before the start."""
    if lag == 0.0:
        return values
    count = np.arange(values.shape[0], dtype=np.float64)
    return np.asarray(np.interp(count - lag, count, values))


def free_and_forced(a: Array, b: Array, inputs: Array, dt: float) -> tuple[Array, Array, Array]:
    """State histories of a linear model.

    Args:
        a, b: of dx/dt = A x + B u.
        inputs: (n_t, m), straight between samples.
        dt: step [s].

    Returns:
        Forced by the inputs from rest (n_t, n); from unit initial states (n_t, n, n), last axis the state that started;
        from constant unit rates (n_t, n, n), last axis the rate.
    """
    n, n_t = a.shape[0], inputs.shape[0]
    phi, q0, q1 = hold_matrices(a, b, dt)
    _, constant, _ = hold_matrices(a, np.eye(n), dt)
    forced, started, pushed = np.zeros((n_t, n)), np.zeros((n_t, n, n)), np.zeros((n_t, n, n))
    started[0] = np.eye(n)
    drive = inputs[:-1] @ q0.T + np.diff(inputs, axis=0) @ q1.T
    for k in range(1, n_t):
        forced[k] = phi @ forced[k - 1] + drive[k - 1]
        started[k] = phi @ started[k - 1]
        pushed[k] = phi @ pushed[k - 1] + constant
    return forced, started, pushed
