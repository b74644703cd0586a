"""How straight an aircraft flies on a step of the pitch command: the paper's Fig. 10, for one model or for many."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swashplate.control.autopilot import Autopilot
from swashplate.errors import ControllerError
from swashplate.simulation.closed_loop_batch import simulate_closed_loops
from swashplate.simulation.trim import Trim
from swashplate.vehicles.vehicle import Vehicle

Array = NDArray[np.float64]


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


def step_paths(
    vehicle: Vehicle,
    controller: Autopilot,
    trim: Trim,
    *,
    command: float,
    distance: float = 6.0,
    duration: float = 10.0,
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
    flown = simulate_closed_loops(
        vehicle,
        controller,
        duration=duration,
        size=size,
        parameters=parameters,
        reference={"pitch": command},
        start=trim,
        rate=controller.rate * max(1, round(500.0 / controller.rate)),
    )
    x, y, u = flown["x"], flown["y"], flown["u"]
    covered = np.hypot(x, y) >= distance
    arrived = np.any(covered, axis=0)
    if not np.any(arrived):
        raise ControllerError(
            f"no flight covers {distance:g} m in {duration:g} s with a pitch command of {command:g}.",
            where=vehicle.name,
            hint="Give a larger step or more time.",
        )
    last = np.argmax(covered, axis=0)
    under_way = np.arange(len(x))[:, None] <= last
    numbers = np.arange(x.shape[1])

    def told(values: Array) -> Array:
        return np.where(arrived, values, np.nan)

    return Path(
        drift=told(y[last, numbers]),
        leftmost=told(np.min(np.where(under_way, y, np.inf), axis=0)),
        rightmost=told(np.max(np.where(under_way, y, -np.inf), axis=0)),
        speed=told(np.max(np.where(under_way, u, -np.inf), axis=0)),
        time=told(flown.time[last]),
    )
