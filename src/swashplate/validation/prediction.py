"""Predictions from many start points on a flight, each from what a causal observer knew at its start.

Predictions with a controller in the loop: its command answers the motion that is predicted, not what was flown.

A recorded command answers gusts that no prediction knows. Where past motion explains most of a command, a model that
runs on the recorded one turns against disturbances that it never met, and a model that fits there has taken in minus
the controller's inverse (docs/explanation/flights-under-feedback.md). Here the controller is identified beside the
aircraft instead: proportional to position and rate, some samples late. After a start nothing that was recorded of the
axis is used.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, lengthened
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import N_DISTURBANCES, FilterState, StochasticModel, stochastic_model
from swashplate.filtering.filter_code import RecordSeries, driving_rows
from swashplate.filtering.nuisance import Nuisance, commands_moved, motors
from swashplate.filtering.riccati import gain_at, steady_gain
from swashplate.identification.core.records import HORIZONS, Record
from swashplate.identification.time.beginning import (
    FilterNumbers,
    begun,
    joined_at,
    numbers_and_constants,
    seen_at_start,
    starting_samples,
)
from swashplate.identification.time.calibration import as_begun
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.identification.time.record_filter import record_filter
from swashplate.models.vehicle import Vehicle
from swashplate.validation.controller_law import Law, learnt, shares_of


def rms(rows: Array) -> Array:
    """Root mean square over the first axis."""
    return np.asarray(np.sqrt(np.mean(np.square(rows), axis=0)), dtype=np.float64)


def fit_percent(predicted: Array, truth: Array, at_start: Array) -> Array:
    """100 (1 - rms error / rms of the change since the start), per column.

    Holding the last value scores 0, a perfect prediction 100; below 0 it would have been better to predict nothing.
    """
    return 100.0 * (1.0 - rms(predicted - truth) / rms(truth - at_start))


def theil(predicted: Array, truth: Array, at_start: Array) -> Array:
    """Theil's inequality coefficient of the changes since the start: 0 perfect, 1 no better than the opposite sign.

    rms(error) / (rms(predicted change) + rms(true change)) (Theil 1966; Jategaonkar 2015, sec. 11.2.3).
    """
    return rms(predicted - truth) / (rms(predicted - at_start) + rms(truth - at_start))


_REFERENCE = 0.5
"""Seconds before a start over which the reference is averaged; it stays there."""
_REACH = 0.5
"""Seconds of past motion that a run carries: the command's delay and the aircraft's together."""


class _Loops(NamedTuple):
    """What one run needs of the closed axes: shares of the inputs (axes, inputs) and back (axes, inputs), gains on the
    body's states (axes, 12), samples from motion to aircraft (axes,), and from when each input answers (inputs,)."""

    shares: Array
    back: Array
    gains: Array
    late: NDArray[np.intp]
    since: NDArray[np.intp]


def closed_ahead(
    model: StochasticModel,
    filtered: FilterState,
    numbers: FilterNumbers,
    laws: Sequence[Law],
    inputs: Array,
    reaching: Array,
    voltage: Array,
    starts: NDArray[np.intp],
    ahead: int,
) -> Array:
    """States 1, 2, ... samples after some starts with loops closed (starts, ahead, states).

    Args:
        model, numbers: of the filter. filtered: its states after each reading.
        laws: of the closed axes. inputs: as recorded (n, inputs).
        reaching, voltage: what reaches the vehicle at each sample, `ahead` samples beyond the last start.
        starts: samples. ahead: how many samples to predict.
    """
    vehicle, dt = model.vehicle, model.dt
    nuisance = Nuisance(*(float(value) for value in numbers.nuisance))
    trims = np.array([getattr(nuisance, f"trim_{name}", 0.0) for name in vehicle.input_names], dtype=float)
    delays = np.where(motors(vehicle), nuisance.delay_motor, nuisance.delay_servo)
    delay_steps = np.round(delays / dt).astype(int)
    # What reaches the vehicle is a curve through four logged samples: until here, all are from before the start.
    known = np.maximum(np.floor(delays / dt).astype(int) - 1, 0)
    body = np.asarray(filtered.x)[:, [vehicle.index(name) for name in PREDICTED]]
    reach = round(_REACH / dt)
    before = np.concatenate([np.repeat(body[:1], reach, axis=0), body])
    shares, gains, behind, references = [], [], [], []
    for law in laws:
        share = shares_of(vehicle, law.axis)
        gain = np.array([dict(zip(law.motion, law.gains, strict=True)).get(name, 0.0) for name in PREDICTED])
        lag = round(law.lag / dt)
        left = np.cumsum(np.concatenate([[0.0], inputs @ share - (before @ gain)[reach - lag : len(before) - lag]]))
        low = np.maximum(starts + 1 - round(_REFERENCE / dt), 0)
        references.append((left[starts + 1] - left[low]) / (starts + 1 - low) + share @ trims)
        shares.append(share)
        gains.append(gain)
        behind.append(min(lag + int(delay_steps[np.flatnonzero(share)[0]]), reach - 1))
    back = [share / (share @ share) for share in shares]
    answers = np.any(np.array(shares) != 0.0, axis=0)
    since = np.where(answers, known, ahead)
    loops = _Loops(np.array(shares), np.array(back), np.array(gains), np.array(behind), since)
    past = before[starts[:, None] + np.arange(1, reach + 1)]
    return _closed_ahead(
        model, filtered, numbers, loops, past, np.stack(references, axis=1), (reaching, voltage), starts, ahead
    )


def _closed_ahead(
    model: StochasticModel,
    filtered: FilterState,
    numbers: FilterNumbers,
    loops: _Loops,
    past: Array,
    reference: Array,
    recorded: tuple[Array, Array],
    starts: NDArray[np.intp],
    ahead: int,
) -> Array:
    """As `closed_ahead`; past: body states (starts, reach, 12), reference: (starts, axes), recorded: what reached the
    vehicle and the voltage by sample."""
    body, step = [model.vehicle.index(name) for name in PREDICTED], record_filter(model).step
    fade, constants = model.fade(Noise(*numbers.noise)), numbers_and_constants(model.vehicle, numbers.parameters)
    x, gust, drift = (np.asarray(part)[starts] for part in filtered[:3])
    states = np.empty((len(starts), ahead, x.shape[1]))
    for k in range(ahead):
        u = recorded[0][starts + k]
        answer = reference + np.sum(loops.gains * past[:, past.shape[1] - 1 - loops.late], axis=2)
        # The part of the inputs that is the axis's command becomes the answer, all else stays as recorded.
        u = np.where(k >= loops.since, u + (answer - u @ loops.shares.T) @ loops.back, u)
        states[:, k] = x = step(x, gust, drift, u, recorded[1][starts + k], constants)
        gust = fade * gust
        past = np.concatenate([past[:, 1:], x[:, None, body]], axis=1)
    return states


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
