"""Scalar functions of the observer about one point: values and slopes, as a design asks for them a few times."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from swashplate.arrays import Array
from swashplate.filtering.matrix_operations import JaxMatrices
from swashplate.filtering.observer import Numbers, ObserverPlan
from swashplate.jax_on_demand import jax, jit, jnp
from swashplate.physics.backend import Backend
from swashplate.simulation.compilation import RUN_RARELY
from swashplate.simulation.dual import CANNOT, DUAL, slopes_of
from swashplate.simulation.dynamics import enable_double_precision

OfObserver = Callable[[ObserverPlan, Numbers, Sequence[Any], Sequence[Any], Backend], list[Any]]
"""`observer.shown`, `observer.keeping`."""


def linearised_at(of: OfObserver, plan: ObserverPlan, numbers: Numbers, e: Array, w: Array) -> tuple[Array, Array]:
    """Value (m,) and slopes by what is estimated (m, N) at estimates (N,) under a driving row.

    By numbers that carry their slopes, which compiles nothing, or by XLA where the equations cannot take these.
    """
    plain = Numbers(*(None if part is None else np.asarray(part).tolist() for part in numbers))
    try:
        values, slopes = slopes_of(lambda e, w: of(plan, plain, e, w, DUAL), e, w)
    except CANNOT:
        enable_double_precision()
        made = Numbers(*(None if part is None else jnp.asarray(part) for part in numbers))
        value, by_e = _compiled(of, plan, made, jnp.asarray(e), jnp.asarray(w))
        return np.asarray(value), np.asarray(by_e)
    return values, slopes[:, : len(e)]


@jit(static_argnums=(0, 1), compiler_options=RUN_RARELY)
def _compiled(
    of: OfObserver, plan: ObserverPlan, numbers: Numbers, e: Float[jax.Array, " N"], w: Float[jax.Array, " driving"]
) -> tuple[Any, Any]:
    M = JaxMatrices()
    value, slopes = M.linearised(lambda e, w: of(plan, numbers, e, w, M.xp), e[:, None], w[:, None])
    return value[:, 0], slopes
