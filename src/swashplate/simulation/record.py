"""From rows of states to a `Flight`, and the check that they stayed finite."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import metadata
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.engine.equations import SURROUNDINGS
from swashplate.errors import CardError, DivergenceError, SwashError
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.flights.schema import CHANNELS
from swashplate.models.doubts import monitored
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
        start: as in `simulate_open_loop`. environment: for hover.

    Raises:
        CardError: where inputs reach outputs after different times, which no simulation of states can do.
    """
    try:
        known = input_delays(vehicle) if delays is None else delays
    except CardError as told:
        raise CardError(
            told.problem, where=told.where, hint="Give one delay per input as `delays`, or 0 for none."
        ) from None
    steps_behind = steps_late(np.array(list(complete_delays(vehicle, known).values())), rate)
    if not steps_behind.any():
        return rows
    before = _inputs_before(vehicle, rows, start, environment)
    acting = rows.copy()
    for i, steps in enumerate(np.minimum(steps_behind, len(rows))):
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


_ABSURD = {"m": 1e6, "m/s": 1e4, "rad": 1e4, "rad/s": 1e5}
"""Beyond these no small helicopter flies: a simulation that gets there has diverged, finite or not."""


def simulated_flight(
    vehicle: Vehicle, time: Array, states: Array, rows: Array, *, details: Mapping[str, Any]
) -> Flight:
    """A flight with the one stream "uniform": states (n, n_states), then inputs and surroundings (n, n_inputs + 4).

    Where it leaves what the vehicle holds for stands in its notes.
    """
    names = (*vehicle.state_names, *vehicle.input_names, *SURROUNDINGS)
    columns = dict(zip(names, np.concatenate([states, rows], axis=1).T, strict=True))
    names_of = (*vehicle.state_names, *vehicle.input_names)
    units = dict(zip(names_of, (*vehicle.state_units, *vehicle.input_units), strict=True))
    units = {name: unit for name, unit in units.items() if name not in CHANNELS}
    provenance = Provenance(
        source=f"simulated {vehicle.name}",
        reader="swashplate.simulation",
        reader_version=metadata.version("swashplate"),
        simulated=True,
        vehicle=vehicle.name,
    )
    flight = Flight({"uniform": stream(time, columns, units)}, provenance).done("simulate", **details)
    return monitored(flight, vehicle)


def unflown(vehicle: Vehicle, *, details: Mapping[str, Any]) -> Flight:
    """A simulated flight before its first sample: true states, inputs, wind and voltage; what recordings begin with."""
    states, rows = (np.zeros((0, n)) for n in (len(vehicle.state_names), len(vehicle.input_names) + len(SURROUNDINGS)))
    return simulated_flight(vehicle, np.zeros(0), states, rows, details=details)


def largest_states(vehicle: Vehicle) -> Array:
    """How large each state of a simulation may be, shape (n_states,): beyond, it has diverged."""
    return np.array([_ABSURD.get(unit, 1e9) for unit in vehicle.state_units])


def check_divergence(vehicle: Vehicle, time: Array, states: Array, flight: Flight | None) -> None:
    """Raise `DivergenceError` where a state is not finite or absurdly large; the message says which went first."""
    limits = largest_states(vehicle)
    with np.errstate(invalid="ignore"):
        bad = ~(np.abs(states) <= limits)
    if not bad.any():
        return
    row = int(np.argmax(bad.any(axis=1)))
    before = np.abs(states[max(row - 1, 0)]) / limits
    # Several states may leave in one step: the one that was nearest to its limit just before is the cause.
    first = int(np.argmax(np.where(bad[row], np.nan_to_num(before, nan=np.inf), -1.0)))
    name, last = vehicle.state_names[first], float(time[max(row - 1, 0)])
    raise DivergenceError(
        f"left the flyable range after {last:.3f} s (it was {states[max(row - 1, 0), first]:.3g}). "
        "Give the vehicle a controller, smaller inputs, a shorter flight or more substeps.",
        time=last,
        state=name,
        flight=None if flight is None else flight.between(float(time[0]), last),
    )
