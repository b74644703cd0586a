"""Many closed loops at once: one controller on many vehicles, each in its own gusts, with its own sensor noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swashplate.arrays import Array
from swashplate.engine.equations import SURROUNDINGS, parameter_row
from swashplate.engine.fly import FlightPlan, Steering, fly
from swashplate.engine.law import REFERENCES
from swashplate.errors import CardError, SwashError
from swashplate.flights.flight import Flight
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.closed_loop import flown_delays, limits_of
from swashplate.simulation.controller import Controller
from swashplate.simulation.record import check_divergence, simulated_flight, steps_late
from swashplate.simulation.trim import Trim, surroundings_of_start
from swashplate.simulation.trim import trim as find_trim

Precision = Literal["float64", "float32"]


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


_BLOCK = 256
"""Vehicles flown at a time: what their sensors draw, and tables of their own, are made for so many."""


def simulate_closed_loops(
    vehicle: Vehicle,
    controller: Controller,
    *,
    duration: float,
    size: int,
    parameters: Mapping[str, ArrayLike] | None = None,
    reference: Mapping[str, ArrayLike] | None = None,
    excitation: Mapping[str, ArrayLike] | None = None,
    wind: Mapping[str, ArrayLike] | None = None,
    voltage: ArrayLike | None = None,
    noise: Mapping[str, float] | None = None,
    delay: ArrayLike = 0.0,
    delays: Mapping[str, float] | float | None = None,
    seed: int = 0,
    start: Trim | None = None,
    rate: float = 500.0,
    keep: int = 1,
    environment: Environment | None = None,
    bits: int | None = None,
) -> Batch:
    """Fly one controller on many vehicles; without noise it agrees with `simulate_closed_loop` at the same rates.

    Args:
        vehicle: the equations and the numbers that `parameters` does not replace.
        controller: see `swashplate.simulation.closed_loop.Controller`; the same for all.
        duration: [s].
        size: number of vehicles.
        parameters: numbers of the card by name, shape (size,) each.
        reference: as in `simulate_closed_loop`, numbers or series (n,) at the controller's rate, the same for all.
        excitation: series (n,) by input name at the controller's rate, added to every vehicle's commands.
        wind, voltage: numbers, series (n,) or (n, size) at the controller's rate, held between samples.
        noise: standard deviation of the white noise on a measured state, by its name [its unit].
        delay: by how much more the commands of each vehicle are late [s], a number or shape (size,).
        delays: from command to actuator [s], one for all or by input; where not given those of `flown_delays`. The sum
            is rounded up to the steps of the physics. Before the first command arrives the actuators get those of the
            start.
        seed: of that noise.
        start: where all start; the hover of `vehicle` where it is not given.
        rate: of the physics [Hz], a whole multiple of the controller's.
        keep: every how many samples of the controller one is kept.
        environment: air, gravity, and wind and voltage where they are not given.
        bits: in which a command is told over the range of its input; None for exact commands.

    Returns:
        States, inputs and surroundings at the kept samples. A vehicle that is lost has numbers that are not finite.
        One that pitches beyond 80 degrees is integrated with a quaternion, as by `simulate_open_loop`.
    """
    substeps = rate / controller.rate
    if substeps < 1.0 or abs(substeps - round(substeps)) > 1e-9:
        raise SwashError(
            f"the physics runs at {rate:g} Hz, expected a multiple of the controller's {controller.rate:g}."
        )
    samples = round(duration * controller.rate) // keep * keep
    if samples < 1 or size < 1:
        raise SwashError(f"{samples} samples of {size} vehicles, expected at least one of each.")
    begin = start or find_trim(vehicle, environment=environment)
    surroundings = surroundings_of_start(vehicle, begin, environment)
    given: dict[str, Any] = {**(wind or {}), **({} if voltage is None else {"voltage": voltage})}
    around = np.stack(
        [_series(name, given.get(name, getattr(surroundings, name)), samples, size) for name in SURROUNDINGS], 1
    )
    states = begin.states()
    wanted = np.stack(
        [_series(n, (reference or {}).get(n, states.get(n, 0.0)), samples, 1)[:, 0] for n in REFERENCES], 1
    )
    added = np.stack([_series(n, (excitation or {}).get(n, 0.0), samples, 1)[:, 0] for n in vehicle.input_names], 1)
    p = np.repeat(parameter_row(vehicle, surroundings)[:, None], size, axis=1)
    for name, values in (parameters or {}).items():
        if name not in vehicle.parameter_names:
            raise CardError("is not a parameter of the vehicle.", where=vehicle.name, channel=name)
        p[vehicle.parameter_names.index(name)] = values
    further = np.broadcast_to(np.asarray(delay, dtype=np.float64), (size,))
    if not np.all(further >= 0.0):
        raise SwashError("is negative or no number.", channel="delay")
    steps_behind = steps_late(flown_delays(vehicle, controller, delays=delays)[:, None] + further, rate)
    sigma = np.zeros(len(vehicle.state_names))
    for name, value in (noise or {}).items():
        sigma[vehicle.index(name)] = value
    every, law = round(substeps), controller.law(vehicle)

    def block(first: int) -> tuple[Array, Array]:
        members = np.arange(first, min(first + _BLOCK, size))
        plan = FlightPlan(
            np.repeat(begin.state[:, None], len(members), axis=1),
            p[:, members],
            around if around.shape[2] == 1 else around[:, :, members],
            1.0 / rate,
            hold=every,
            keep=every * keep,
            samples=(samples - 1) * every + 1,
            steering=Steering(
                law,
                np.stack([controller.memory_of_law(seed + int(i)) for i in members], axis=1),
                every,
                wanted[:, :, None],
                added[:, :, None],
                limits_of(vehicle, bits),
                steps_behind[:, members],
                begin.inputs,
                np.stack([controller.draws(samples, seed + int(i)) for i in members], axis=2),
                _noise(sigma, samples, members, seed) if np.any(sigma) else None,
            ),
        )
        return fly(vehicle, plan)

    parts = [block(first) for first in range(0, size, _BLOCK)]
    flown, inputs = (np.concatenate([part[i] for part in parts], axis=2) for i in (0, 1))
    kept = np.broadcast_to(around[::keep], (inputs.shape[0], len(SURROUNDINGS), size))
    rows = np.concatenate([inputs, kept], axis=1)
    return Batch(vehicle, np.arange(flown.shape[0]) * keep / controller.rate, flown, rows)


def _noise(sigma: Array, samples: int, members: NDArray[np.int_], seed: int) -> Array:
    """White noise on the measured states, shape (samples, states, members); each vehicle has its own."""
    drawn = [np.random.default_rng([seed, int(i)]).standard_normal((samples, len(sigma))) for i in members]
    return np.stack(drawn, axis=2) * sigma[:, None]


def _series(name: str, values: ArrayLike, samples: int, size: int) -> Array:
    """A series (samples, size or 1) from a number, (n,) or (n, size) with n at least the samples."""
    given = np.asarray(values, dtype=np.float64)
    if given.ndim == 0:
        return np.full((samples, 1 if size == 1 else size), float(given))
    table = given[:, None] if given.ndim == 1 else given
    if table.shape[0] < samples or table.shape[1] not in (1, size):
        raise SwashError(f"has shape {given.shape}, expected ({samples}, {size}) or ({samples},).", channel=name)
    return np.broadcast_to(table[:samples], (samples, size))
