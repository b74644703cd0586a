"""The verb `simulate_batch`: many vehicles of one kind at once, flown by what is quickest here."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swashplate.engine.card import fly_on_card
from swashplate.engine.equations import SURROUNDINGS, parameter_row
from swashplate.engine.fly import FlightPlan, fly
from swashplate.engine.statements import Precision as Digits
from swashplate.errors import CardError, FlightError, SwashError
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.closed_loop_batch import Batch, Precision
from swashplate.simulation.driving import Interpolation
from swashplate.simulation.record import Delays, acting_rows
from swashplate.simulation.trim import Trim, start_row, surroundings_of_start


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
    card: bool = False,
) -> Batch:
    """Fly many vehicles of one kind at once; agrees with `simulate_open_loop` to 1e-11 in float64.

    Args:
        vehicle: their equations and the numbers that `parameters` does not replace.
        inputs: series by input name (and wind, voltage), shape (n,) for all alike or (n, n_vehicles).
        parameters: numbers of the card by name, shape (n_vehicles,) each.
        start: one trim for all, or states by name, a number or shape (n_vehicles,) each.
        size: number of vehicles, needed where nothing else says it.
        rate: steps per second [Hz].
        interpolation: inputs "held" or "linear" between samples.
        environment: air, gravity, and wind and voltage where `inputs` has none; by default as in `simulate_open_loop`.
        delays: as in `simulate_open_loop`.
        keep: every how many steps a sample is kept (memory: 8 x 18 bytes per sample and vehicle).
        precision: "float32" is faster and loses about nine digits.
        card: fly on a graphics card, by JAX (extra `cuda`); held inputs only.

    Raises:
        CardError, FlightError, SwashError: for what does not fit the vehicle, or is not told.
        ExportError: for equations that cannot be traced.
        MissingLibraryError: for a card, without JAX.
    """
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

    acting = acting_rows(vehicle, rows, rate=rate, delays=delays, start=start, environment=first)
    plan = FlightPlan(x0, p, acting, 1.0 / rate, keep=keep, held=interpolation == "held")
    digits: Digits = "double" if precision == "float64" else "single"
    later = fly_on_card(vehicle, plan, precision=digits) if card else fly(vehicle, plan, precision=digits)[0]
    kept = np.arange(0, steps + 1, keep)
    return Batch(vehicle, kept / rate, later, rows[kept])


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
    counts = {v.shape[0] for group in (numbers, states) for v in group.values() if v.ndim}
    counts |= {v.shape[1] for v in series.values() if v.shape[1] > 1}
    counts |= set() if size is None else {size}
    if len(counts) != 1:
        raise SwashError(f"the number of vehicles is {sorted(counts) or 'not given'}, expected one number (size=...).")
    return int(counts.pop())
