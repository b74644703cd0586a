"""A vehicle's equations as functions of flat JAX rows, for what is not yet run from the graph."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

from swashplate.arrays import Array
from swashplate.engine.equations import Equations, unpack_rows
from swashplate.engine.slopes import rates_and_slopes as rates_and_slopes
from swashplate.jax_on_demand import jnp, option, set_option
from swashplate.models.nesting import rebuild
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import JaxBackend
from swashplate.physics.environment import Environment
from swashplate.simulation.compilation import compile_small_loops_whole

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

    def rates(x: Array, u: Array, parameters: Any, environment: Environment) -> Any:
        return jnp.stack([jnp.asarray(rate) for rate in vehicle.rates(x, u, parameters, environment, xp)])

    return rates


def row_rates(equations: Equations, *, padded: bool) -> RowRates:
    """`f(x, w, p) -> dx/dt`; `w` is inputs and `SURROUNDINGS`, `p` is parameters and `CONSTANTS`; `padded` is False."""
    assert not padded

    def rates(x: Array, w: Array, p: Array) -> Any:
        u, parameters, environment = unpack_rows(equations, w, p)
        scalars = equations.vehicle.rates(x, u, parameters, environment, jax_backend())
        return jnp.stack([jnp.asarray(scalar, dtype=x.dtype) for scalar in scalars])

    return rates


def row_force(equations: Equations) -> RowRates:
    """`f(x, w, p)`: the specific force at the centre of gravity [m/s^2], three numbers; rows as in `row_rates`."""
    vehicle = equations.vehicle

    def felt(x: Array, w: Array, p: Array) -> Any:
        u, parameters, environment = unpack_rows(equations, w, p)
        nested = rebuild(vehicle.state, [x[i] for i in range(len(vehicle.state_names))])
        commands = vehicle.inputs(*(u[i] for i in range(len(vehicle.input_names))))
        return jnp.stack(vehicle.specific_force(nested, commands, parameters, environment, jax_backend()))

    return felt
