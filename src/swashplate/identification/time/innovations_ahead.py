"""Predictions of a filter along records, some time ahead from its own states, and their exact derivatives.

Forward mode through the filter and the predictions together: what moves is a handful of numbers, what comes out some
thousand errors.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from swashplate.filtering.arriving_commands import commands
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import FilterState
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.time.beginning import FirstMotion
from swashplate.identification.time.innovations import FilterPlan, traced_run, unpack
from swashplate.jax_on_demand import jax, jit, jnp
from swashplate.simulation.compilation import QUICK_TO_COMPILE


def _traced(
    plan: FilterPlan, steps: tuple[int, ...], data: Mapping[str, jax.Array], row: jax.Array, starts: jax.Array
) -> Any:
    """Measured less predicted after `steps` samples from each start, (records, starts, horizons, outputs)."""
    parameters, nuisances, noise = unpack(plan, data, row)

    def one(
        y: jax.Array, u: jax.Array, voltage: jax.Array, seen: FirstMotion, starts: jax.Array, nuisance: Nuisance
    ) -> Any:
        numbers = {"parameters": parameters, "noise": noise, "nuisance": nuisance}
        _, _, states = traced_run(plan.model, y, u, voltage, seen, **numbers)
        reaching = commands(plan.model.vehicle, plan.model.dt, u, nuisance)

        def run(start: jax.Array) -> Any:
            predicted = _predicted(plan, steps, (states, reaching, voltage), parameters, noise, nuisance, start)
            return y[start + jnp.array(steps)] - predicted

        return jax.vmap(run)(starts)

    own = (data["outputs"], data["inputs"], data["voltage"], FirstMotion(*data["seen"]))
    return jax.vmap(one)(*own, starts, nuisances)


def _predicted(
    plan: FilterPlan,
    steps: tuple[int, ...],
    along: tuple[FilterState, jax.Array, jax.Array],
    parameters: tuple[jax.Array, ...],
    noise: Noise,
    nuisance: Nuisance,
    start: jax.Array,
) -> Any:
    """What is predicted to be measured after each of `steps` samples from one start (horizons, outputs)."""
    model, (states, reaching, voltage) = plan.model, along

    def advance(x: jax.Array, acting: jax.Array, k: jax.Array) -> Any:
        return model.step(x, acting, reaching[k], parameters, voltage[k])

    def sample(state: FilterState, k: jax.Array) -> tuple[FilterState, Any]:
        following = model.predict(state, noise, advance, k)
        return following, model.measure(following.x, nuisance)

    first = jax.tree.map(lambda rows: rows[start], states)
    return jax.lax.scan(sample, first, start + jnp.arange(steps[-1]))[1][jnp.array(steps) - 1]


errors_ahead = jit(static_argnums=(0, 1), compiler_options=QUICK_TO_COMPILE)(_traced)
"""The errors of records side by side, compiled; arguments as of `_traced`."""


@jit(static_argnums=(0, 1), compiler_options=QUICK_TO_COMPILE)
def errors_ahead_moved(
    plan: FilterPlan,
    steps: tuple[int, ...],
    data: Mapping[str, jax.Array],
    row: jax.Array,
    starts: jax.Array,
    directions: jax.Array,
) -> tuple[Any, Any]:
    """The errors, and their slopes along directions of the row (directions, records, starts, horizons, outputs)."""

    def errors(moved: jax.Array) -> Any:
        return _traced(plan, steps, data, moved, starts)

    return jax.vmap(lambda d: jax.jvp(errors, (row,), (d,)), out_axes=(None, 0))(directions)
