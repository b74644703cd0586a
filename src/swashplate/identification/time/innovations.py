"""The innovations of some records as a function of one row of numbers: side by side by NumPy, and traceable.

A fit runs the compiled pieces of `record_filter`, which know nothing of rows; what a row means is here. The traceable
form is for what JAX differentiates as a whole: posteriors, and predictions some time ahead.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.filtering.arriving_commands import commands, commands_by, commands_moved
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import FilterState, StochasticModel
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.parameters import Layout
from swashplate.identification.core.robust import losses
from swashplate.identification.time.beginning import (
    Begun,
    FilterNumbers,
    FirstMotion,
    begun,
    begun_moved,
    first_state,
    starting_samples,
    traced_begin,
)
from swashplate.identification.time.compiled_filter import FilterRun
from swashplate.identification.time.record_filter import along, moved
from swashplate.jax_on_demand import jax, jnp


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


class Filtered(NamedTuple):
    """A record's run: commands as they arrive, numbers, beginning, innovations (n, n_outputs) and filtered states; of a
    run in C the roots that its steps found."""

    commands: Array
    numbers: FilterNumbers
    begin: Begun
    innovations: Array
    states: FilterState
    roots: Array | None = None


@dataclass(frozen=True)
class RecordRun:
    """One record as the filter runs along it.

    Attributes:
        plan: of the fit.
        log: which flight it is of.
        readings, inputs, voltage: by sample.
        seen: of its beginning.
    """

    plan: FilterPlan
    log: int
    readings: Array
    inputs: Array
    voltage: Array
    seen: FirstMotion

    def placed(self, card: Array, noise: Array, numbers: Array) -> tuple[Array, FilterNumbers]:
        """Commands as they arrive, and what the filter depends on, at a row of numbers in their units.

        Args:
            card: parameters of the card. noise: numbers of `Noise` where they are not estimated.
            numbers: the row.
        """
        model = self.plan.model
        k, n, m = len(self.plan.layout.free), self.plan.logs, len(self.plan.nuisances)
        nuisance, noise = np.zeros(len(Nuisance._fields)), noise.copy()
        nuisance[_places(Nuisance, self.plan.nuisances)] = numbers[k + self.log * m : k + (self.log + 1) * m]
        noise[_places(Noise, self.plan.noises)] = np.exp(numbers[k + n * m :])
        reaching, _ = commands_moved(model.vehicle, model.dt, self.inputs, Nuisance(*nuisance), np)
        parameters = np.array(self.plan.layout.values(card, numbers[:k]))
        starting = reaching[: starting_samples(model.dt)].mean(axis=0)
        return reaching, FilterNumbers(parameters, noise, nuisance, starting)

    def filtered(self, card: Array, noise: Array, numbers: Array) -> Filtered:
        """The run at a row, of arguments as `placed` has them."""
        reaching, at = self.placed(card, noise, numbers)
        begin = begun(self.plan.model, at, self.seen)
        return Filtered(reaching, at, begin, *along(self.plan.model, begin, at, self.readings, reaching, self.voltage))

    def moved(self, run: Filtered, card: Array, numbers: Array, scale: Array) -> tuple[Array, Array]:
        """Slopes by every scaled entry of the row: innovations (p, n, outputs), covariance (p, outputs, outputs)."""
        model, k, m, p = self.plan.model, len(self.plan.layout.free), len(self.plan.nuisances), len(numbers)
        late = commands_moved(model.vehicle, model.dt, self.inputs, Nuisance(*run.numbers.nuisance), np)[1]
        by_command = commands_by(model.vehicle, late, self.plan.nuisances)
        own, noises = k + self.log * m, _places(Noise, self.plan.noises)
        directions = FilterNumbers(
            np.zeros((p, len(run.numbers.parameters))),
            np.zeros((p, len(run.numbers.noise))),
            np.zeros((p, len(run.numbers.nuisance))),
            np.zeros((p, len(run.numbers.inputs))),
        )
        directions.parameters[:k] = self.plan.layout.moved(card, numbers[:k])
        directions.nuisance[np.arange(own, own + m), _places(Nuisance, self.plan.nuisances)] = 1.0
        directions.noise[np.arange(p - noises.size, p), noises] = run.numbers.noise[noises]
        directions.inputs[own : own + m] = by_command[:, : starting_samples(model.dt)].mean(axis=1)
        directions = FilterNumbers(*(scale[:, None] * part for part in directions))
        begin = begun_moved(model, run.numbers, self.seen, directions)
        arriving, series = by_command * scale[own : own + m, None, None], (self.readings, run.commands, self.voltage)
        went = FilterRun(run.innovations, run.states, run.roots)
        slopes = moved(model, run.begin, begin, run.numbers, directions, series, went, (own, arriving), free=k)
        return slopes, np.asarray(begin.gain.covariance)


def _places(of: Any, names: Sequence[str]) -> Any:
    return np.array([of._fields.index(name) for name in names], dtype=np.intp)


# ---- traceable -----------------------------------------------------------------------------------------------------
def unpack(plan: FilterPlan, data: Any, row: Any) -> tuple[Any, Nuisance, Noise]:
    """Equations' parameters, nuisances (one array entry per record) and noise of a scaled row."""
    numbers = row * data["scale"]
    k, n, m = len(plan.layout.free), plan.logs, len(plan.nuisances)
    block = numbers[k : k + n * m].reshape(n, m)[data["log"]]
    nuisance = Nuisance(**{name: jnp.zeros(len(block)) for name in Nuisance._fields})._replace(
        **{name: block[:, i] for i, name in enumerate(plan.nuisances)}
    )
    noise = jnp.asarray(data["noise"])
    if plan.noises:
        estimated = jnp.array([Noise._fields.index(name) for name in plan.noises])
        noise = noise.at[estimated].set(jnp.exp(numbers[k + n * m :]))
    return plan.layout.values(data["card"], numbers[:k]), nuisance, Noise(*noise)


def traced_run(
    model: StochasticModel,
    y: Any,
    u: Any,
    voltage: Any,
    seen: FirstMotion,
    *,
    parameters: Any,
    noise: Noise,
    nuisance: Nuisance,
) -> tuple[Any, Any, FilterState]:
    """Innovations, their covariance and the filtered states of one record (traceable).

    Args:
        model: the stochastic model.
        y, u, voltage: measurements, logged inputs and battery voltage by sample.
        seen: of the record's beginning.
        parameters, noise, nuisance: numbers of the equations, of the noise and of this record.
    """
    reaching = commands(model.vehicle, model.dt, u, nuisance)
    starting = jnp.mean(reaching[: starting_samples(model.dt)], axis=0)
    gain, x = traced_begin(model, FilterNumbers(parameters, noise, nuisance, starting), seen)

    def advance(x: Any, acting: Any, now: tuple[Any, Any]) -> Any:
        commanded, volts = now
        return model.step(x, acting, commanded, parameters, volts)

    first = first_state(model, x, jnp.stack([jnp.asarray(value, dtype=float) for value in nuisance]))
    _, (innovations, states) = model.run(first, y, advance, (reaching, voltage), noise, nuisance, gain)
    return innovations, gain.covariance, states


def traced_innovations(plan: FilterPlan, data: Any, row: Any) -> tuple[Any, Any, FilterState]:
    """Of all records side by side: innovations (records, n, outputs), their covariances and the filtered states."""
    parameters, nuisances, noise = unpack(plan, data, row)

    def one(y: Any, u: Any, voltage: Any, seen: FirstMotion, nuisance: Nuisance) -> Any:
        return traced_run(plan.model, y, u, voltage, seen, parameters=parameters, noise=noise, nuisance=nuisance)

    rows = (data["outputs"], data["inputs"], data["voltage"], FirstMotion(*data["seen"]))
    return jax.vmap(one)(*rows, nuisances)


def traced_cost(plan: FilterPlan, data: Mapping[str, Any], row: jax.Array) -> Any:
    """Negative log-likelihood of the counted innovations (traceable), as `PredictionError.cost` has it.

    Args:
        plan, row: as `traced_innovations` takes them.
        data: its data, and "counted" (records, n).
    """
    innovations, covariances, _ = traced_innovations(plan, data, row)
    roots = jnp.linalg.cholesky(covariances)
    white = jax.vmap(lambda L, nu: jax.scipy.linalg.solve_triangular(L, nu.T, lower=True).T)(roots, innovations)
    logarithms = jnp.log(jnp.diagonal(roots, axis1=1, axis2=2)).sum(axis=-1)
    return jnp.where(data["counted"], losses(white, jnp).sum(axis=-1) + logarithms[:, None], 0.0).sum()
