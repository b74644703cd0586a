"""Conditioning: the chain that turns a log into something to identify from, and its replay from the history."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from swashplate.errors import FlightError
from swashplate.flights.checked import checked
from swashplate.flights.conditioning.derive import derive as derive_motion
from swashplate.flights.conditioning.filters import lowpass
from swashplate.flights.conditioning.ground import cut
from swashplate.flights.conditioning.ground import trim_ground as trim
from swashplate.flights.conditioning.outliers import remove_outliers
from swashplate.flights.conditioning.reconstruction import correct_sensors
from swashplate.flights.conditioning.resample import resample
from swashplate.flights.consistency import UNCHECKED
from swashplate.flights.flight import Flight
from swashplate.flights.provenance import ProcessingStep
from swashplate.flights.schema import ATTITUDE, QUATERNION


def check_streams(flight: Flight) -> None:
    """That there is something to condition.

    Raises:
        FlightError: no channels, a stream below two samples, time that is not finite or not increasing.
    """
    where = flight.provenance.source or None
    if not flight.channels:
        raise FlightError("the flight has no channels.", where=where, hint="Check what the reader found in the log.")
    for name, data in flight.streams.items():
        time = np.asarray(data["time"].values, dtype=np.float64)
        if time.size < 2:
            raise FlightError(
                f"stream '{name}' has {time.size} sample(s), expected at least 2.",
                where=where,
                channel=str(next(iter(data.data_vars), name)),
                hint="Check the log: a flight needs seconds of data.",
            )
        bad = np.flatnonzero(~np.isfinite(time) | ~np.concatenate([[True], np.diff(time) > 0]))
        if bad.size:
            raise FlightError(
                f"time stamps of stream '{name}' do not increase at sample {int(bad[0])} ({time[bad[0]]} s).",
                where=where,
                channel="time",
                hint="Sort the log and drop doubled stamps before conditioning.",
            )


def condition(
    flight: Flight,
    *,
    rate: float = 100.0,
    cutoff: float = 0.0,
    max_gap: float = 0.06,
    outliers: bool = True,
    trim_ground: bool = True,
    derive: bool = True,
    method: str = "linear",
    check: bool | None = True,
) -> Flight:
    """A log as one uniform stream of clean channels: the chain in its order, each step with its counts in the history.

    Outliers first (a filter would smear them), then the ground and the crash (a zero-phase filter would carry the crash
    back into the flight), then one rate, then, where asked for, one filter for all channels, then what is derived.

    Args:
        flight: as read.
        rate: [Hz].
        cutoff: corner of a zero-phase low-pass on all channels, inputs too [Hz]; 0 for none. Fits in time model the
            noise and refuse low-passed flights; plots, the lever arm and derived accelerations gain by 15 Hz.
        max_gap: longest gap that is bridged [s]; longer ones split the flight into segments.
        outliers: remove outliers.
        trim_ground: keep the flying part only.
        derive: add angles, body velocities, rates and specific force where position and attitude are there.
        method: between samples: "linear", "pchip" or "spline" (`resample`).
        check: refuse a log whose rates, attitude, velocities, positions and weight contradict each other in unit, sign
            or axis (`consistency`). False takes it as it is; the history says so. None: it was `checked` before.

    Raises:
        FlightError: channels that contradict each other, nothing to condition, no piece long enough, a filter that
            does not fit.
    """
    check_streams(flight)
    if check is not None:
        flight = checked(flight if check else flight.done(UNCHECKED))
    out = remove_outliers(flight) if outliers else flight
    if trim_ground:
        out = trim(out)
    out = resample(out, rate=rate, max_gap=max_gap, method=method)
    if cutoff:
        out = lowpass(out, cutoff=cutoff)
    has_attitude = all(name in out for name in QUATERNION) or all(name in out for name in ATTITUDE)
    return derive_motion(out) if derive and has_attitude else out


def _between(flight: Flight, *, start: float, stop: float) -> Flight:
    return flight.between(start, stop)


_OPERATIONS: Mapping[str, tuple[Callable[..., Flight], tuple[str, ...]]] = {
    "between": (_between, ("start", "stop")),
    UNCHECKED: (lambda flight: flight.done(UNCHECKED), ()),
    "remove_outliers": (remove_outliers, ("threshold", "longest")),
    "trim_ground": (cut, ("start", "stop", "reasons")),
    "resample": (resample, ("rate", "max_gap", "shortest_piece", "method", "straighten")),
    "lowpass": (lowpass, ("cutoff", "order")),
    "derive": (derive_motion, ("gravity",)),
    "correct_sensors": (correct_sensors, ("biases", "scales")),
}


def replay(raw: Flight, history: Iterable[ProcessingStep]) -> Flight:
    """What a history did, done again to the flight as read: conditioning is undone by reading and redone by this.

    Args:
        raw: the flight from its reader; steps that it already has in its history are not repeated.
        history: of the conditioned flight.

    Raises:
        FlightError: a step that is not part of conditioning.
    """
    steps = tuple(history)
    done = len(raw.history)
    if steps[:done] != raw.history:
        raise FlightError(
            "the history does not begin with this flight's own; it belongs to another flight.",
            where=raw.provenance.source or None,
            hint="Compare the hashes in provenance and read the right file.",
        )
    flight = raw
    for step in steps[done:]:
        if step.operation not in _OPERATIONS:
            raise FlightError(
                f"the history has the step '{step.operation}', which cannot be replayed; known are "
                f"{', '.join(sorted(_OPERATIONS))}.",
                where=raw.provenance.source or None,
            )
        operation, names = _OPERATIONS[step.operation]
        arguments: dict[str, Any] = {name: step.details[name] for name in names if name in step.details}
        flight = operation(flight, **arguments)
    return flight
