"""Many vehicles at once: the same equations under `vmap`, with the state axis first."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, Protocol

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from swashplate.engine.equations import Equations
from swashplate.flights.flight import Flight
from swashplate.jax_on_demand import jax, jit, jnp
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.dynamics import row_rates
from swashplate.simulation.record import check_divergence, simulated_flight
from swashplate.simulation.runge_kutta import rk4_step
from swashplate.simulation.trigonometry import vector_backend

Precision = Literal["float64", "float32"]


_MANY_STEPS = 1_000_000
"""Steps of all vehicles together from which the four stages are written out instead of looped.

Written out, a CoaX is traced and compiled in 5.0 instead of 1.9 s and a raptor50 in 8.1 instead of 2.9 s; looped, a
step takes up to 2 us longer in float32.
"""

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


class FlyBatch(Protocol):
    """What flies many vehicles: `fly_batch` here by XLA, or their own C (`export.batch_c`)."""

    def __call__(
        self,
        equations: Equations,
        x0: NDArray[Any],
        rows: NDArray[Any],
        p: NDArray[Any],
        dt: NDArray[Any],
        /,
        *,
        keep: int,
        held: bool,
    ) -> NDArray[Any]:
        """As `trajectories`."""


def fly_batch(
    equations: Equations,
    x0: NDArray[Any],
    rows: NDArray[Any],
    p: NDArray[Any],
    dt: NDArray[Any],
    *,
    keep: int,
    held: bool,
) -> NDArray[Any]:
    """`trajectories`, on a CPU in blocks of `BLOCK` vehicles spread over the cores by threads; arguments as there."""
    count, on_cpu = x0.shape[1], jax.default_backend() == "cpu"
    fly = partial(trajectories, keep=keep, held=held, looped=on_cpu and (len(rows) - 1) * count < _MANY_STEPS)
    if not on_cpu or count <= BLOCK:
        return np.asarray(fly(equations, x0, rows, p, dt))

    def part(values: NDArray[Any], first: int) -> NDArray[Any]:
        return values if values.shape[-1] == 1 else values[..., first : first + BLOCK]

    def block(first: int) -> NDArray[Any]:
        arguments = (part(values, first) for values in (x0, rows, p))
        return np.asarray(fly(equations, *arguments, dt))

    with ThreadPoolExecutor(os.cpu_count()) as threads:
        return np.concatenate(list(threads.map(block, range(0, count, BLOCK))), axis=2)


@jit(static_argnums=0, static_argnames=("keep", "held", "looped"))
def trajectories(
    equations: Equations,
    x0: Float[jax.Array, "states vehicles"],
    rows: Float[jax.Array, "samples driving shared"],
    p: Float[jax.Array, "parameters shared"],
    dt: Float[jax.Array, ""],
    *,
    keep: int,
    held: bool,
    looped: bool = False,
) -> Any:
    """States at every `keep`-th sample, shape (n // keep + 1, n_states, n_vehicles).

    Args:
        equations: of which vehicle.
        x0: shape (n_states, n_vehicles).
        rows: driving rows, shape (n, n_inputs + 4, n_vehicles or 1).
        p: parameter rows, shape (n_parameters + 2, n_vehicles or 1).
        dt: step length [s].
        keep: every how many steps a sample is kept.
        held: whether what drives is held between samples, or linear.
        looped: the four stages in an inner loop, for few steps.
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
        def drive(fraction: float | Float[jax.Array, ""]) -> Any:
            return w0 if held else w0 + fraction * (w1 - w0)

        return rk4_step(lambda x, w: rates(x, w, p), x, drive, dt, looped=looped)

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
