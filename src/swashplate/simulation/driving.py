"""What drives a simulation: inputs, wind and voltage on one uniform time base, from a flight, a mapping or an array."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swashplate.arrays import Array
from swashplate.engine.equations import SURROUNDINGS
from swashplate.errors import FlightError, SwashError
from swashplate.flights.flight import Flight
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment

Interpolation = Literal["held", "linear"]
Inputs = Flight | Mapping[str, ArrayLike] | NDArray[np.float64]


def driving_rows(
    vehicle: Vehicle,
    inputs: Inputs,
    *,
    rate: float,
    environment: Environment,
    interpolation: Interpolation,
) -> tuple[Array, Array]:
    """Times [s], shape (n,), and rows of inputs and surroundings, shape (n, n_inputs + 4), at `rate` [Hz].

    Args:
        vehicle: its inputs are asked for by name.
        inputs: a flight (resampled to `rate`), a mapping from names to series that are already at `rate` (numbers
            stand for constant series), or an array of shape (n, n_inputs).
        rate: samples per second.
        environment: wind and voltage where `inputs` has no channel of that name.
        interpolation: how a flight is resampled: "held" takes the latest sample, "linear" goes from one to the next.

    Raises:
        FlightError: naming the input that is missing, not finite, too short or of another length.
    """
    if not rate > 0.0:
        raise SwashError(f"rate is {rate}, expected a positive number of samples per second.")
    if interpolation not in ("held", "linear"):
        raise SwashError(f"interpolation is '{interpolation}', expected 'held' or 'linear'.")
    if isinstance(inputs, Flight):
        time, columns = _resampled(vehicle, inputs, rate, interpolation)
    else:
        columns = _columns(vehicle, inputs)
        time = np.arange(max(column.size for column in columns.values())) / rate
    around = environment_of(vehicle, environment)
    for name in SURROUNDINGS:
        columns.setdefault(name, np.array(getattr(around, name), dtype=np.float64))
    rows = np.empty((time.size, len(columns)))
    for i, name in enumerate((*vehicle.input_names, *SURROUNDINGS)):
        column = columns[name]
        if column.ndim and column.shape != time.shape:
            raise FlightError(f"has {column.size} samples, others have {time.size}.", channel=name)
        if not np.all(np.isfinite(column)):
            bad = int(np.argmin(np.isfinite(np.atleast_1d(column))))
            raise FlightError(f"is not a number at sample {bad}.", channel=name, hint="Condition the flight first.")
        rows[:, i] = column
    if time.size < 2:
        raise FlightError("a simulation needs at least two samples of input.")
    return time, rows


def _columns(vehicle: Vehicle, inputs: Mapping[str, ArrayLike] | NDArray[np.float64]) -> dict[str, Array]:
    if not isinstance(inputs, Mapping):
        rows = np.asarray(inputs, dtype=np.float64)
        if rows.ndim != 2 or rows.shape[1] != len(vehicle.input_names):
            raise FlightError(f"inputs have shape {rows.shape}, expected (n, {len(vehicle.input_names)}).")
        return {name: rows[:, i] for i, name in enumerate(vehicle.input_names)}
    known = {*vehicle.input_names, *SURROUNDINGS}
    for name in inputs:
        if name not in known:
            raise FlightError(f"is not an input; expected {', '.join(sorted(known))}.", channel=name)
    for name in vehicle.input_names:
        if name not in inputs:
            raise FlightError(f"is missing; '{vehicle.name}' is driven by it.", channel=name)
    return {name: np.asarray(values, dtype=np.float64) for name, values in inputs.items()}


def _resampled(
    vehicle: Vehicle, flight: Flight, rate: float, interpolation: Interpolation
) -> tuple[Array, dict[str, Array]]:
    names = [*vehicle.input_names, *(name for name in SURROUNDINGS if name in flight)]
    stamps = {name: flight.time(name) for name in names}
    for name in vehicle.input_names:
        if stamps[name].size == 0:
            raise FlightError("has no samples.", where=flight.provenance.source or None, channel=name)
    start = max(stamps[name][0] for name in vehicle.input_names)
    stop = min(stamps[name][-1] for name in vehicle.input_names)
    # The small addition keeps the last sample where (stop - start) * rate is a whole number but for rounding.
    time = start + np.arange(int(np.floor((stop - start) * rate + 1e-6)) + 1) / rate
    columns = {}
    for name in names:
        values = flight.values(name)
        if interpolation == "linear":
            columns[name] = np.interp(time, stamps[name], values)
        else:
            latest = np.searchsorted(stamps[name], time + 1e-6 / rate, side="right") - 1
            columns[name] = values[np.maximum(latest, 0)]
    return time, columns
