"""Windows simulated from their own starts by XLA, and how they move: traceable, for where there is no C compiler."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from jaxtyping import Float, Int

from swashplate.filtering.arriving_commands import commands
from swashplate.filtering.disturbed_model import N_DISTURBANCES, StochasticModel
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core import robust
from swashplate.identification.core.parameters import Layout
from swashplate.identification.time.start_states import start_state
from swashplate.jax_on_demand import jax, jit, jnp
from swashplate.simulation.compilation import FEW_PASSES, QUICK_TO_COMPILE


@dataclass(frozen=True)
class ShootingPlan:
    """What the simulation of windows depends on: everything but numbers.

    Attributes:
        model: the vehicle's equations and what is measured.
        layout: where a row's parameters go.
        logs: how many flights have nuisances of their own.
        nuisances: what is estimated of each of them.
        drifting: which of these every window moves by a number of its own, behind the corrections of its states.
        length: samples of a window.
        shared: how many entries of the row all windows share.
    """

    model: StochasticModel
    layout: Layout
    logs: int
    nuisances: tuple[str, ...]
    drifting: tuple[str, ...]
    length: int
    shared: int


def unpack_shared(
    plan: ShootingPlan, data: Mapping[str, jax.Array], shared: Float[jax.Array, " shared"]
) -> tuple[Any, Nuisance]:
    numbers = shared * data["scale"]
    k, n, m = len(plan.layout.free), plan.logs, len(plan.nuisances)
    block = numbers[k : k + n * m].reshape(n, m)[data["log"]]
    nuisance = Nuisance(**{name: jnp.zeros(len(block)) for name in Nuisance._fields})._replace(
        **{name: block[:, i] for i, name in enumerate(plan.nuisances)}
    )
    return plan.layout.values(data["card"], numbers[:k]), nuisance


def _shoot(
    plan: ShootingPlan,
    data: Mapping[str, jax.Array],
    shared: Float[jax.Array, " shared"],
    initial: Float[jax.Array, " initial"],
    place: Int[jax.Array, ""],
) -> tuple[Any, Any]:
    """Outputs and states of one window."""
    model, vehicle = plan.model, plan.model.vehicle
    parameters, nuisances = unpack_shared(plan, data, shared)
    record, first = data["record"][place], data["first"][place]
    nuisance = jax.tree.map(lambda values: values[record], nuisances)
    own = initial * data["initial_scale"]
    states = len(vehicle.state_names)
    nuisance = nuisance._replace(
        **{name: getattr(nuisance, name) + own[states + i] for i, name in enumerate(plan.drifting)}
    )
    reaching = commands(vehicle, model.dt, data["inputs"][record], nuisance)
    cut = jax.lax.dynamic_slice_in_dim(reaching, first, plan.length)
    voltage = jax.lax.dynamic_slice_in_dim(data["voltage"][record], first, plan.length)
    start = start_state(
        vehicle,
        model.output_names,
        parameters,
        nuisance,
        value=data["value"][place],
        rate=data["rate"][place],
        inputs=cut[0],
        voltage=voltage[0],
        running=data["running"][place],
    )
    calm = jnp.zeros(N_DISTURBANCES)

    def sample(x: Float[jax.Array, " states"], now: tuple[jax.Array, jax.Array]) -> tuple[Any, Any]:
        u, volts = now
        return model.step(x, calm, u, parameters, volts), x

    _, flown = jax.lax.scan(sample, start + own[:states], (cut, voltage))
    return jax.vmap(lambda x: model.measure(x, nuisance))(flown), flown


def traced_residuals(
    plan: ShootingPlan, data: Mapping[str, jax.Array], row: Float[jax.Array, " entries"]
) -> tuple[Any, Any]:
    shared, initial = row[: plan.shared], row[plan.shared :].reshape(data["first"].shape[0], -1)
    places = jnp.arange(initial.shape[0])
    outputs, states = jax.vmap(lambda i, x0: _shoot(plan, data, shared, x0, i))(places, initial)
    return data["outputs"] - outputs, states


residuals = jit(static_argnums=0, compiler_options=QUICK_TO_COMPILE)(traced_residuals)


def shooting_cost(plan: ShootingPlan, data: Mapping[str, Any], row: jax.Array) -> Any:
    """Negative log-likelihood of the residuals at a given root of their covariance (traceable)."""
    flat = traced_residuals(plan, data, row)[0].reshape(-1, data["root"].shape[0])
    white = jax.scipy.linalg.solve_triangular(data["root"], flat.T, lower=True)
    return robust.losses(white, jnp).sum() + flat.shape[0] * jnp.log(jnp.diag(data["root"])).sum()


@jit(static_argnums=0, compiler_options=FEW_PASSES)
def residuals_moved(
    plan: ShootingPlan, data: Mapping[str, jax.Array], row: Float[jax.Array, " entries"]
) -> tuple[Any, Any]:
    """Residuals and, per window, their derivatives by the shared entries and by the window's own initial state."""
    shared, initial = row[: plan.shared], row[plan.shared :].reshape(data["first"].shape[0], -1)

    def one(place: Int[jax.Array, ""], x0: Float[jax.Array, " initial"]) -> Any:
        def outputs(both: Float[jax.Array, " entries"]) -> Any:
            return _shoot(plan, data, both[: plan.shared], both[plan.shared :], place)[0]

        both = jnp.concatenate([shared, x0])
        return jax.vmap(lambda t: jax.jvp(outputs, (both,), (t,)), out_axes=(None, 0))(jnp.eye(both.shape[0]))

    values, tangents = jax.vmap(one)(jnp.arange(initial.shape[0]), initial)
    return data["outputs"] - values, -tangents
