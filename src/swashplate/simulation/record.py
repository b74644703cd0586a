"""From rows of states to a `Flight`, and the check that they stayed finite."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from importlib import metadata
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.equations import SURROUNDINGS
from swashplate.errors import DivergenceError
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.flights.schema import CHANNELS
from swashplate.models.doubts import envelope
from swashplate.models.vehicle import Vehicle

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
    flown = Flight({"uniform": stream(time, columns, units)}, provenance).done("simulate", **details)
    return monitored(flown, vehicle)


def unflown(vehicle: Vehicle, *, details: Mapping[str, Any]) -> Flight:
    """A simulated flight before its first sample: true states, inputs, wind and voltage; what recordings begin with."""
    states, rows = (np.zeros((0, n)) for n in (len(vehicle.state_names), len(vehicle.input_names) + len(SURROUNDINGS)))
    return simulated_flight(vehicle, np.zeros(0), states, rows, details=details)


def monitored(flight: Flight, vehicle: Vehicle) -> Flight:
    """A flight that says in its notes where it leaves what the vehicle's numbers and equations hold for."""
    said = tuple(words for words in envelope(vehicle, flight) if words not in flight.provenance.notes)
    if not said:
        return flight
    return replace(flight, provenance=replace(flight.provenance, notes=(*flight.provenance.notes, *said)))


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
