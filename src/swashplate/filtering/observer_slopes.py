"""Scalar functions of the observer about one point: values and slopes, as a design asks for them a few times."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from swashplate.arrays import Array
from swashplate.engine.slopes import slopes_at, slopes_graph
from swashplate.errors import ExportError
from swashplate.filtering.matrix_operations import JaxMatrices
from swashplate.filtering.observer import Numbers, ObserverPlan
from swashplate.jax_on_demand import jax, jit, jnp
from swashplate.physics.backend import Backend
from swashplate.simulation.compilation import RUN_RARELY
from swashplate.simulation.dynamics import enable_double_precision

OfObserver = Callable[[ObserverPlan, Numbers, Sequence[Any], Sequence[Any], Backend], list[Any]]
"""`observer.shown`, `observer.keeping`."""


def linearised_at(of: OfObserver, plan: ObserverPlan, numbers: Numbers, e: Array, w: Array) -> tuple[Array, Array]:
    """Value (m,) and slopes by what is estimated (m, N) at estimates (N,) under a driving row.

    From the graph, or by XLA where CasADi cannot trace the equations.
    """
    plain = Numbers(*(None if part is None else np.asarray(part).tolist() for part in numbers))
    try:
        graph = slopes_graph(lambda e, w, _, xp: of(plan, plain, e, w, xp), (len(e), len(w), 0), where="the observer")
    except ExportError:
        enable_double_precision()
        made = Numbers(*(None if part is None else jnp.asarray(part) for part in numbers))
        value, by_e = _compiled(of, plan, made, jnp.asarray(e), jnp.asarray(w))
        return np.asarray(value), np.asarray(by_e)
    values, by_e, _ = slopes_at(graph, e, w, np.zeros(0))
    return values, by_e


@jit(static_argnums=(0, 1), compiler_options=RUN_RARELY)
def _compiled(
    of: OfObserver, plan: ObserverPlan, numbers: Numbers, e: Float[jax.Array, " N"], w: Float[jax.Array, " driving"]
) -> tuple[Any, Any]:
    M = JaxMatrices()
    value, slopes = M.linearised(lambda e, w: of(plan, numbers, e, w, M.xp), e[:, None], w[:, None])
    return value[:, 0], slopes
