"""Predictions from many start points on a flight, each from what a causal observer knew at its start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, lengthened
from swashplate.filtering.arriving_commands import commands_moved
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import N_DISTURBANCES, FilterState, StochasticModel, stochastic_model
from swashplate.filtering.filter_code import RecordSeries, driving_rows
from swashplate.filtering.nuisance import Nuisance
from swashplate.filtering.riccati import gain_at, steady_gain
from swashplate.identification.core.records import Record
from swashplate.identification.core.spans import HORIZONS
from swashplate.identification.time.beginning import (
    FilterNumbers,
    begun,
    joined_at,
    seen_at_start,
    starting_samples,
)
from swashplate.identification.time.calibration import as_begun
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.identification.time.record_filter import record_filter
from swashplate.models.vehicle import Vehicle
from swashplate.validation.closed_loop import closed_ahead
from swashplate.validation.controller_law import Law, learnt

SETTLING = 2.0
"""Seconds before the first start point, for the observer to forget its first guess."""


@dataclass(frozen=True)
class Predictions:
    """Predicted states after each start.

    Attributes:
        starts: sample indices of the starts, shape (s,).
        states: predicted body states, shape (s, longest horizon in samples, 12), the first one sample after the start.
        filtered: the observer's body states at every sample, shape (n, 12).
        innovations: one-step prediction errors (n, outputs), and `covariance` their model covariance.
        disturbances: what the observer saw act beside the equations, gusts and drifts together, at every sample (n, 6):
            accelerations of u, v, w [m/s^2] and p, q, r [rad/s^2].
        closed: as `states`, with the loops of `laws` closed; None where none was asked for.
        laws: the controllers, from the seconds before the first start.
    """

    starts: NDArray[np.intp]
    states: Array
    filtered: Array
    innovations: Array
    covariance: Array
    disturbances: Array
    closed: Array | None = None
    laws: tuple[Law, ...] = ()

    def split(self, sample: int) -> tuple[Predictions, Predictions]:
        """Those from starts before a sample, and the others."""
        first = int(np.searchsorted(self.starts, sample))
        parts = (slice(None, first), slice(first, None))
        early, after = (
            replace(
                self,
                starts=self.starts[part],
                states=self.states[part],
                closed=None if self.closed is None else self.closed[part],
            )
            for part in parts
        )
        return early, after


class Observed(NamedTuple):
    """What an observer made of a record: its model and numbers, the states after each reading, innovations (n, outputs)
    with their covariance, and commands as they arrive with the voltage, some samples longer than the record."""

    model: StochasticModel
    numbers: FilterNumbers
    filtered: FilterState
    innovations: Array
    covariance: Array
    commands: Array
    voltage: Array

    def ahead(self, starts: NDArray[np.intp], ahead: int) -> Array:
        """States 1, 2, ... samples after some starts, with nothing measured any more (starts, ahead, states)."""
        known = self.filtered, self.numbers, self.commands, self.voltage
        return record_filter(self.model).ahead_of(*known, starts, ahead)


def predict(
    vehicle: Vehicle,
    record: Record,
    *,
    noise: Noise,
    nuisance: Nuisance,
    horizon: float = max(HORIZONS),
    every: float = 0.1,
    settling: float = SETTLING,
    early: float | None = None,
    close_loop: Sequence[str] = (),
) -> Predictions:
    """Predict `horizon` seconds ahead from starts every `every` seconds, the first after `settling` seconds.

    With `early` starts at the same distance begin before it, from `early` seconds on.

    At each start the observer has seen the record up to that sample and nothing after it. From there on the equations
    run on the recorded inputs; gusts fade and drifts stay as the observer last saw them. `close_loop` names axes that
    are predicted again with their controller, as the seconds before tell it, in the place of their recorded command.
    """
    filtered = observed(vehicle, record, noise=noise, nuisance=nuisance, beyond=round(horizon / record.dt))
    n, ahead = record.time.size, round(horizon / record.dt)
    first, step = round(settling / record.dt), max(1, round(every / record.dt))
    if early is not None:
        first -= max(0, (first - round(early / record.dt)) // step) * step
    starts = np.arange(first, max(n - 1, 0), step)
    kept = [vehicle.index(name) for name in PREDICTED]
    laws = learnt(vehicle, record, filtered.filtered.x[:, kept], axes=close_loop, seconds=settling)
    closed = None
    if laws:
        given = (filtered.model, filtered.filtered, filtered.numbers, laws, record.inputs)
        answered = closed_ahead(*given, filtered.commands, filtered.voltage, starts, ahead)
        closed = answered[..., kept]
    return Predictions(
        starts=starts,
        states=filtered.ahead(starts, ahead)[..., kept],
        filtered=filtered.filtered.x[:, kept],
        innovations=filtered.innovations,
        covariance=np.asarray(filtered.covariance),
        disturbances=filtered.filtered.gust[:, :N_DISTURBANCES] + filtered.filtered.drift,
        closed=closed,
        laws=laws,
    )


def observed(vehicle: Vehicle, record: Record, *, noise: Noise, nuisance: Nuisance, beyond: int) -> Observed:
    """The causal observer of a vehicle along a record, whose last commands hold for `beyond` samples more."""
    vehicle = as_begun(vehicle, record)
    model = stochastic_model(vehicle, record.output_names, record.dt, noise=noise)
    n = record.time.size
    inputs, voltage = (lengthened(rows, n + beyond) for rows in (record.inputs, record.voltage))
    reaching, _ = commands_moved(vehicle, record.dt, inputs, nuisance)
    starting = reaching[: starting_samples(record.dt)].mean(axis=0)
    numbers = FilterNumbers(*(np.array(row, dtype=np.float64) for row in (vehicle.values(), noise, nuisance, starting)))
    begin = begun(model, numbers, seen_at_start(vehicle, record))
    series = RecordSeries(record.outputs, driving_rows(reaching[:n], record.voltage))
    innovations, filtered, _ = record_filter(model).along(begin, numbers, series)
    return Observed(model, numbers, filtered, innovations, begin.gain.covariance, reaching, voltage)


def naive(states: Array, starts: NDArray[np.intp], ahead: int, dt: float, *, kind: str) -> Array:
    """Predictions without a model: "hold" the last value, or keep the body "rates" (velocities and turn rates)."""
    held = states[starts]
    if kind == "hold":
        return np.asarray(held)
    from scipy.spatial.transform import Rotation

    time = ahead * dt
    position, velocity, angles, rates = held[:, 0:3], held[:, 3:6], held[:, 6:9], held[:, 9:12]
    attitude = Rotation.from_euler("ZYX", angles[:, ::-1])
    position_ahead = position + attitude.apply(velocity) * time
    turned = (attitude * Rotation.from_rotvec(rates * time)).as_euler("ZYX")[:, ::-1]
    turned = angles + (turned - angles + np.pi) % (2 * np.pi) - np.pi
    return np.concatenate([position_ahead, velocity, turned, rates], axis=1)


def prediction_sigma(vehicle: Vehicle, record: Record, *, noise: Noise, nuisance: Nuisance, horizon: float) -> Array:
    """Standard deviations (n, 12) of predictions 1, 2, ... samples ahead, about the mean flight, nose north.

    Uncertainty of the start and of the gusts to come; that of the parameters is not in it.
    """
    A, _, Q, _, P = uncertainty(vehicle, record, noise=noise, nuisance=nuisance)
    kept, sigmas = [vehicle.index(name) for name in PREDICTED], []
    for _ in range(round(horizon / record.dt)):
        P = A @ P @ A.T + Q
        sigmas.append(np.sqrt(np.maximum(np.diag(P)[kept], 0.0)))
    return np.array(sigmas)


def uncertainty(
    vehicle: Vehicle, record: Record, *, noise: Noise, nuisance: Nuisance
) -> tuple[Array, Array, Array, Array, Array]:
    """A, C, Q, R of the joined system about the mean flight, nose north, and the covariance of what an observer makes
    of a reading."""
    model = stochastic_model(vehicle, record.output_names, record.dt, noise=noise)
    rows = FilterNumbers(*(np.array([row], dtype=np.float64) for row in (vehicle.values(), noise, nuisance, [0.0])))
    A, C, Q, R = (part[0] for part in joined_at(model, rows, seen_at_start(vehicle, record)))
    predicted = steady_gain(A, C, Q, R)[2]
    return A, C, Q, R, predicted - gain_at(predicted, C, R) @ C @ predicted
