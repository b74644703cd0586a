"""A log replayed as the stream that it was: estimates over time, with bounds, and where they stood still."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.flight import Flight
from swashplate.identification.recursive.equation import coefficient_unit
from swashplate.identification.recursive.fourier_regression import RecursiveRegression, RegressionPlan
from swashplate.identification.recursive.slow_parameters import SlowParameters, SlowPlan
from swashplate.identification.time.equation_error import EquationError

_EXPLAINED = 0.95
"""R^2 below which gusts bias an equation: simulated, two sigmas hold 93 % at 0.995, 86 % at 0.9, 80 % at 0.75."""
_SURPRISED = 1.5
"""Mean squared innovation, in units of what is expected, above which the bounds are not believed."""
_STALE = 3.5
"""Steps of a channel's own stream after which its last value is no value any more."""


@dataclass(frozen=True)
class FrozenStretch:
    """Seconds from `start` to `stop` of a stream that did not count, and why."""

    start: float
    stop: float
    why: str


@dataclass(frozen=True)
class Tracked:
    """Unknowns along a stream, of one equation or of one vehicle.

    Attributes:
        text: the equation, or what is estimated of which vehicle.
        names, units: of the unknowns; a unit is "" where it is not known.
        plan: of the estimator.
        time: when the estimate was looked at [s], (n,).
        values, sigmas: estimates and standard errors, (n, unknowns); NaN while they were not told apart.
        final: the estimate at the end; None where there was none.
        frozen: where the stream did not count.
        counted: seconds that did.
        notes: what a user must know.
    """

    text: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    plan: RegressionPlan | SlowPlan
    time: Array
    values: Array
    sigmas: Array
    final: EquationError | None
    frozen: tuple[FrozenStretch, ...]
    counted: float
    notes: tuple[str, ...] = ()


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
        times, values = flight.time(name), flight.values(name)
        if times is time or np.array_equal(times, time):
            columns.append(values)
            continue
        last = np.searchsorted(times, time, side="right") - 1
        usual = float(np.median(np.diff(times))) if times.size > 1 else np.inf
        known = (last >= 0) & (time - times[np.maximum(last, 0)] < _STALE * usual)
        columns.append(np.where(known, values[np.maximum(last, 0)], np.nan))
    return time, np.column_stack(columns)


def tracked(
    plan: RegressionPlan, time: Array, samples: Array, *, every: float = 0.2, units: Mapping[str, str] | None = None
) -> Tracked:
    """Run a recursive regression along a stream.

    Args:
        plan: of the regression.
        time: stamps as they come [s], (n,).
        samples: of the equation's channels, (n, channels).
        every: between looks at the estimate [s].
        units: of channels that the schema does not know.
    """
    e, regression = plan.equation, RecursiveRegression(plan)
    coefficients = tuple(coefficient_unit(e, name, units or {}) for name in e.names)

    def step(elapsed: float, k: int) -> str | None:
        return None if regression.step(elapsed, samples[k]) else regression.frozen

    watched = _watched(step, regression.estimate, time, plan.dt, len(e.names), every)
    final, notes = watched[3], []
    if final is not None and final.determination < _EXPLAINED and not plan.instruments:
        notes.append(
            f"{100.0 * (1.0 - final.determination):.0f} % of the left side's power is left over: gusts this strong, or "
            "a term that is missing, bias the coefficients, and fewer than nine in ten lie within two standard errors. "
            "Name as instruments the commands that no controller gives: gusts then do not bias."
        )
    return Tracked(e.text, e.names, coefficients, plan, *watched, notes=tuple(notes))


def tracked_parameters(plan: SlowPlan, time: Array, inputs: Array, readings: Array, *, every: float = 0.2) -> Tracked:
    """Run a filter of slow parameters along a stream.

    Args:
        plan: of the filter.
        time: stamps as they come [s], (n,).
        inputs: the vehicle's and the voltage, (n, inputs + 1). readings: of the plan's channels, (n, channels).
        every: between looks at the estimate [s].
    """
    running, surprises = SlowParameters(plan), []

    def step(elapsed: float, k: int) -> str | None:
        if running.step(elapsed, inputs[k], readings[k]):
            surprises.append(running.surprise)
            return None
        return running.frozen

    dt, vehicle = plan.observer.dt, plan.observer.equations.vehicle
    watched = _watched(step, running.estimate, time, dt, len(plan.unknown), every)
    notes = []
    if running.missing:
        notes.append(f"{running.missing} readings were no numbers and were left out.")
    worst = float(np.mean(surprises)) if surprises else float("nan")
    if worst > _SURPRISED:
        notes.append(
            f"Readings surprise the filter by {np.sqrt(worst):.1f} times what it expects: the model, the noise of its "
            "sensors or the delays are wrong, and the bounds are too narrow."
        )
    units = tuple(vehicle.card.parameters[name].unit for name in plan.unknown)
    sensors = ", ".join(map(str, plan.observer.sensors))
    return Tracked(f"{vehicle.card.called}, read by {sensors}", plan.unknown, units, plan, *watched, notes=tuple(notes))


def _watched(
    step: Callable[[float, int], str | None],
    estimate: Callable[[], EquationError | None],
    time: Array,
    dt: float,
    unknowns: int,
    every: float,
) -> tuple[Array, Array, Array, EquationError | None, tuple[FrozenStretch, ...], float]:
    """Times, values and sigmas of all looks, the last estimate, stretches that did not count, seconds that did."""
    looks, values, sigmas, stretches = [], [], [], []
    counted, before, look, nothing = 0.0, float("nan"), -np.inf, np.full(unknowns, np.nan)
    for k, now in enumerate(time.tolist()):
        why = step(now - before, k)
        if why is None:
            counted += dt
        elif why:
            stretches.append(FrozenStretch(before if np.isfinite(before) else now, now, why))
        before = now
        if not look <= now < look + every:
            look, estimated = now, estimate()
            looks.append(now)
            values.append(nothing if estimated is None else estimated.values)
            sigmas.append(nothing if estimated is None else estimated.sigmas)
    return np.array(looks), np.array(values), np.array(sigmas), estimate(), _joined(stretches), counted


def _joined(stretches: Sequence[FrozenStretch]) -> tuple[FrozenStretch, ...]:
    """Stretches for the same reason that touch as one."""
    joined: list[FrozenStretch] = []
    for one in stretches:
        if joined and joined[-1].why == one.why and one.start <= joined[-1].stop:
            joined[-1] = FrozenStretch(joined[-1].start, one.stop, one.why)
        else:
            joined.append(one)
    return tuple(joined)
