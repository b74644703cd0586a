"""A log replayed as the stream that it was: estimates over time, with bounds, and where they stood still."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.flight import Flight
from swashplate.identification.recursive.fourier_regression import RecursiveRegression, RegressionPlan
from swashplate.identification.time.equation_error import EquationError

_STALE = 3.5
"""Steps of a channel's own stream after which its last value is no value any more."""


@dataclass(frozen=True)
class FrozenStretch:
    """Seconds from `start` to `stop` of a stream that did not count, and why."""

    start: float
    stop: float
    why: str


@dataclass(frozen=True)
class TrackedEquation:
    """One equation along a stream.

    Attributes:
        plan: of the regression.
        time: when the estimate was looked at [s], (n,).
        values, sigmas: estimates and standard errors, (n, unknowns); NaN while they were not told apart.
        final: the estimate at the end; None where there was none.
        frozen: where the stream did not count.
        counted: seconds that did.
    """

    plan: RegressionPlan
    time: Array
    values: Array
    sigmas: Array
    final: EquationError | None
    frozen: tuple[FrozenStretch, ...]
    counted: float

    @property
    def names(self) -> tuple[str, ...]:
        return self.plan.equation.names


def stream_of(flight: Flight, channels: Sequence[str]) -> tuple[Array, Array]:
    """Times (n,) of the first channel, and all channels as they were last known then, (n, channels).

    A channel of another stream keeps its last value, as on board; NaN before its first and after it has been silent for
    more than three of its own steps.

    Raises:
        FlightError: a channel that the flight lacks.
    """
    time = flight.time(channels[0])
    columns = []
    for name in channels:
        own, values = flight.time(name), flight.values(name)
        if own is time or np.array_equal(own, time):
            columns.append(values)
            continue
        last = np.searchsorted(own, time, side="right") - 1
        usual = float(np.median(np.diff(own))) if own.size > 1 else np.inf
        known = (last >= 0) & (time - own[np.maximum(last, 0)] < _STALE * usual)
        columns.append(np.where(known, values[np.maximum(last, 0)], np.nan))
    return time, np.column_stack(columns)


def tracked(plan: RegressionPlan, time: Array, samples: Array, *, every: float = 0.2) -> TrackedEquation:
    """Run a recursive regression along a stream.

    Args:
        plan: of the regression.
        time: stamps as they come [s], (n,).
        samples: of the equation's channels, (n, channels).
        every: between looks at the estimate [s].
    """
    regression = RecursiveRegression(plan)
    looks, values, sigmas, stretches = [], [], [], []
    final, counted, before, look = None, 0.0, float("nan"), -np.inf
    for now, sample in zip(time.tolist(), samples, strict=True):
        if regression.step(now - before, sample):
            counted += plan.dt
        elif regression.frozen:
            stretches.append(FrozenStretch(before if np.isfinite(before) else now, now, regression.frozen))
        before = now
        if not look <= now < look + every:
            look = now
            final = regression.estimate()
            looks.append(now)
            nothing = np.full(len(plan.equation.names), np.nan)
            values.append(nothing if final is None else final.values)
            sigmas.append(nothing if final is None else final.sigmas)
    rows = (np.array(values), np.array(sigmas))
    return TrackedEquation(plan, np.array(looks), *rows, regression.estimate(), _joined(stretches), counted)


def _joined(stretches: Sequence[FrozenStretch]) -> tuple[FrozenStretch, ...]:
    """Stretches for the same reason that touch as one."""
    found: list[FrozenStretch] = []
    for one in stretches:
        if found and found[-1].why == one.why and one.start <= found[-1].stop:
            found[-1] = FrozenStretch(found[-1].start, one.stop, one.why)
        else:
            found.append(one)
    return tuple(found)
