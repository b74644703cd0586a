"""The innovations of some records as compiled functions of one row of numbers, and their exact derivatives.

Derivatives in two passes. The first has the states that the filter went through; the slopes of the equations at all
samples are then independent of each other and are taken together, many samples at a time. The second pass is the same
filter with each sample's step replaced by its tangent plane at that state: at the row where the slopes were taken its
derivatives are those of the filter itself, and it only multiplies matrices (measured: half the time of carrying every
derivative through the equations sample by sample).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial, wraps
from typing import Any

import jax
import jax.numpy as jnp

from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import N_DISTURBANCES, FilterGain, FilterState, StochasticModel, commands
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.parameters import Layout
from swashplate.identification.core.robust import losses
from swashplate.identification.time.start_states import start_state, steady_flight
from swashplate.simulation.compilation import QUICK_TO_COMPILE

_TOGETHER = 64
"""Samples whose slopes are taken side by side: what stays in a core's cache."""


@dataclass(frozen=True)
class FilterPlan:
    """What compiled code depends on: everything but numbers.

    Attributes:
        model: the stochastic model.
        layout: where a row's parameters go.
        logs: how many flights have nuisances of their own.
        nuisances: what is estimated of each of them.
        noises: what is estimated of the noise.
    """

    model: StochasticModel
    layout: Layout
    logs: int
    nuisances: tuple[str, ...]
    noises: tuple[str, ...]

    def numbers(self, data: Any, row: Any) -> Any:
        """The parameters of a scaled row in their units."""
        return (row * data["scale"])[: len(self.layout.free)]


def unpack(plan: FilterPlan, data: Any, row: Any) -> tuple[Any, Nuisance, Noise]:
    """Equations' parameters, nuisances (one array entry per record) and noise of a scaled row."""
    numbers = row * data["scale"]
    k, n, m = len(plan.layout.free), plan.logs, len(plan.nuisances)
    block = numbers[k : k + n * m].reshape(n, m)[data["log"]]
    nuisance = Nuisance(**{name: jnp.zeros(len(block)) for name in Nuisance._fields})._replace(
        **{name: block[:, i] for i, name in enumerate(plan.nuisances)}
    )
    noise = data["noise"]
    if plan.noises:
        estimated = jnp.array([Noise._fields.index(name) for name in plan.noises])
        noise = noise.at[estimated].set(jnp.exp(numbers[k + n * m :]))
    return plan.layout.values(data["card"], numbers[:k]), nuisance, Noise(*noise)


def _by_record(data: Any) -> tuple[Any, Any, Any, Any, Any, Any]:
    """What of the data each record has of its own."""
    return data["outputs"], data["inputs"], data["voltage"], data["value"], data["rate"], data["velocity"]


@partial(jax.jit, static_argnums=0)
def innovations(plan: FilterPlan, data: Any, row: Any) -> tuple[Any, Any, FilterState]:
    """Innovations (records, n, outputs), their covariances (records, outputs, outputs) and the filtered states."""
    parameters, nuisances, noise = unpack(plan, data, row)

    def one(y: Any, u: Any, voltage: Any, value: Any, rate: Any, velocity: Any, nuisance: Nuisance) -> Any:
        return filter_record(
            plan.model,
            y,
            u,
            voltage,
            value=value,
            rate=rate,
            velocity=velocity,
            parameters=parameters,
            noise=noise,
            nuisance=nuisance,
        )

    return jax.vmap(one)(*_by_record(data), nuisances)  # type: ignore[no-any-return]


def filter_record(
    model: StochasticModel,
    y: Any,
    u: Any,
    voltage: Any,
    *,
    value: Any,
    rate: Any,
    velocity: Any,
    parameters: Any,
    noise: Noise,
    nuisance: Nuisance,
) -> tuple[Any, Any, FilterState]:
    """Innovations, their covariance and the filtered states of one record (traceable).

    Args:
        model: the stochastic model.
        y, u, voltage: measurements, logged inputs and battery voltage by sample.
        value, rate: measured channels and their rates at the first sample.
        velocity: mean velocity ahead, right and down [m/s] that the gain is for (`start_states.mean_velocity`).
        parameters, noise, nuisance: numbers of the equations, of the noise and of this record.
    """
    reaching, gain, start = _beginning(model, u, voltage, (value, rate, velocity), parameters, noise, nuisance)

    def advance(x: Any, acting: Any, now: tuple[Any, Any]) -> Any:
        commanded, volts = now
        return model.step(x, acting, commanded, parameters, volts)

    found, states = model.run(start, y, advance, (reaching, voltage), noise, nuisance, gain)
    return found, gain.covariance, states


def _beginning(
    model: StochasticModel,
    u: Any,
    voltage: Any,
    motion: tuple[Any, Any, Any],
    parameters: Any,
    noise: Noise,
    nuisance: Nuisance,
) -> tuple[Any, FilterGain, FilterState]:
    """What reaches the vehicle, the filter's gain and its first guess."""
    value, rate, velocity = motion
    reaching = commands(model.vehicle, model.dt, u, nuisance)
    around, held = steady_flight(model.vehicle, parameters, jnp.mean(voltage), velocity)
    gain = model.gain(around, held, parameters, jnp.mean(voltage), noise, nuisance)
    settled = max(1, round(0.5 / model.dt))
    x = start_state(
        model.vehicle,
        model.output_names,
        parameters,
        nuisance,
        value=value,
        rate=rate,
        inputs=jnp.mean(reaching[:settled], axis=0),
        voltage=voltage[0],
    )
    return reaching, gain, FilterState(x, jnp.zeros(model.n_gusts), jnp.zeros(N_DISTURBANCES))


def traced_cost(plan: FilterPlan, data: Mapping[str, Any], row: jax.Array) -> Any:
    """Negative log-likelihood of the counted innovations (traceable), as `PredictionError.cost` has it.

    Args:
        plan, row: as `innovations` takes them.
        data: its data, and "counted" (records, n).
    """
    found, covariances, _ = innovations(plan, data, row)
    roots = jnp.linalg.cholesky(covariances)
    white = jax.vmap(lambda L, nu: jax.scipy.linalg.solve_triangular(L, nu.T, lower=True).T)(roots, found)
    logarithms = jnp.log(jnp.diagonal(roots, axis1=1, axis2=2)).sum(axis=-1)
    return jnp.where(data["counted"], losses(white, jnp).sum(axis=-1) + logarithms[:, None], 0.0).sum()


# ---- derivatives ---------------------------------------------------------------------------------------------------
def tangents(plan: FilterPlan, data: Any, row: Any, states: FilterState) -> tuple[Any, Any]:
    """Derivatives of `innovations` by every entry of the row.

    Args:
        plan, data, row: as `innovations` takes them.
        states: the filtered states that it gave.

    Returns:
        Of the innovations (p, records, n, outputs) and of their covariances (p, records, outputs, outputs).
    """
    return _straightened(plan, data, row, _slopes(plan, data, row, states))  # type: ignore[no-any-return]


def _compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiled for speed; a helicopter's many times as many operations, to be compiled soon."""
    swiftly = jax.jit(function, static_argnums=0)
    soon = jax.jit(function, static_argnums=0, compiler_options=QUICK_TO_COMPILE)

    @wraps(function)
    def chosen(plan: FilterPlan, *rest: Any) -> Any:
        return (soon if plan.model.vehicle.traits.heavy else swiftly)(plan, *rest)

    return chosen


@_compiled
def _slopes(plan: FilterPlan, data: Any, row: Any, states: FilterState) -> tuple[Any, Any, Any, Any]:
    """Each sample's tangent plane (records, n, ...).

    Returns:
        State and disturbances side by side, the commands, the state one sample later, and its slopes by state,
        disturbances, commands and the row's parameters side by side.
    """
    model = plan.model
    _, nuisances, _ = unpack(plan, data, row)
    reaching = jax.vmap(lambda u, nuisance: commands(model.vehicle, model.dt, u, nuisance))(data["inputs"], nuisances)
    place = jax.vmap(jax.vmap(lambda state: jnp.concatenate([state.x, model.acting(state)])))(states)
    numbers = plan.numbers(data, row)
    n, g, m = len(model.vehicle.state_names), place.shape[-1], place.shape[-1] + reaching.shape[-1]

    def one(sample: tuple[Any, Any, Any]) -> Any:
        here, u, volts = sample
        at = jnp.concatenate([here, u, numbers])

        def step(z: Any) -> Any:
            return model.step(z[:n], z[n:g], z[g:m], plan.layout.values(data["card"], z[m:]), volts)

        return jax.vmap(lambda t: jax.jvp(step, (at,), (t,)), out_axes=(None, -1))(jnp.eye(at.size))

    samples = (place, reaching, data["voltage"])
    flat = jax.tree.map(lambda rows: rows.reshape(-1, *rows.shape[2:]), samples)
    following, slopes = jax.lax.map(one, flat, batch_size=_TOGETHER)
    shape = data["voltage"].shape
    return place, reaching, following.reshape(*shape, n), slopes.reshape(*shape, n, -1)


@_compiled
def _straightened(plan: FilterPlan, data: Any, row: Any, planes: tuple[Any, Any, Any, Any]) -> Any:
    """Derivatives by the row of the filter that steps along tangent planes."""
    model = plan.model
    here = plan.numbers(data, row)

    def residuals(row: Any) -> Any:
        parameters, nuisances, noise = unpack(plan, data, row)
        moved = plan.numbers(data, row) - here

        def one(
            y: Any, u: Any, voltage: Any, value: Any, rate: Any, velocity: Any, nuisance: Nuisance, planes: Any
        ) -> Any:
            place, commanded, following, slopes = planes
            reaching, gain, start = _beginning(model, u, voltage, (value, rate, velocity), parameters, noise, nuisance)
            g, m = place.shape[1], place.shape[1] + commanded.shape[1]
            pushed = jnp.einsum("nij,nj->ni", slopes[:, :, g:m], reaching - commanded) + slopes[:, :, m:] @ moved

            def advance(x: Any, acting: Any, now: tuple[Any, Any, Any]) -> Any:
                following, place, by_place = now
                return following + by_place @ (jnp.concatenate([x, acting]) - place)

            along = (following + pushed, place, slopes[:, :, :g])
            return model.run(start, y, advance, along, noise, nuisance, gain)[0], gain.covariance

        return jax.vmap(one)(*_by_record(data), nuisances, planes)

    return jax.vmap(lambda t: jax.jvp(residuals, (row,), (t,))[1])(jnp.eye(row.shape[0]))
