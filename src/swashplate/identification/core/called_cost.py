"""A cost that comes with its gradient from outside, as a function that JAX compiles and differentiates."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, Protocol

import numpy as np

from swashplate.arrays import Array
from swashplate.jax_on_demand import jax, jnp


class Sloped(Protocol):
    """A likelihood that tells its cost and gradient in one call; threads may ask side by side."""

    def slope(self, row: Array) -> tuple[float, Array]: ...


def called_cost(likelihood: Sloped, data: Mapping[str, Any], row: jax.Array) -> Any:
    """The cost at a row, as `scoring.TracedCost` has it; `data` is empty."""
    return _with_gradient()(likelihood, row)


@cache
def _with_gradient() -> Any:
    made = jax.custom_vjp(_cost, nondiff_argnums=(0,))
    made.defvjp(_forward, _backward)
    return made


def _cost(likelihood: Sloped, row: jax.Array) -> Any:
    return _forward(likelihood, row)[0]


def _forward(likelihood: Sloped, row: jax.Array) -> tuple[Any, Any]:
    def asked(row: jax.Array) -> tuple[Any, Any]:
        place = np.asarray(row, dtype=np.float64)
        lost = np.asarray(np.inf), np.zeros(place.shape)
        if not np.all(np.isfinite(place)):
            return lost
        try:
            with np.errstate(all="ignore"):  # a sampler looks far out too
                cost, gradient = likelihood.slope(place)
        except np.linalg.LinAlgError:  # no filter settles there
            return lost
        return (np.asarray(cost), gradient) if np.isfinite(cost) and np.all(np.isfinite(gradient)) else lost

    shapes = jnp.zeros(()), jnp.zeros(row.shape)
    cost, gradient = jax.pure_callback(asked, shapes, row)
    return cost, gradient


def _backward(likelihood: Sloped, gradient: jax.Array, pulled: jax.Array) -> tuple[Any]:
    return (pulled * gradient,)
