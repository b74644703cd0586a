"""Many vehicles at once: the same equations under `vmap`, with the state axis first."""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike, NDArray

from swashplate.errors import CardError, FlightError, SwashError
from swashplate.flights.flight import Flight
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.driving import Interpolation
from swashplate.simulation.dynamics import (
    SURROUNDINGS,
    Equations,
    enable_double_precision,
    equations_of,
    parameter_row,
    row_rates,
)
from swashplate.simulation.late import Delays, acting_rows
from swashplate.simulation.record import check_divergence, simulated_flight
from swashplate.simulation.runge_kutta import rk4_step
from swashplate.simulation.trigonometry import vector_backend
from swashplate.simulation.trim import Trim, start_row, surroundings_of_start

Precision = Literal["float64", "float32"]


BLOCK = 1024
"""Vehicles per block: the states of a block stay in a core's cache, and a block keeps one core busy by itself."""


@dataclass(frozen=True)
class Batch:
    """Flights of many vehicles.

    Attributes:
        vehicle: their equations.
        time: of the kept samples [s], shape (n,).
        states: shape (n, n_states, n_vehicles).
        rows: inputs and surroundings at the kept samples, shape (n, n_inputs + 4, n_vehicles or 1).
    """

    vehicle: Vehicle
    time: NDArray[np.float64]
    states: NDArray[Any]
    rows: NDArray[Any]

    def __len__(self) -> int:
        return int(self.states.shape[2])

    def __getitem__(self, name: str) -> NDArray[Any]:
        """One state of all vehicles, shape (n, n_vehicles)."""
        return self.states[:, self.vehicle.index(name), :]

    def flight(self, number: int) -> Flight:
        """The flight of one vehicle.

        Raises:
            DivergenceError: where that vehicle diverged.
        """
        states = np.asarray(self.states[:, :, number], dtype=np.float64)
        rows = np.asarray(self.rows[:, :, min(number, self.rows.shape[2] - 1)], dtype=np.float64)
        flight = simulated_flight(self.vehicle, self.time, states, rows, details={"number": number})
        check_divergence(self.vehicle, self.time, states, flight)
        return flight


def simulate_batch(
    vehicle: Vehicle,
    inputs: Mapping[str, ArrayLike],
    *,
    parameters: Mapping[str, ArrayLike] | None = None,
    start: Trim | Mapping[str, ArrayLike] | None = None,
    size: int | None = None,
    rate: float = 100.0,
    interpolation: Interpolation = "held",
    environment: Environment | None = None,
    delays: Delays = None,
    keep: int = 1,
    precision: Precision = "float64",
) -> Batch:
    """Fly many vehicles of one kind at once; agrees with `simulate` to 1e-11 in float64.

    Args:
        vehicle: their equations and the numbers that `parameters` does not replace.
        inputs: series by input name (and wind, voltage), shape (n,) for all alike or (n, n_vehicles).
        parameters: numbers of the card by name, shape (n_vehicles,) each.
        start: one trim for all, or states by name, a number or shape (n_vehicles,) each.
        size: number of vehicles, needed where nothing else says it.
        rate: steps per second [Hz].
        interpolation: inputs "held" or "linear" between samples.
        environment: air, gravity, and wind and voltage where `inputs` has none; by default as in `simulate`.
        delays: as in `simulate`.
        keep: every how many steps a sample is kept (memory: 8 x 18 bytes per sample and vehicle).
        precision: "float32" is faster and loses about nine digits.
    """
    enable_double_precision()
    surroundings = surroundings_of_start(vehicle, start, environment)
    numbers = {name: np.asarray(values, dtype=np.float64) for name, values in (parameters or {}).items()}
    for name in numbers:
        if name not in vehicle.parameter_names:
            raise CardError("is not a parameter of the vehicle.", where=vehicle.name, channel=name)
    series = _series(vehicle, inputs, surroundings)
    states = {} if start is None or isinstance(start, Trim) else {k: np.asarray(v, float) for k, v in start.items()}
    count = _count(size, numbers, states, series)
    steps = next(iter(series.values())).shape[0] - 1
    if keep < 1 or steps < 1:
        raise SwashError(f"keep is {keep} and there are {steps} steps, expected at least 1 of each.")

    rows = np.stack([series[name] for name in (*vehicle.input_names, *SURROUNDINGS)], axis=1)
    p = np.repeat(parameter_row(vehicle, surroundings)[:, None], count if numbers else 1, axis=1)
    for name, values in numbers.items():
        p[vehicle.parameter_names.index(name)] = values
    fixed = start if isinstance(start, Trim) else {k: float(v) for k, v in states.items() if not v.ndim}
    first = surroundings._replace(**dict(zip(SURROUNDINGS, rows[0, len(vehicle.input_names) :, 0], strict=True)))
    x0 = np.repeat(start_row(vehicle, fixed, first)[:, None], count, axis=1)
    for name, values in states.items():
        if values.ndim:
            x0[vehicle.index(name)] = values

    dtype = np.dtype(precision)
    acting = acting_rows(vehicle, rows, rate=rate, delays=delays, start=start, environment=first)
    arguments = (np.asarray(values, dtype) for values in (x0, acting, p, 1.0 / rate))
    later = fly_batch(equations_of(vehicle), *arguments, keep=keep, held=interpolation == "held")
    kept = np.arange(0, steps + 1, keep)
    return Batch(vehicle, kept / rate, np.asarray(later)[: kept.size], rows[kept])


def fly_batch(
    equations: Equations, x0: NDArray[Any], rows: NDArray[Any], p: NDArray[Any], dt: Any, *, keep: int, held: bool
) -> NDArray[Any]:
    """`trajectories`, on a CPU in blocks of `BLOCK` vehicles spread over the cores by threads; arguments as there."""
    count = x0.shape[1]
    if jax.default_backend() != "cpu" or count <= BLOCK:
        return np.asarray(trajectories(equations, x0, rows, p, dt, keep=keep, held=held))

    def part(values: NDArray[Any], first: int) -> NDArray[Any]:
        return values if values.shape[-1] == 1 else values[..., first : first + BLOCK]

    def block(first: int) -> NDArray[Any]:
        arguments = (part(values, first) for values in (x0, rows, p))
        return np.asarray(trajectories(equations, *arguments, dt, keep=keep, held=held))

    with ThreadPoolExecutor(os.cpu_count()) as threads:
        return np.concatenate(list(threads.map(block, range(0, count, BLOCK))), axis=2)


@partial(jax.jit, static_argnums=0, static_argnames=("keep", "held"))
def trajectories(
    equations: Equations,
    x0: Float[jax.Array, "states vehicles"],
    rows: Float[jax.Array, "samples driving shared"],
    p: Float[jax.Array, "parameters shared"],
    dt: Float[jax.Array, ""],
    *,
    keep: int,
    held: bool,
) -> Any:
    """States at every `keep`-th sample, shape (n // keep + 1, n_states, n_vehicles).

    Args:
        equations: of which vehicle.
        x0: shape (n_states, n_vehicles).
        rows: driving rows, shape (n, n_inputs + 4, n_vehicles or 1).
        p: parameter rows, shape (n_parameters + 2, n_vehicles or 1).
        dt: step length [s].
        keep, held: see `simulate_batch`.
    """
    rates = row_rates(equations, padded=False, xp=vector_backend())
    shared_rows, shared_p = rows.shape[2] == 1, p.shape[1] == 1
    axes = (1, None if shared_rows else 1, None if shared_rows else 1, None if shared_p else 1)

    def one(
        x: Float[jax.Array, " states"],
        w0: Float[jax.Array, " driving"],
        w1: Float[jax.Array, " driving"],
        p: Float[jax.Array, " parameters"],
    ) -> Any:
        # Stages written out: an inner loop compiles twice as fast but runs 2.3 times slower in float32 (measured).
        middle = w0 if held else 0.5 * (w0 + w1)
        drive = {0.0: w0, 0.5: middle, 1.0: w0 if held else w1}
        return rk4_step(lambda x, w: rates(x, w, p), x, drive.__getitem__, dt, looped=False)

    many = jax.vmap(one, axes, 1)
    flat_rows = rows[:, :, 0] if shared_rows else rows
    flat_p = p[:, 0] if shared_p else p

    def step(x: Float[jax.Array, "states vehicles"], ends: tuple[Any, ...]) -> tuple[Any, None]:
        before, after = ends
        return many(x, before, after, flat_p), None

    def block(x: Float[jax.Array, "states vehicles"], ends: tuple[Any, ...]) -> tuple[Any, Any]:
        after, _ = jax.lax.scan(step, x, ends)
        return after, after

    n = (rows.shape[0] - 1) // keep
    ends = tuple(part[: n * keep].reshape(n, keep, *part.shape[1:]) for part in (flat_rows[:-1], flat_rows[1:]))
    _, later = jax.lax.scan(block, x0, ends)
    return jnp.concatenate([x0[None], later])


def _series(
    vehicle: Vehicle, inputs: Mapping[str, ArrayLike], environment: Environment
) -> dict[str, NDArray[np.float64]]:
    """Every driving series with shape (n, n_vehicles or 1), all of one width."""
    constants = {name: np.asarray(getattr(environment, name), dtype=np.float64) for name in SURROUNDINGS}
    given = {**constants, **{name: np.asarray(values, dtype=np.float64) for name, values in inputs.items()}}
    for name in vehicle.input_names:
        if name not in given:
            raise FlightError(f"is missing; '{vehicle.name}' is driven by it.", channel=name)
    length = max((values.shape[0] for values in given.values() if values.ndim), default=0)
    width = max((values.shape[1] for values in given.values() if values.ndim == 2), default=1)
    series = {}
    for name, values in given.items():
        column = values[:, None] if values.ndim == 1 else values
        try:
            series[name] = np.broadcast_to(column, (length, width))
        except ValueError:
            raise FlightError(f"has shape {values.shape}, others ({length}, {width}).", channel=name) from None
        if not np.all(np.isfinite(column)):
            raise FlightError("is not a number somewhere.", channel=name)
    return series


def _count(size: int | None, *groups: Mapping[str, NDArray[np.float64]]) -> int:
    numbers, states, series = groups
    found = {v.shape[0] for group in (numbers, states) for v in group.values() if v.ndim}
    found |= {v.shape[1] for v in series.values() if v.shape[1] > 1}
    found |= set() if size is None else {size}
    if len(found) != 1:
        raise SwashError(f"the number of vehicles is {sorted(found) or 'not given'}, expected one number (size=...).")
    return int(found.pop())
