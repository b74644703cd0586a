"""A vehicle's equations as functions of flat JAX rows."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float

from swashplate.arrays import Array
from swashplate.engine import slopes
from swashplate.engine.equations import Equations, unpack_rows
from swashplate.errors import ExportError
from swashplate.jax_on_demand import jax, jit, jnp, option, set_option
from swashplate.models.nesting import rebuild
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import JaxBackend
from swashplate.physics.environment import Environment
from swashplate.simulation.compilation import RUN_RARELY, compile_small_loops_whole
from swashplate.simulation.trigonometry import vector_backend

Rates = Callable[[Any, Any, Any, Environment], Any]
RowRates = Callable[[Any, Any, Any], Any]


def enable_double_precision() -> None:
    """Make JAX compute in float64, as every public entry point of swashplate needs; importing alone does not do it."""
    compile_small_loops_whole()
    if option("jax_enable_x64") is not True:
        set_option("jax_enable_x64", True)


@lru_cache(maxsize=1)
def jax_backend() -> JaxBackend:
    return JaxBackend()


def rates_function(vehicle: Vehicle) -> Rates:
    """`f(x, u, parameters, environment) -> dx/dt` on flat rows of shape (n_states,) and (n_inputs,)."""
    xp = jax_backend()

    def rates(
        x: Float[jax.Array, "states ..."], u: Float[jax.Array, "inputs ..."], parameters: Any, environment: Environment
    ) -> Any:
        return jnp.stack([jnp.asarray(rate) for rate in vehicle.rates(x, u, parameters, environment, xp)])

    return rates


def row_rates(equations: Equations, *, padded: bool, xp: JaxBackend | None = None) -> RowRates:
    """`f(x, w, p) -> dx/dt`; `w` is inputs and `SURROUNDINGS`, `p` is parameters and `CONSTANTS`.

    Args:
        equations: of which vehicle.
        padded: put the scalars into the row as a sum of padded ones instead of by `stack`. XLA's CPU compiler makes
            one kernel of that and 18 of a stack: 1.2 times faster for one vehicle, slower for a batch.
        xp: the operations. By default JAX's own, and for one vehicle with the sines of `trigonometry`, which become
            part of the one function: a CoaX steps 1.4 times faster, a helicopter 1.15 times (measured).
    """

    operations = xp or (vector_backend() if padded else jax_backend())

    def rates(
        x: Float[jax.Array, "states ..."], w: Float[jax.Array, "driving ..."], p: Float[jax.Array, "parameters ..."]
    ) -> Any:
        u, parameters, environment = unpack_rows(equations, w, p)
        scalars = equations.vehicle.rates(x, u, parameters, environment, operations)
        entries = [jnp.asarray(scalar, dtype=x.dtype) for scalar in scalars]
        if not padded:
            return jnp.stack(entries)
        zero, last = jnp.zeros((), x.dtype), len(entries) - 1
        return sum(
            (jax.lax.pad(entry[None], zero, [(i, last - i, 0)]) for i, entry in enumerate(entries)),
            start=jnp.zeros(len(entries), x.dtype),
        )

    return rates


def row_force(equations: Equations, *, xp: JaxBackend | None = None) -> RowRates:
    """`f(x, w, p)`: the specific force at the centre of gravity [m/s^2], three numbers; rows as in `row_rates`."""
    vehicle, operations = equations.vehicle, xp or jax_backend()

    def felt(
        x: Float[jax.Array, "states ..."], w: Float[jax.Array, "driving ..."], p: Float[jax.Array, "parameters ..."]
    ) -> Any:
        u, parameters, environment = unpack_rows(equations, w, p)
        nested = rebuild(vehicle.state, [x[i] for i in range(len(vehicle.state_names))])
        commands = vehicle.inputs(*(u[i] for i in range(len(vehicle.input_names))))
        return jnp.stack(vehicle.specific_force(nested, commands, parameters, environment, operations))

    return felt


def rates_and_slopes(equations: Equations, x: Array, w: Array, p: Array) -> tuple[Array, Array, Array]:
    """The rates of a state row, and their slopes by it and by what drives it; rows as in `row_rates`.

    From the graph, or by XLA where CasADi cannot trace the equations (sums over arrays).
    """
    try:
        return slopes.rates_and_slopes(equations, x, w, p)
    except ExportError:
        values, by_x, by_w = _compiled_slopes(equations, x, w, p)
        return np.asarray(values), np.asarray(by_x), np.asarray(by_w)


@jit(static_argnums=0, compiler_options=RUN_RARELY)
def _compiled_slopes(
    equations: Equations,
    x: Float[jax.Array, " states"],
    w: Float[jax.Array, " driving"],
    p: Float[jax.Array, " parameters"],
) -> tuple[Any, Any, Any]:
    rates = row_rates(equations, padded=False)

    def both(x: Float[jax.Array, " states"], w: Float[jax.Array, " driving"]) -> tuple[Any, Any]:
        values = rates(x, w, p)
        return values, values

    (by_x, by_w), values = jax.jacfwd(both, argnums=(0, 1), has_aux=True)(x, w)
    return values, by_x, by_w
