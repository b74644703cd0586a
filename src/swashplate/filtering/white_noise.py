"""The steady Kalman gain under white noise on every state's rate, and how it moves with a model's numbers."""

from __future__ import annotations

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.filtering.riccati import steady_gain, steady_gain_moved
from swashplate.simulation.discretisation import held_series

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
