"""Likelihoods of any vehicle's errors along records: output errors, and innovations around the nonlinear equations.

Nothing here knows what flies. What is measured is a state, a state's rate or the specific force, and what disturbs is
white noise on every state's rate. The filter's gain is constant, from the slopes where the record begins (filter error
method for nonlinear systems: Jategaonkar 2015, sec. 5.5). Noise is gathered over a sample, where his Riccati equation
is that of continuous time: there a constraint has to keep the gain from passing one (his eq. 5.35), here it cannot.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.equations import CONSTANTS, SURROUNDINGS, Equations, equations_of
from swashplate.errors import IdentificationError
from swashplate.filtering.filter_loop import Correct, Predict, filtered
from swashplate.filtering.riccati import kalman_gain
from swashplate.identification.core.multi_step import Ahead, Places
from swashplate.identification.core.parameter_row import Entry
from swashplate.identification.core.parameters import Layout, Parameterization
from swashplate.identification.core.records import Record
from swashplate.identification.core.scoring import TracedCost
from swashplate.identification.core.time_likelihood import Moved, TimeErrors, gain_entries, gust_entries
from swashplate.identification.time.prediction_error import parameter_entries
from swashplate.jax_on_demand import jax, jit, jnp
from swashplate.models.nesting import leaves
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.compilation import QUICK_TO_COMPILE
from swashplate.simulation.dynamics import row_force, row_rates
from swashplate.simulation.gathered_noise import gathered_noise
from swashplate.simulation.runge_kutta import rk4_step

FORCES = ("ax", "ay", "az")
"""Channels of the specific force, in the order in which a vehicle gives it."""


def measurable(vehicle: Vehicle) -> tuple[str, ...]:
    """Names of the channels that a vehicle's equations predict: its states, their rates and the specific force."""
    return (*vehicle.state_names, *(f"{name}dot" for name in vehicle.state_names), *FORCES)


def check_predicted(vehicle: Vehicle, outputs: Sequence[str]) -> None:
    """That a vehicle's equations predict some channels.

    Raises:
        IdentificationError: naming those that they do not, and those that they do.
    """
    known = measurable(vehicle)
    strange = [name for name in outputs if name not in known]
    if strange:
        raise IdentificationError(
            f"'{vehicle.name}' does not predict it.",
            channel=", ".join(strange),
            hint=f"Its outputs may be {', '.join(known)}.",
        )


class VehicleErrors(TimeErrors):
    """The likelihood of a vehicle's output errors, or of its innovations.

    Args:
        table: free parameters and ties.
        records: with what `measurable` names as outputs.
        method: "output-error", "filter-error" (a Kalman gain from the intensities of white noise on every state's rate;
            innovations count by their variances, as in Jategaonkar's program) or "prediction-error" (a free gain).
        environment: wind, density and gravity; the records have the voltage.
        shifts, biases: see `TimeErrors`.

    Raises:
        IdentificationError: an output that the equations do not predict.
    """

    def __init__(
        self,
        table: Parameterization,
        records: Sequence[Record],
        *,
        method: str,
        environment: Environment,
        shifts: bool,
        biases: Sequence[str],
    ) -> None:
        vehicle, outputs = table.vehicle, records[0].output_names
        check_predicted(vehicle, outputs)
        self.table, self.method = table, method
        super().__init__(
            parameter_entries(table),
            states=vehicle.state_names,
            outputs=outputs,
            records=records,
            rest=dict(zip(vehicle.state_names, map(float, leaves(vehicle.state)), strict=True)),
            shifts=shifts,
            biases=biases,
        )
        self._plans = [self._plan(number, record) for number, record in enumerate(records)]
        around = environment_of(vehicle, environment)
        self._data = [_data(record, around) for record in records]
        self._given = {
            "card": jnp.asarray(table.card_row),
            "constants": jnp.asarray([getattr(around, name) for name in CONSTANTS], dtype=float),
        }

    def _plan(self, number: int, record: Record) -> _Plan:
        def places(pattern: str, names: Sequence[str]) -> tuple[int, ...]:
            return tuple(self._place.get(pattern.format(name), _NOWHERE) for name in names)

        states = self.table.vehicle.state_names
        gains = [f"gain {s}/{o}" for s in states for o in self.outputs]
        return _Plan(
            equations=equations_of(self.table.vehicle),
            layout=self.table.layout,
            outputs=self.outputs,
            dt=round(record.dt, 9),
            method=self.method,
            start=places(f"start {{}}[{number}]", states),
            shift=places(f"shift {{}}[{number}]", states),
            bias=places(f"bias {{}}[{number}]", self.outputs),
            gust=places("gust {}", states),
            gain=places("{}", gains),
        )

    def _noise_entries(self, size: Mapping[str, float], spread: Mapping[str, float]) -> list[Entry]:
        states = self.table.vehicle.state_names
        if self.method == "filter-error":
            return gust_entries(states, size)
        return gain_entries(states, size, spread) if self.method == "prediction-error" else []

    def _covariance(self, errors: Array) -> Array:
        whole = super()._covariance(errors)
        return np.diag(np.diag(whole)) if self.method == "filter-error" else whole

    def _plain(self, row: Array) -> Array:
        numbers, given = jnp.asarray(row * self.row.scale), self._given | {"sensors": jnp.asarray(self.covariance)}
        parts = [_errors(p, given, d, numbers) for p, d in zip(self._plans, self._data, strict=True)]
        return np.concatenate([np.asarray(part) for part in parts])

    def _moved(self, row: Array) -> Iterator[Moved]:
        numbers, scale = jnp.asarray(row * self.row.scale), jnp.asarray(self.row.scale)
        given, every = self._given | {"sensors": jnp.asarray(self.covariance)}, np.arange(len(self.row))
        for plan, data in zip(self._plans, self._data, strict=True):
            errors, slopes = _slopes(plan, given, data, numbers, scale)
            yield every, np.asarray(errors), np.asarray(slopes)

    def traced(self) -> TracedCost:
        """The cost as a function that JAX differentiates; a Kalman gain keeps the sensors' noise of the last row."""
        data = {
            "given": self._given | {"sensors": jnp.asarray(self.covariance)},
            "records": self._data,
            "scale": jnp.asarray(self.row.scale),
            "floor": jnp.asarray(self.floor),
        }
        return TracedCost(_traced_cost, tuple(self._plans), data)

    def errors_ahead(self, row: Array, ahead: Ahead) -> list[Array]:
        """Per record, measured less predicted from the filter's states, (starts, horizons, outputs)."""
        numbers, given = jnp.asarray(row * self.row.scale), self._given | {"sensors": jnp.asarray(self.covariance)}
        return [
            np.asarray(_ahead(p, ahead.steps, given, d, jnp.asarray(starts, dtype=int), numbers))
            for p, d, starts in zip(self._plans, self._data, ahead.starts, strict=True)
        ]

    def errors_ahead_moved(self, row: Array, ahead: Ahead, places: Places) -> tuple[list[Array], list[Array]]:
        """The same, and the slopes by some entries of the scaled row, (places, starts, horizons, outputs)."""
        numbers, given = jnp.asarray(row * self.row.scale), self._given | {"sensors": jnp.asarray(self.covariance)}
        directions = jnp.asarray(np.diag(self.row.scale)[places])
        parts = [
            _ahead_moved(p, ahead.steps, given, d, jnp.asarray(starts, dtype=int), numbers, directions)
            for p, d, starts in zip(self._plans, self._data, ahead.starts, strict=True)
        ]
        return [np.asarray(errors) for errors, _ in parts], [np.asarray(slopes) for _, slopes in parts]


_NOWHERE = -1
"""Place of a number that is not estimated: the zero that stands behind the row."""


@dataclass(frozen=True)
class _Plan:
    """What compiled code depends on: everything but numbers; places are those in the row."""

    equations: Equations
    layout: Layout
    outputs: tuple[str, ...]
    dt: float
    method: str
    start: tuple[int, ...]
    shift: tuple[int, ...]
    bias: tuple[int, ...]
    gust: tuple[int, ...]
    gain: tuple[int, ...]


def driving_rows(record: Record, environment: Environment) -> Array:
    """Inputs, wind and voltage of a record at every sample, (n, n_driving)."""
    wind = [np.full(record.time.size, float(getattr(environment, name))) for name in SURROUNDINGS[:-1]]
    return np.column_stack([record.inputs, *wind, record.voltage])


def _data(record: Record, environment: Environment) -> dict[str, Any]:
    """What a record gives: the driving row at every sample, and what was measured."""
    return {"driving": jnp.asarray(driving_rows(record, environment)), "outputs": jnp.asarray(record.outputs)}


@dataclass(frozen=True)
class _Filter:
    """A filter with all its numbers (traced): where it starts, what holds at each sample, and its functions."""

    start: Any
    along: tuple[Any, Any]
    correct: Correct
    predict: Predict
    expected: Callable[[Any, Any], Any]


def _filter(plan: _Plan, given: Mapping[str, jax.Array], data: Mapping[str, jax.Array], numbers: jax.Array) -> _Filter:
    """The filter of one record."""
    vehicle = plan.equations.vehicle
    row = jnp.append(numbers, 0.0)

    def at(places: tuple[int, ...]) -> Any:
        return row[jnp.array(places)]

    free = numbers[: len(plan.layout.free)]
    p = jnp.concatenate([jnp.stack(list(plan.layout.values(given["card"], free))), given["constants"]])
    equations, force = row_rates(plan.equations, padded=False), row_force(plan.equations)
    shift, bias = at(plan.shift), at(plan.bias)

    def rates(x: Any, w: Any) -> Any:
        return equations(x, w, p) + shift

    def expected(x: Any, w: Any) -> Any:
        every = jnp.concatenate([x, rates(x, w), force(x, w, p)])
        return every[jnp.array([measurable(vehicle).index(name) for name in plan.outputs])] + bias

    driving, start = data["driving"], at(plan.start)
    gain = _gain(plan, at, given["sensors"], (rates, expected), (start, driving[0]))

    def correct(x: Any, measured: Any, now: tuple[Any, Any]) -> tuple[Any, Any]:
        error = measured - expected(x, now[0])
        # As a sum of products: XLA makes one function of a loop that calls no matrix product.
        return x if gain is None else x + jnp.sum(gain * error, axis=1), error

    def predict(x: Any, now: tuple[Any, Any]) -> Any:
        w, after = now
        return rk4_step(rates, x, lambda share: w + share * (after - w), plan.dt, looped=True)

    after = jnp.concatenate([driving[1:], driving[-1:]])
    return _Filter(start, (driving, after), correct, predict, expected)


def _traced_errors(plan: _Plan, given: Any, data: Any, numbers: Any) -> Any:
    """Errors of one record (n, n_outputs): measured less predicted from earlier samples (output error: from none)."""
    f = _filter(plan, given, data, numbers)
    return filtered(f.start, data["outputs"], f.along, correct=f.correct, predict=f.predict)[1][0]


def _traced_cost(plans: tuple[_Plan, ...], data: Mapping[str, Any], row: jax.Array) -> Any:
    """Negative log-likelihood at its own covariance, without constants (traceable), as `TimeErrors.cost` has it."""
    numbers = row * data["scale"]
    parts = [_traced_errors(p, data["given"], d, numbers) for p, d in zip(plans, data["records"], strict=True)]
    errors = jnp.concatenate(parts)
    covariance = errors.T @ errors / len(errors) + jnp.diag(data["floor"])
    if plans[0].method == "filter-error":
        return 0.5 * len(errors) * jnp.log(jnp.diag(covariance)).sum()
    return 0.5 * len(errors) * jnp.linalg.slogdet(covariance)[1]


def _traced_ahead(
    plan: _Plan,
    steps: tuple[int, ...],
    given: Mapping[str, jax.Array],
    data: Mapping[str, jax.Array],
    starts: jax.Array,
    numbers: jax.Array,
) -> Any:
    """Measured less predicted, `steps` samples after the filter's state at each start (starts, horizons, outputs)."""
    f = _filter(plan, given, data, numbers)
    _, states = filtered(f.start, data["outputs"], f.along, correct=f.correct, predict=f.predict)[1]

    def run(start: jax.Array) -> Any:
        def sample(x: jax.Array, k: jax.Array) -> tuple[Any, Any]:
            following = f.predict(x, jax.tree.map(lambda rows: rows[k], f.along))
            return following, f.expected(following, f.along[1][k])

        told = jax.lax.scan(sample, states[start], start + jnp.arange(steps[-1]))[1]
        return data["outputs"][start + jnp.array(steps)] - told[jnp.array(steps) - 1]

    return jax.vmap(run)(starts)


_ahead = jit(static_argnums=(0, 1), compiler_options=QUICK_TO_COMPILE)(_traced_ahead)


@jit(static_argnums=(0, 1), compiler_options=QUICK_TO_COMPILE)
def _ahead_moved(
    plan: _Plan,
    steps: tuple[int, ...],
    given: Mapping[str, jax.Array],
    data: Mapping[str, jax.Array],
    starts: jax.Array,
    numbers: jax.Array,
    directions: jax.Array,
) -> tuple[Any, Any]:
    """The errors ahead and their slopes along directions of the row (directions, starts, horizons, outputs)."""

    def errors(moved: jax.Array) -> Any:
        return _traced_ahead(plan, steps, given, data, starts, moved)

    return jax.vmap(lambda d: jax.jvp(errors, (numbers,), (d,)), out_axes=(None, 0))(directions)


_errors = jit(static_argnums=0, compiler_options=QUICK_TO_COMPILE)(_traced_errors)


def _gain(plan: _Plan, at: Any, sensors: Any, functions: Any, place: Any) -> Any:
    """From an innovation to the state, (n_states, n_outputs); None for output error."""
    n = len(plan.start)
    if plan.method == "output-error":
        return None
    if plan.method == "prediction-error":
        return at(plan.gain).reshape(n, -1)
    A, C = (jax.jacfwd(function)(*place) for function in functions)
    phi, gathered = gathered_noise(A, jnp.diag(jnp.exp(2.0 * at(plan.gust))), plan.dt)
    return kalman_gain(phi, C, gathered, sensors)[0]


@jit(static_argnums=0, compiler_options=QUICK_TO_COMPILE)
def _slopes(plan: _Plan, given: Any, data: Any, numbers: Any, scale: Any) -> tuple[Any, Any]:
    """Errors, and their slopes by every scaled entry of the row (n_entries, n, n_outputs)."""

    def errors(moved: Any) -> Any:
        return _traced_errors(plan, given, data, moved)

    directions = jnp.diag(scale)
    return jax.vmap(lambda d: jax.jvp(errors, (numbers,), (d,)), out_axes=(None, 0))(directions)
