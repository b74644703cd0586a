"""How straight an aircraft flies on a step of the pitch command: the paper's Fig. 10, for one model or for many."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from swashplate.arrays import Array
from swashplate.control.laws.autopilot import Autopilot
from swashplate.errors import ControllerError
from swashplate.flights.flight import Flight
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.closed_loop_batch import Batch, simulate_closed_loops
from swashplate.simulation.trim import Trim

_TRACKS = 60
"""Drawn models whose tracks are kept, for a plot."""
_HALVINGS = 16
DURATION = 10.0
"""s, after which a flight that has not covered the distance is given up."""


@dataclass(frozen=True)
class Path:
    """Where the flights went until they had covered the distance.

    Attributes:
        drift: offset to the right of the first heading when the distance is covered, NaN where it never was [m].
        leftmost, rightmost: extremes of the offset on the way [m].
        speed: largest speed ahead on the way [m/s].
        time: when the distance was covered [s].
    """

    drift: Array
    leftmost: Array
    rightmost: Array
    speed: Array
    time: Array


@dataclass(frozen=True)
class StepRun:
    """The step flown with one controller.

    Attributes:
        flight: of the model itself, until the distance is covered.
        path: of it, one entry each.
        drawn: paths of drawn models, or of the model in many gusts, None where there are none.
        tracks: place ahead and to the right of some of them, until the distance is covered [m].
    """

    flight: Flight
    path: Path
    drawn: Path | None
    tracks: tuple[tuple[Array, Array], ...]


def step_paths(
    vehicle: Vehicle,
    controller: Autopilot,
    trim: Trim,
    *,
    command: float,
    distance: float = 6.0,
    duration: float = DURATION,
    size: int = 1,
    parameters: Mapping[str, ArrayLike] | None = None,
) -> Path:
    """Fly a pilot's step of the pitch command from hover with one controller on one aircraft or on many.

    Args:
        vehicle: the equations and the numbers that `parameters` does not replace.
        controller: in mode "manual", with the decoupling or without.
        trim: the hover.
        command: the step (nose down positive) [1].
        distance: from the start [m].
        duration: after which a flight that has not covered it is given up [s].
        size, parameters: as in `simulate_closed_loops`.

    Raises:
        ControllerError: where no flight covers the distance.
    """
    batch = _fly(vehicle, controller, trim, command, duration, size, parameters)
    return paths_of(batch, command, distance)


def step_run(
    vehicle: Vehicle,
    controller: Autopilot,
    trim: Trim,
    *,
    command: float,
    distance: float = 6.0,
    duration: float = DURATION,
    parameters: Mapping[str, Array] | None = None,
    wind: Mapping[str, Array] | None = None,
) -> StepRun:
    """The same with the flights themselves, of the model in still air and of drawn models, or in gusts, or of both.

    Args:
        vehicle, controller, trim, command, distance, duration: as in `step_paths`.
        parameters: numbers of the drawn models by name, shape (models,) each.
        wind: gusts of each drawn flight, from `dryden` at the controller's rate, shape (samples, models).

    Raises:
        ControllerError: where no flight covers the distance.
    """
    batch = _fly(vehicle, controller, trim, command, duration, 1, None)
    path = paths_of(batch, command, distance)
    flight = batch.flight(0).between(0.0, float(path.time[0]))
    if not parameters and not wind:
        return StepRun(flight, path, None, ())
    size = next(values.shape[-1] for values in (*(parameters or {}).values(), *(wind or {}).values()))
    many = _fly(vehicle, controller, trim, command, duration, size, parameters, wind)
    drawn = paths_of(many, command, distance)
    tracks = []
    for i in range(min(size, _TRACKS)):
        until = many.time <= (drawn.time[i] if np.isfinite(drawn.time[i]) else duration)
        tracks.append((many["x"][until, i], many["y"][until, i]))
    return StepRun(flight, path, drawn, tuple(tracks))


def nearer(one: Path, other: Path) -> tuple[int, int]:
    """How many of the same flights end nearer to straight ahead on one path than on the other, and of how many.

    A flight that does not cover the distance is the furthest; one that does not on both counts for neither.
    """
    ends = [np.where(np.isfinite(path.drift), np.abs(path.drift), np.inf) for path in (one, other)]
    judged = np.isfinite(np.minimum(*ends))
    return int(np.sum(ends[0] < ends[1])), int(np.sum(judged))


def command_for_speed(
    vehicle: Vehicle,
    controller: Autopilot,
    trim: Trim,
    *,
    speed: float,
    distance: float = 6.0,
    duration: float = DURATION,
) -> float:
    """The step of the pitch command after which an aircraft gets this fast before it has covered the distance.

    Args:
        vehicle, controller, trim, distance, duration: as in `step_paths`.
        speed: ahead [m/s].

    Raises:
        ControllerError: where the full stick is not enough.
    """
    low, high = 0.0, 1.0
    fastest = 0.0
    for _ in range(_HALVINGS):
        command = 0.5 * (low + high) if fastest else high
        batch = _fly(vehicle, controller, trim, command, duration, 1, None)
        x, y, u = (batch[name][:, 0] for name in ("x", "y", "u"))
        covered = np.flatnonzero(~(np.hypot(x, y) < distance))
        reached = float(np.nanmax(u[: covered[0] + 1] if covered.size else u))
        if not fastest:
            fastest = reached
            if not fastest >= speed:
                raise ControllerError(
                    f"reaches {fastest:.2f} m/s with the full stick over {distance:g} m, not {speed:g} m/s.",
                    where=vehicle.name,
                    hint="Ask for less speed.",
                )
            continue
        low, high = (command, high) if reached < speed else (low, command)
    return 0.5 * (low + high)


def _fly(
    vehicle: Vehicle,
    controller: Autopilot,
    trim: Trim,
    command: float,
    duration: float,
    size: int,
    parameters: Mapping[str, ArrayLike] | None,
    wind: Mapping[str, Array] | None = None,
) -> Batch:
    return simulate_closed_loops(
        vehicle,
        controller,
        duration=duration,
        size=size,
        parameters=parameters,
        reference={"pitch": command},
        wind=wind,
        start=trim,
        rate=controller.rate * max(1, round(500.0 / controller.rate)),
    )


def paths_of(batch: Batch, command: float, distance: float) -> Path:
    """Where flights went until they had covered a distance [m]; `command` is what they were asked for, for messages.

    Raises:
        ControllerError: where no flight covers it.
    """
    x, y, u = batch["x"], batch["y"], batch["u"]
    covered = np.hypot(x, y) >= distance
    arrived = np.any(covered, axis=0)
    if not np.any(arrived):
        raise ControllerError(
            f"no flight covers {distance:g} m in {batch.time[-1]:.0f} s with a pitch command of {command:g}.",
            where=batch.vehicle.name,
            hint="Give a larger step or more time.",
        )
    last = np.argmax(covered, axis=0)
    under_way = np.arange(len(x))[:, None] <= last
    numbers = np.arange(x.shape[1])

    def of_arrived(values: Array) -> Array:
        return np.where(arrived, values, np.nan)

    return Path(
        drift=of_arrived(y[last, numbers]),
        leftmost=of_arrived(np.min(np.where(under_way, y, np.inf), axis=0)),
        rightmost=of_arrived(np.max(np.where(under_way, y, -np.inf), axis=0)),
        speed=of_arrived(np.max(np.where(under_way, u, -np.inf), axis=0)),
        time=of_arrived(batch.time[last]),
    )
