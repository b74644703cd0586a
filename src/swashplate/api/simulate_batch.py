"""The verb `simulate_batch`: many vehicles of one kind at once, flown by what is quickest here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swashplate.engine.equations import SURROUNDINGS, Equations, equations_of, parameter_row
from swashplate.errors import CardError, FlightError, SwashError
from swashplate.jax_on_demand import jax
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.batch import Batch, FlyBatch, Precision, fly_batch
from swashplate.simulation.driving import Interpolation
from swashplate.simulation.dynamics import enable_double_precision
from swashplate.simulation.late import Delays, acting_rows
from swashplate.simulation.trim import Trim, start_row, surroundings_of_start

Engine = Literal["auto", "c", "jax"]


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
    engine: Engine = "auto",
    notice: Callable[[str], None] = print,
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
        engine: "c" is the vehicle's own C, compiled in seconds and five times as fast as "jax" (decision 59); "auto"
            takes C where it can be had and vehicles fly on a processor.
        notice: where a line goes that says why "auto" did not take C.

    Raises:
        CardError, FlightError, SwashError: for what does not fit the vehicle, or is not told.
        ExportError: for "c" where there is no compiler or no C of the equations.
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
    fly = batch_engine(engine, notice)
    later = fly(equations_of(vehicle), *arguments, keep=keep, held=interpolation == "held")
    kept = np.arange(0, steps + 1, keep)
    return Batch(vehicle, kept / rate, np.asarray(later)[: kept.size], rows[kept])


def batch_engine(engine: Engine, notice: Callable[[str], None]) -> FlyBatch:
    """What flies a batch; arguments as in `simulate_batch`."""
    if engine == "jax" or (engine == "auto" and jax.default_backend() != "cpu"):
        return fly_batch
    from swashplate.export.batch_c import fly_in_c

    if engine == "c":
        return fly_in_c

    def fly(equations: Equations, *tables: Any, keep: int, held: bool) -> NDArray[Any]:
        try:
            return fly_in_c(equations, *tables, keep=keep, held=held)
        except (SwashError, OSError) as error:  # no compiler, one without headers, equations that are no C
            notice(f"The vehicles' C cannot be used here, JAX flies them five times slower: {error}")
        return fly_batch(equations, *tables, keep=keep, held=held)

    return fly


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
