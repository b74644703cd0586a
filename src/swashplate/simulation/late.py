"""What lies between a command and its action: delays, in steps of the simulation, and steps of the command itself."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import CardError, SwashError
from swashplate.models.surroundings import complete_delays, input_delays
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.trim import Trim, trim

Delays = Mapping[str, float] | float | None


def steps_late(delays: Array, rate: float) -> NDArray[np.int_]:
    """Delays [s] in steps of a simulation at `rate` [Hz], rounded up: no command acts before it can."""
    return np.asarray(np.ceil(np.asarray(delays) * rate - 1e-6), dtype=np.int_)


def quantum_of(limits: Array, bits: int | None) -> Array:
    """The step of every input whose range is told in `bits` [its unit], shape (inputs,); zero for None.

    Args:
        limits: lowest and highest of each input, shape (inputs, 2).

    Raises:
        SwashError: for fewer than 4 or more than 24 bits.
    """
    if bits is None:
        return np.zeros(len(limits))
    if not 4 <= bits <= 24:
        raise SwashError(f"is {bits}, expected 4 to 24.", channel="bits of a command")
    return np.asarray((limits[:, 1] - limits[:, 0]) / (2**bits - 1), dtype=np.float64)


def acting_rows(
    vehicle: Vehicle,
    rows: Array,
    *,
    rate: float,
    delays: Delays,
    start: Trim | Mapping[str, Any] | None,
    environment: Environment,
) -> Array:
    """Driving rows, shape (n, n_inputs + 4, ...), as they act: every input late by its delay.

    Before the first command arrives the inputs are those of the start: a trim's, or those of rest or hover; the first
    sample where all states are given.

    Args:
        delays: [s], one for all inputs or by name; None for what the vehicle's card knows.
        start: as in `simulate`. environment: for hover.

    Raises:
        CardError: where inputs reach outputs after different times, which no simulation of states can do.
    """
    try:
        known = input_delays(vehicle) if delays is None else delays
    except CardError as told:
        raise CardError(
            told.problem, where=told.where, hint="Give one delay per input as `delays`, or 0 for none."
        ) from None
    late = steps_late(np.array(list(complete_delays(vehicle, known).values())), rate)
    if not late.any():
        return rows
    before = _inputs_before(vehicle, rows, start, environment)
    acting = rows.copy()
    for i, steps in enumerate(np.minimum(late, len(rows))):
        if steps:
            acting[:, i] = np.concatenate([np.broadcast_to(before[i], rows[:steps, i].shape), rows[:-steps, i]])
    return acting


def _inputs_before(
    vehicle: Vehicle, rows: Array, start: Trim | Mapping[str, Any] | None, environment: Environment
) -> Array:
    if isinstance(start, Trim):
        return np.asarray(start.inputs)
    if vehicle.traits.rest is not None:
        card = vehicle.card.values()
        return np.array([card.get(f"trim_{name}", 0.0) for name in vehicle.input_names])
    if start and set(start) >= set(vehicle.state_names):
        return np.asarray(rows[0, : len(vehicle.input_names)])
    return np.asarray(trim(vehicle, environment=environment).inputs)
