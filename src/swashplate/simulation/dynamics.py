"""A vehicle's equations as functions of flat JAX rows."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.jax_on_demand import jax, jit, jnp, option, set_option
from swashplate.models.nesting import rebuild
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import JaxBackend
from swashplate.physics.environment import Environment
from swashplate.simulation.compilation import RUN_RARELY, compile_small_loops_whole
from swashplate.simulation.dual import CANNOT, DUAL, slopes_of
from swashplate.simulation.trigonometry import vector_backend

Rates = Callable[[Any, Any, Any, Environment], Any]
RowRates = Callable[[Any, Any, Any], Any]
if TYPE_CHECKING:
    Rows = jax.Array | Array | Sequence[Any]

SURROUNDINGS = ("wind_north", "wind_east", "wind_down", "voltage")
"""What of the environment may change during a flight, in the order of the driving row."""
CONSTANTS = ("air_density", "gravity")
"""What of the environment stays, in the order of the end of the parameter row."""


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


@dataclass(frozen=True)
class Equations:
    """A vehicle's equations without its numbers: equal for two cards of one vehicle, so that compiled code is shared.

    Attributes:
        key: what decides the equations (functions, their options, names).
        vehicle: any vehicle that has them; its card is never read in compiled code.
    """

    key: Hashable
    vehicle: Vehicle = field(compare=False, repr=False)


def equations_of(vehicle: Vehicle) -> Equations:
    """The equations of a vehicle, to be a static argument of `jax.jit`."""
    functions = (_identity(vehicle.derivatives), _identity(vehicle.specific_force))
    return Equations((vehicle.name, vehicle.state_names, vehicle.input_names, *functions), vehicle)


def _identity(function: object) -> Hashable:
    if isinstance(function, partial):  # two of the same function and numbers are the same equations
        keywords = ((name, _identity(value)) for name, value in sorted(function.keywords.items()))
        return (_identity(function.func), tuple(map(_identity, function.args)), tuple(keywords))
    return function


def parameter_row(vehicle: Vehicle, environment: Environment) -> NDArray[np.float64]:
    """The card's numbers and the constant surroundings side by side, shape (n_parameters + 2,).

    One row instead of 56 scalars: every compiled kernel then takes one argument for all of them (measured: 1.3 times
    faster on a CPU).
    """
    around = environment_of(vehicle, environment)
    constants = (getattr(around, name) for name in CONSTANTS)
    return np.array([*vehicle.values(), *constants], dtype=np.float64)


def unpack_rows(equations: Equations, w: Rows, p: Rows) -> tuple[Any, Any, Environment]:
    """Inputs, named parameters and environment from a driving row `w` and a parameter row `p`, or batches of these."""
    n_inputs, names = len(equations.vehicle.input_names), equations.vehicle.parameter_names
    parameters = equations.vehicle.parameters(*(p[i] for i in range(len(names))))
    surroundings = {name: w[n_inputs + i] for i, name in enumerate(SURROUNDINGS)}
    constants = {name: p[len(names) + i] for i, name in enumerate(CONSTANTS)}
    return w[:n_inputs], parameters, Environment(**surroundings, **constants)


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

    By numbers that carry their slopes, which compiles nothing, or by XLA where the equations cannot take these.
    """

    def rates(x: Sequence[Any], w: Sequence[Any]) -> list[Any]:
        u, parameters, environment = unpack_rows(equations, w, p.tolist())
        return equations.vehicle.rates(x, u, parameters, environment, DUAL)

    try:
        values, slopes = slopes_of(rates, x, w)
    except CANNOT:
        values, by_x, by_w = _compiled_slopes(equations, x, w, p)
        return np.asarray(values), np.asarray(by_x), np.asarray(by_w)
    return values, slopes[:, : len(x)], slopes[:, len(x) :]


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
