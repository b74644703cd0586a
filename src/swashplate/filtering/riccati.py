"""The steady Kalman gain of a discrete linear system, or of a cycle of them: one Riccati solver, by doubling.

How a covariance goes through some samples, P -> H + A P (I + G P)^-1 A', is a map of that form again when two follow
each other (Anderson 1978, Int. J. Control 28, 295-306; Chu, Fan and Lin 2005). A map that follows itself doubles the
horizon, until it has settled.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.simulation.discretisation import held_series


def diagonal(rows: Array) -> Array:
    """Diagonal matrices of rows (..., n)."""
    return rows[..., None] * np.eye(rows.shape[-1])


def blocks(rows: Sequence[Sequence[Array | None]], sizes: tuple[int, ...]) -> Array:
    """Matrices of blocks of these sizes, with any axes in front; None is zeros."""
    front = np.broadcast_shapes(*(block.shape[:-2] for row in rows for block in row if block is not None))
    joined = np.zeros((*front, sum(sizes), sum(sizes)))
    ends = np.concatenate([[0], np.cumsum(sizes)])
    for i, row in enumerate(rows):
        for j, block in enumerate(row):
            if block is not None:
                joined[..., ends[i] : ends[i + 1], ends[j] : ends[j + 1]] = block
    return joined


STEP = 1e-30
"""Of the complex steps: so small that what they give is exact to rounding."""

_HALVINGS, _TERMS = 8, 5


def gathered_noise(A: Array | Complex, W: Array | Complex, dt: float) -> tuple[Array | Complex, Array | Complex]:
    """Transition e^(A dt) and the noise gathered meanwhile, the integral of e^(As) W e^(A's).

    Series over a small part of the sample, then doubled (Smith 1968, SIAM J. Appl. Math. 16, 198-201): of Van Loan's
    exponential a fast actuator would leave no digits.

    Args:
        A, W: shapes (..., n, n), real or with complex steps; W is the noise's intensity.
        dt: sample time [s].
    """
    h = dt / 2**_HALVINGS
    F, _ = held_series(A, h, np.eye(A.shape[-1]), terms=_TERMS)
    total = np.zeros_like(A)
    for order in range(_TERMS, 0, -1):
        total = W + h / (order + 1) * (A @ total + total @ A.swapaxes(-1, -2))
    total = h * total
    for _ in range(_HALVINGS):
        total = total + F @ total @ F.swapaxes(-1, -2)
        F = F @ F
    return F, total


def white_noise_gain(
    A: Array | Complex, intensity: Array | Complex, C: Array | Complex, sensors: Array | Complex, dt: float
) -> tuple[Array | Complex, Array | Complex]:
    """Gains x + K e (k, n, m) and innovations' covariances (k, m, m) of one model with complex steps in its numbers.

    Where no filter settles they are not finite.

    Args:
        A, C: of x' = A x and y = C x, shapes (k, n, n) and (k, m, n); all have the same real part.
        intensity: of the noise on each rate, (k, n).
        sensors: covariances of the outputs' noise, (k, m, m).
        dt: sample time [s].
    """
    with np.errstate(over="ignore", invalid="ignore"):
        phi, gathered = gathered_noise(A, intensity[:, :, None] * np.eye(A.shape[-1]), dt)
        here = phi[0].real, C[0].real, gathered[0].real, sensors[0].real
        K, S, P = steady_gain(*here)
        dK, dS = steady_gain_moved(here, P, (phi.imag / STEP, C.imag / STEP, gathered.imag / STEP, sensors.imag / STEP))
    return K + 1j * STEP * dK, S + 1j * STEP * dS


Map = tuple[Array, Array, Array]
"""A, G and H of some samples."""
Matrices = tuple[Array, Array, Array, Array]
"""A, C, Q and R."""

_DOUBLINGS = 16
"""Each doubles the horizon: 2^16 samples are eleven minutes at 100 Hz, longer than any flight of ours."""
_MOST_DOUBLINGS, _SETTLED, _NEARLY = 40, 1e-13, 1e-6
_NOTHING = 1e-12
"""Of a power of the filter's loop: its square adds nothing to a sum."""


def through(A: Array, C: Array, Q: Array, R: Array) -> Map:
    """The map of one sample: a reading C x with noise R, then x+ = A x with noise Q."""
    return A, C.T @ np.linalg.solve(R, C), Q


def followed(first: Map, second: Map) -> Map:
    """The map of some samples and those after them."""
    (A1, G1, H1), (A2, G2, H2) = first, second
    n = A1.shape[0]
    both = np.linalg.solve(np.eye(n) + G2 @ H1, np.concatenate([A2.T, G2], axis=1))
    by_A, by_G = both[:, :n], both[:, n:]
    return (A1.T @ by_A).T, G1 + A1.T @ by_G @ A1, H2 + A2 @ H1 @ by_A


def settled_covariance(cycle: Map) -> Array:
    """The covariance that a map leaves as it is, by doubling.

    Raises:
        numpy.linalg.LinAlgError: where it does not settle (something that lasts is not seen).
    """
    P, change = _doubled(cycle, _MOST_DOUBLINGS)
    if not np.all(np.isfinite(P)) or change > _NEARLY:
        raise np.linalg.LinAlgError("the covariance does not settle")
    return P


def _doubled(cycle: Map, most: int) -> tuple[Array, float]:
    """The covariance after a map has doubled so many times or settled, and the share by which the last one moved it."""
    P, change = cycle[2], np.inf
    for _ in range(most):
        A, G, H = followed(cycle, cycle)
        cycle = A, 0.5 * (G + G.T), 0.5 * (H + H.T)
        change = float(np.max(np.abs(cycle[2] - P))) / max(float(np.max(np.abs(cycle[2]))), 1e-300)
        P = cycle[2]
        if not np.all(np.isfinite(P)) or change < _SETTLED:
            break
    return P, change


def gain_at(P: Array, C: Array, R: Array) -> Array:
    """Kalman gain (n, m) of a reading C x with noise R where the state has the covariance P."""
    return np.asarray(np.linalg.solve(C @ P @ C.T + R, C @ P).T, dtype=np.float64)


def _pushed(P: Array, here: Matrices, change: Matrices) -> tuple[Array, Array]:
    """F and W of the Lyapunov equation of a change; changes may come as stacks (..., n, n).

    With P+ = (P^-1 + C' R^-1 C)^-1, the covariance after a measurement, P = A P+ A' + Q. Hence dP = F dP F' + W with
    F = A (I - K C), solved by doubling its sum (Smith 1968, SIAM J. Appl. Math. 16, 198-201). Exact for a filter that
    has settled within 2^16 samples.
    """
    A, C, _, R = here
    dA, dC, dQ, dR = change
    K = gain_at(P, C, R)
    after = P - K @ C @ P
    AK = A @ K
    half = (dA - AK @ dC) @ after @ A.T
    return A - AK @ C, half + np.swapaxes(half, -1, -2) + AK @ dR @ AK.T + dQ


def steady_gain(A: Array, C: Array, Q: Array, R: Array) -> tuple[Array, Array, Array]:
    """Gain K (n, m) of the measurement update x + K (y - C x), the innovations' covariance S (m, m), and the covariance
    P (n, n) of the one-step-ahead state error; nan where a matrix is singular.

    P = A P A' - A P C'(C P C' + R)^-1 C P A' + Q. Slowly drifting states that the outputs see only weakly are given
    the covariance of a filter that has run for 2^16 samples.

    Args:
        A: state transition, shape (n, n).
        C: outputs, shape (m, n).
        Q: process noise covariance per sample, shape (n, n).
        R: measurement noise covariance, shape (m, m).
    """
    n, m = len(A), len(C)
    try:
        P, _ = _doubled(through(A, C, Q, R), _DOUBLINGS)
        S = C @ P @ C.T + R
        S = 0.5 * (S + S.T)
        return np.asarray(np.linalg.solve(S, C @ P).T, dtype=np.float64), S, P
    except np.linalg.LinAlgError:
        return np.full((n, m), np.nan), np.full((m, m), np.nan), np.full((n, n), np.nan)


def covariances_beside(P: Array, here: Matrices, beside: Sequence[Array]) -> Array:
    """P of `steady_gain` for k systems that lie beside one, to first order (k, n, n).

    Args:
        P, here: of that one, and its matrices. beside: the others' A, C, Q and R, stacked.
    """
    A, C, Q, R = (rows - mine for rows, mine in zip(beside, here, strict=True))
    return P + _sums(*_pushed(P, here, (A, C, Q, R)))


def steady_gain_moved(here: Matrices, P: Array, change: Matrices) -> tuple[Array, Array]:
    """How `steady_gain` moves with its matrices: gains (k, n, m) and covariances of the innovations (k, m, m).

    Args:
        here: A, C, Q and R. P: of `steady_gain`.
        change: k changes of each, stacked.
    """
    (_, C, _, R), (_, dC, _, dR) = here, change
    F, W = _pushed(P, here, change)
    dP = _sums(F, W)
    S = C @ P @ C.T + R
    turned = np.swapaxes(dC, -1, -2)
    dS = dC @ P @ C.T + C @ dP @ C.T + C @ P @ turned + dR
    inverse = np.linalg.inv(0.5 * (S + S.T))
    return (dP @ C.T + P @ turned - P @ C.T @ inverse @ dS) @ inverse, 0.5 * (dS + np.swapaxes(dS, -1, -2))


def _sums(F: Array, W: Array) -> Array:
    """The sums of F^i W F'^i for a stack of symmetric W (k, n, n), each power of F used for all of them."""
    k, n, _ = W.shape
    total = np.ascontiguousarray(W.transpose(1, 0, 2))  # (n, k, n): both products are one of large matrices
    for _ in range(_DOUBLINGS):
        if np.max(np.abs(F)) < _NOTHING:
            break
        left = (F @ total.reshape(n, -1)).reshape(-1, n)
        total = total + (left @ F.T).reshape(n, k, n)
        F = F @ F
    return total.transpose(1, 0, 2)
