"""A batch on a graphics card: the graph of a vehicle's rates as a JAX function over columns (extra `cuda`).

The only use of JAX in this package. It runs on any device that JAX computes on; on a processor `fly` is faster.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from swashplate.engine.equations import Equations, equations_of
from swashplate.engine.fly import FlightPlan
from swashplate.engine.on_arrays import columns_of, in_order, operations, value_of
from swashplate.engine.statements import Precision, statements
from swashplate.engine.trace import unrolled_rates
from swashplate.errors import SwashError
from swashplate.extras import library
from swashplate.models.vehicle import Vehicle

_NAMES = ("x", "w", "p")


Traced: TypeAlias = Any
"""An array or a function of JAX, which may be missing."""

Library: TypeAlias = Any
"""A module of it."""


def fly_on_card(
    vehicle: Vehicle, plan: FlightPlan, *, precision: Precision = "single"
) -> NDArray[np.float32 | np.float64]:
    """States at the kept samples, shape (kept, states, vehicles), as of `fly`; Euler angles throughout.

    Args:
        vehicle: whose equations.
        plan: without a law, every row held for one step.
        precision: of all numbers.

    Raises:
        SwashError: for a plan with a law or with rows that hold longer.
        MissingLibraryError: without JAX.
    """
    if plan.steering is not None or plan.hold != 1 or not plan.held:
        raise SwashError("flies tables of held inputs only, a row a step.", channel="card")
    jax: Library = library("jax", what="A batch on a card")
    jax.config.update("jax_enable_x64", precision == "double")
    kept = (plan.steps_and_one - 1) // plan.keep
    dtype = np.float64 if precision == "double" else np.float32
    tables = [np.asarray(table, dtype) for table in (plan.start, plan.rows[: kept * plan.keep], plan.numbers)]
    later = batch_program(equations_of(vehicle), plan.keep)(*tables, dtype(plan.dt))
    return np.concatenate([tables[0][None], np.asarray(later)])


@lru_cache(maxsize=8)
def batch_program(equations: Equations, keep: int) -> Traced:
    """A compiled function of states (n, vehicles), rows (steps, w, 1 or vehicles), numbers and step to later states."""
    jax: Library = library("jax", what="A batch on a card")
    rates = rates_by_jax(equations)

    def step(carry: tuple[Traced, Traced, Traced], w: Traced) -> tuple[Traced, None]:
        x, p, dt = carry
        k1 = rates(x, w, p)
        k2 = rates(x + dt / 2 * k1, w, p)
        k3 = rates(x + dt / 2 * k2, w, p)
        k4 = rates(x + dt * k3, w, p)
        return (x + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4), p, dt), None

    def kept(carry: tuple[Traced, Traced, Traced], rows: Traced) -> tuple[Traced, Traced]:
        carry, _ = jax.lax.scan(step, carry, rows)
        return carry, carry[0]

    def program(x: Traced, rows: Traced, p: Traced, dt: Traced) -> Traced:
        return jax.lax.scan(kept, (x, p, dt), rows.reshape(-1, keep, *rows.shape[1:]))[1]

    return jax.jit(program)


def rates_by_jax(equations: Equations) -> Callable[[Traced, Traced, Traced], Traced]:
    """The rates of columns of states (n, vehicles) as JAX computes them, statement by statement of the graph."""
    jnp: Library = library("jax.numpy", what="A batch on a card")
    function = unrolled_rates(equations)
    code = statements(function, precision="double", inputs=_NAMES)
    steps = in_order(code, operations(jnp))

    def rates(x: Traced, w: Traced, p: Traced) -> Traced:
        known = columns_of(_NAMES, (x, w, p))
        for name, call, reads, _ in steps:
            known[name] = call(*[known[read] if isinstance(read, str) else read for read in reads])
        derivatives = [value_of(known, code.outputs[0, i]) for i in range(function.size1_out(0))]
        return jnp.stack([jnp.broadcast_to(jnp.asarray(value, x.dtype), x.shape[1:]) for value in derivatives])

    return rates
