"""The steady Kalman gain of a discrete linear system, in a form that can be differentiated."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp

_DOUBLINGS = 16
"""Each doubles the horizon: 2^16 samples are eleven minutes at 100 Hz, longer than any flight of ours."""


@jax.custom_jvp
def predicted_covariance(A: Any, C: Any, Q: Any, R: Any) -> Any:
    """Steady covariance P of the one-step-ahead state error: P = A P A' - A P C'(C P C' + R)^-1 C P A' + Q.

    Structure-preserving doubling (Anderson 1978, Int. J. Control 28, 295-306). Slowly drifting states that the
    outputs see only weakly are given the covariance of a filter that has run for 2^16 samples.

    Args:
        A: state transition, shape (n, n).
        C: outputs, shape (m, n).
        Q: process noise covariance per sample, shape (n, n).
        R: measurement noise covariance, shape (m, m).
    """
    n = A.shape[0]
    identity = jnp.eye(n)

    def double(carry: tuple[Any, Any, Any], _: None) -> tuple[tuple[Any, Any, Any], None]:
        a, g, h = carry
        both = jnp.linalg.solve(identity + g @ h, jnp.concatenate([a, g], axis=1))
        wa, wg = both[:, :n], both[:, n:]
        return (a @ wa, g + a @ wg @ a.T, h + a.T @ h @ wa), None

    first = (A.T, C.T @ jnp.linalg.solve(R, C), Q)
    (_, _, P), _ = jax.lax.scan(double, first, None, length=_DOUBLINGS)
    return 0.5 * (P + P.T)


@predicted_covariance.defjvp
def _covariance_moved(here: tuple[Any, Any, Any, Any], moved: tuple[Any, Any, Any, Any]) -> tuple[Any, Any]:
    """The change of the covariance, from the equation that it solves rather than through every doubling.

    With P+ = (P^-1 + C' R^-1 C)^-1, the covariance after a measurement, P = A P+ A' + Q. Hence dP = F dP F' + W with
    F = A (I - K C): a Lyapunov equation, solved by doubling its sum (Smith 1968, SIAM J. Appl. Math. 16, 198-201).
    Exact for a filter that has settled within 2^16 samples.
    """
    A, C, _, R = here
    dA, dC, dQ, dR = moved
    P = predicted_covariance(*here)
    K = jnp.linalg.solve(C @ P @ C.T + R, C @ P).T
    after = P - K @ C @ P
    AK = A @ K
    half = (dA - AK @ dC) @ after @ A.T
    W = half + half.T + AK @ dR @ AK.T + dQ

    def double(carry: tuple[Any, Any], _: None) -> tuple[tuple[Any, Any], None]:
        F, total = carry
        return (F @ F, total + F @ total @ F.T), None

    (_, dP), _ = jax.lax.scan(double, (A - AK @ C, W), None, length=_DOUBLINGS)
    return P, dP


def kalman_gain(A: Any, C: Any, Q: Any, R: Any) -> tuple[Any, Any]:
    """Gain K (n, m) of the measurement update x + K (y - C x) and the innovations' covariance S (m, m)."""
    P = predicted_covariance(A, C, Q, R)
    S = C @ P @ C.T + R
    S = 0.5 * (S + S.T)
    return jnp.linalg.solve(S, C @ P).T, S
