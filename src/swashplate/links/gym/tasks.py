"""What is asked for: a place to hold, a path to follow, an attitude sweep to track; as tables over time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import SwashError
from swashplate.flights.maneuvers.series import Maneuver

TARGET = ("north", "east", "down", "v_north", "v_east", "v_down", "heading", "roll", "pitch")
"""Columns of a target: place [m], velocity [m/s], heading [rad], and roll and pitch beyond the trim's [rad]."""
ERRORS = ("level", "height", "velocity", "attitude", "heading")
"""What the reward counts, in the order of `Task.scales`."""

STEEPEST = float(np.radians(80.0))
"""Largest angle that ends an episode [rad]."""


@dataclass(frozen=True)
class Task:
    """A target over time and what is near enough to it.

    Attributes:
        name: what it is.
        duration: of an episode [s].
        targets: rows of `TARGET` at times [s], shape (n,) -> (n, 9).
        scales: error that costs 1, by `ERRORS` [m, m, m/s, rad, rad]; infinite where it does not matter.
        level_limit, height_limit: distance from the target that ends an episode [m].
        lean_limit: roll or pitch angle that ends one [rad].
    """

    name: str
    duration: float
    targets: Callable[[Array], Array]
    scales: tuple[float, float, float, float, float]
    level_limit: float = 10.0
    height_limit: float = 5.0
    lean_limit: float = np.radians(60.0)

    def __post_init__(self) -> None:
        if not self.lean_limit <= STEEPEST:
            raise SwashError(
                f"is {np.degrees(self.lean_limit):.0f} degrees, expected at most {np.degrees(STEEPEST):.0f}: episodes "
                "fly with roll, pitch and yaw, which lose the attitude near the vertical.",
                where=self.name,
                channel="lean_limit",
            )


def hover(*, duration: float = 10.0) -> Task:
    """Hold the place and heading of the start."""
    return Task("hover", duration, lambda time: np.zeros((time.size, len(TARGET))), (1.0, 0.5, 2.0, 0.5, 0.5))


def trajectory(*, duration: float = 20.0, size: float = 2.0, period: float = 12.0) -> Task:
    """A level figure of eight, `size` metres to each end and `period` seconds long, begun from rest, heading held."""
    _positive(duration=duration, size=size, period=period)
    turning = 2.0 * np.pi / period

    def targets(time: Array) -> Array:
        rows = np.zeros((time.size, len(TARGET)))
        phase = turning * (time - 1.0 + np.exp(-time))  # the first second or so speeds up
        speed = turning * (1.0 - np.exp(-time))
        rows[:, 0], rows[:, 3] = size * np.sin(phase), size * np.cos(phase) * speed
        rows[:, 1], rows[:, 4] = 0.5 * size * np.sin(2.0 * phase), size * np.cos(2.0 * phase) * speed
        return rows

    return Task("trajectory", duration, targets, (1.0, 0.5, 2.0, np.inf, 0.5))


def sweep(
    *,
    duration: float = 30.0,
    axis: str = "pitch",
    amplitude: float = 0.08,
    low: float = 0.2,
    high: float = 2.0,
) -> Task:
    """Track a sweep of the roll or pitch angle (amplitude [rad], band [Hz]) at constant height and heading."""
    _positive(duration=duration, amplitude=amplitude, low=low)
    if axis not in ("roll", "pitch") or not low < high:
        raise SwashError(f"axis is '{axis}' and the band {low:g} to {high:g} Hz, expected roll or pitch, low < high.")
    maneuver = Maneuver("sweep", (axis,), duration, amplitude, (low, high))

    def targets(time: Array) -> Array:
        rows = np.zeros((time.size, len(TARGET)))
        rows[:, TARGET.index(axis)] = maneuver.signals(time)[axis]
        return rows

    return Task("sweep", duration, targets, (np.inf, 0.5, np.inf, 0.05, 0.5), level_limit=100.0)


TASKS: Mapping[str, Callable[..., Task]] = {"hover": hover, "trajectory": trajectory, "sweep": sweep}


def task_of(task: str | Task, options: Mapping[str, Any]) -> Task:
    """A task by its name and options, or one of one's own.

    Raises:
        SwashError: for a name or an option that there is not.
    """
    if isinstance(task, Task):
        return task
    if task not in TASKS:
        raise SwashError(f"'{task}' is no task; there are {', '.join(TASKS)}.", channel="task")
    try:
        return TASKS[task](**options)
    except TypeError as error:
        raise SwashError(f"{error}.", channel=f"task {task}") from None


def _positive(**numbers: float) -> None:
    for name, value in numbers.items():
        if not (value > 0.0 and np.isfinite(value)):
            raise SwashError(f"is {value}, expected a positive number.", channel=name)
