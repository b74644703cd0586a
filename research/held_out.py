"""Two models on flights that neither has seen: by how many points of fit one predicts better, and how sure that is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.identification.core.records import CALIBRATION, records
from swashplate.identification.core.result import Result
from swashplate.identification.time.calibration import calibrate
from swashplate.identification.time.kinematics import PREDICTED, measured_states
from swashplate.validation import block_bootstrap
from swashplate.validation.prediction import ObservedRecord
from swashplate.validation.validate import observer_of

CHANNELS = ("u", "v", "w", "phi", "theta", "p", "q", "r")
"""What is compared."""
AHEAD = 1.0
"""Seconds ahead."""
_EDGE = 10
"""Samples at the end of a record, where measured rates are one-sided."""


@dataclass(frozen=True)
class PredictionErrors:
    """Squared errors of one model at `AHEAD` seconds from many starts: per record start times [s] (s,), squared errors
    and squared movement (s, channels)."""

    times: tuple[Array, ...]
    errors: tuple[Array, ...]
    moved: tuple[Array, ...]


@dataclass(frozen=True)
class Gain:
    """By how many points of fit the wider of two models predicts one channel better, with its 95 % interval (NaN where
    the flights are too short for one)."""

    channel: str
    points: float
    low: float
    high: float

    @property
    def verdict(self) -> str:
        """ "better", "worse" or "" where the interval spans zero or is unknown."""
        return "better" if self.low > 0.0 else "worse" if self.high < 0.0 else ""


def prediction_errors(fit: Result[Any, Any], flights: Sequence[Flight]) -> PredictionErrors:
    """Errors of a fit of a tracked helicopter ahead on flights that it has not seen, as `validate` makes them.

    Raises:
        FlightError: where no record is long enough.
    """
    vehicle = fit.model
    noise, prior = observer_of(vehicle)
    times, errors, moved = [], [], []
    columns = [PREDICTED.index(name) for name in CHANNELS]
    for piece in records(flights, vehicle):
        if piece.time[-1] - piece.time[0] < CALIBRATION + 2.0 * AHEAD:
            continue
        nuisance = calibrate(vehicle, piece, noise=noise, prior=prior)
        predicted = ObservedRecord(vehicle, piece, noise=noise, nuisance=nuisance).predict(
            horizon=AHEAD, settling=CALIBRATION
        )
        truth, ahead = measured_states(piece, nuisance), round(AHEAD / piece.dt)
        counted = predicted.starts + ahead < piece.time.size - _EDGE
        first = predicted.starts[counted]
        times.append(piece.time[first])
        errors.append((predicted.states[counted, ahead - 1] - truth[first + ahead])[:, columns] ** 2)
        moved.append((truth[first + ahead] - truth[first])[:, columns] ** 2)
    if not times:
        raise FlightError(f"no unbroken piece has {CALIBRATION + 2.0 * AHEAD:g} s.", channel="hold-out")
    return PredictionErrors(tuple(times), tuple(errors), tuple(moved))


def gains(narrow: PredictionErrors, wide: PredictionErrors) -> tuple[Gain, ...]:
    """The wider model's lead per channel; the same blocks are drawn for both models."""
    stacked = [
        np.stack([*four], axis=-1) for four in zip(narrow.errors, narrow.moved, wide.errors, wide.moved, strict=True)
    ]
    points = _lead(sum(rows.sum(axis=0) for rows in stacked))
    draws = block_bootstrap.drawn(narrow.times, stacked, horizon=AHEAD)
    made = []
    for k, channel in enumerate(CHANNELS):
        low, high = block_bootstrap.interval(None if draws is None else _lead(draws[:, k]))
        made.append(Gain(channel, float(points[k]), low, high))
    return tuple(made)


def _lead(sums: Any) -> Array:
    """Points of fit from sums of (narrow error, moved, wide error, moved) along the last axis."""
    return np.asarray(100.0 * (np.sqrt(sums[..., 0] / sums[..., 1]) - np.sqrt(sums[..., 2] / sums[..., 3])))
