"""Noise gathered over a sample, as series that can be differentiated."""

from __future__ import annotations

from typing import Any

from swashplate.jax_on_demand import jax, jnp
from swashplate.simulation.discretisation import held_series

_HALVINGS, _TERMS = 8, 5


def gathered_noise(A: jax.Array, W: jax.Array, dt: jax.Array | float) -> tuple[Any, Any]:
    """Transition e^(A dt) and the noise gathered meanwhile, the integral of e^(As) W e^(A's), to be differentiated.

    Series over a small part of the sample, then doubled (Van Loan's exponential of twice the size takes five times as
    long to compile).

    Args:
        A: shape (n, n), real or complex.
        W: intensity of white noise on the rates, shape (n, n).
        dt: sample time [s].
    """
    h = dt / 2**_HALVINGS
    transition, _ = held_series(A, h, jnp.eye(A.shape[0]), terms=_TERMS)
    gathered = jnp.zeros_like(W)
    for order in range(_TERMS, 0, -1):
        gathered = W + h / (order + 1) * (A @ gathered + gathered @ A.T)
    return summed(transition, h * gathered, _HALVINGS)


def summed(F: jax.Array, W: jax.Array, doublings: int) -> tuple[Any, Any]:
    """F^n and the sum of F^k W F'^k over k below n = 2^doublings (Smith 1968, SIAM J. Appl. Math. 16, 198-201)."""

    def double(carry: tuple[Any, Any], _: None) -> tuple[tuple[Any, Any], None]:
        F, total = carry
        return (F @ F, total + F @ total @ F.T), None

    return jax.lax.scan(double, (F, W), None, length=doublings)[0]
