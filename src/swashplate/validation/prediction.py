"""Predictions from many start points on a flight, each from what a causal observer knew at its start.

Predictions with a controller in the loop: its command answers the motion that is predicted, not what was flown.

A recorded command answers gusts that no prediction knows. Where past motion explains most of a command, a model that
runs on the recorded one turns against disturbances that it never met, and a model that fits there has taken in minus
the controller's inverse (docs/explanation/flights-under-feedback.md). Here the controller is identified beside the
aircraft instead: proportional to position and rate, some samples late. After a start nothing that was recorded of the
axis is used. Paths are flights that a model and its gusts might have gone on to make, as the sensors show them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, lengthened
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import N_DISTURBANCES, stochastic_model
from swashplate.filtering.filter_code import RecordSeries, driving_rows
from swashplate.filtering.nuisance import Nuisance, commands_moved, motors
from swashplate.filtering.riccati import gain_at, steady_gain
from swashplate.identification.core.records import HORIZONS, Record
from swashplate.identification.time.beginning import (
    Begun,
    FilterNumbers,
    begun,
    joined_at,
    numbers_and_constants,
    seen_at_start,
    starting_samples,
)
from swashplate.identification.time.calibration import as_begun, calibrate
from swashplate.identification.time.kinematics import PREDICTED, measured_states, samples_smoothed
from swashplate.identification.time.record_filter import FilterRun, RecordFilter, record_filter
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import ArrayBackend
from swashplate.validation.bands import BandedRecord
from swashplate.validation.controller_law import Law, learnt, shares_of

_ARRAYS = ArrayBackend()


_REFERENCE = 0.5
"""Seconds before a start over which the reference is averaged; it stays there."""
_REACH = 0.5
"""Seconds of past motion that a run carries: the command's delay and the aircraft's together."""


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


@dataclass(frozen=True, eq=False)
class ObservedRecord:
    """A record as a vehicle's causal observer sees it, and what it predicts from there.

    Attributes:
        vehicle, record: who flies, and what was seen. noise, nuisance: of the observer and of the record.
    """

    vehicle: Vehicle
    record: Record
    noise: Noise
    nuisance: Nuisance

    def calibrated(self, seconds: float, trims: Mapping[str, float]) -> ObservedRecord:
        """With delays, trims and lever arm as the record's first seconds tell them (see `calibrate`)."""
        vehicle, record, noise = self.vehicle, self.record, self.noise
        nuisance = calibrate(vehicle, record, noise=noise, prior=self.nuisance, seconds=seconds, trims=trims)
        return replace(self, nuisance=nuisance)

    @cached_property
    def _begun_vehicle(self) -> Vehicle:
        return as_begun(self.vehicle, self.record)

    @cached_property
    def _filter(self) -> RecordFilter:
        names, dt = self.record.output_names, self.record.dt
        return record_filter(stochastic_model(self._begun_vehicle, names, dt, noise=self.noise))

    @cached_property
    def _numbers(self) -> FilterNumbers:
        starting = self._commands(0)[0][: starting_samples(self.record.dt)].mean(axis=0)
        rows = self._begun_vehicle.values(), self.noise, self.nuisance, starting
        return FilterNumbers(*(np.array(row, dtype=np.float64) for row in rows))

    @cached_property
    def _begin(self) -> Begun:
        return begun(self._filter.model, self._numbers, seen_at_start(self._begun_vehicle, self.record))

    @cached_property
    def _run(self) -> FilterRun:
        series = RecordSeries(self.record.outputs, driving_rows(*self._commands(0)))
        return self._filter.along(self._begin, self._numbers, series)

    @cached_property
    def _constants(self) -> Array:
        return numbers_and_constants(self._begun_vehicle, self._numbers.parameters)

    @property
    def _body(self) -> list[int]:
        return [self.vehicle.index(name) for name in PREDICTED]

    @property
    def _fade(self) -> Array:
        return self._filter.model.fade(Noise(*self._numbers.noise))

    def _commands(self, beyond: int) -> tuple[Array, Array]:
        """Commands as they reach the vehicle and the voltage, which hold for some samples beyond the record."""
        count = self.record.time.size + beyond
        inputs, voltage = (lengthened(rows, count) for rows in (self.record.inputs, self.record.voltage))
        return commands_moved(self._begun_vehicle, self.record.dt, inputs, self.nuisance)[0], voltage

    @property
    def states(self) -> Array:
        """Body states after each reading (n, 12)."""
        return self._run.states.x[:, self._body]

    def ahead(self, starts: NDArray[np.intp], ahead: int) -> Array:
        """Body states 1, 2, ... samples after some starts, with nothing measured any more (starts, ahead, 12)."""
        driving = driving_rows(*self._commands(ahead))
        return self._filter.ahead_of(self._run.states.at(starts), self._numbers, driving, starts, ahead)[
            ..., self._body
        ]

    def closed_ahead(self, laws: Sequence[Law], starts: NDArray[np.intp], ahead: int) -> Array:
        """As `ahead`, with the loops of some axes closed."""
        inputs, (reaching, voltage) = self.record.inputs, self._commands(ahead)
        vehicle, nuisance, dt = self._begun_vehicle, self.nuisance, self.record.dt
        trims = np.array([getattr(nuisance, f"trim_{name}", 0.0) for name in vehicle.input_names], dtype=float)
        delays = np.where(motors(vehicle), nuisance.delay_motor, nuisance.delay_servo)
        delay_steps = np.round(delays / dt).astype(int)
        # What reaches the vehicle is a curve through four logged samples: until here, all are from before the start.
        known = np.maximum(np.floor(delays / dt).astype(int) - 1, 0)
        reach = round(_REACH / dt)
        before = np.concatenate([np.repeat(self.states[:1], reach, axis=0), self.states])
        shares, gains, lags, references = [], [], [], []
        for law in laws:
            share = shares_of(vehicle, law.axis)
            gain = np.array([dict(zip(law.motion, law.gains, strict=True)).get(name, 0.0) for name in PREDICTED])
            lag = round(law.lag / dt)
            left = np.cumsum(np.concatenate([[0.0], inputs @ share - (before @ gain)[reach - lag : len(before) - lag]]))
            low = np.maximum(starts + 1 - round(_REFERENCE / dt), 0)
            references.append((left[starts + 1] - left[low]) / (starts + 1 - low) + share @ trims)
            shares.append(share)
            gains.append(gain)
            lags.append(min(lag + int(delay_steps[np.flatnonzero(share)[0]]), reach - 1))
        shared, back = np.array(shares), np.array([share / (share @ share) for share in shares])
        since = np.where(np.any(shared != 0.0, axis=0), known, ahead)  # from when each input answers
        reference, answering = np.stack(references, axis=1), reach - 1 - np.array(lags)
        past = before[starts[:, None] + np.arange(1, reach + 1)]
        body, fade = self._body, self._fade
        x, gust, drift = self._run.states.at(starts)
        states = np.empty((len(starts), ahead, len(PREDICTED)))
        for k in range(ahead):
            u = reaching[starts + k]
            answer = reference + np.sum(np.array(gains) * past[:, answering], axis=2)
            # The part of the inputs that is the axis's command becomes the answer, all else stays as recorded.
            u = np.where(k >= since, u + (answer - u @ shared.T) @ back, u)
            x = self._filter.step(x, gust, drift, u, voltage[starts + k], self._constants)
            states[:, k], gust = x[:, body], fade * gust
            past = np.concatenate([past[:, 1:], states[:, k, None]], axis=1)
        return states

    def shown(self, starts: NDArray[np.intp], aside: Array, kicks: Array) -> Array:
        """Readings without the sensors' noise (runs, samples, outputs), of states that begin `aside` (runs, joined) and
        are kicked at every sample (runs, samples, joined)."""
        model, ahead = self._filter.model, kicks.shape[1]
        state, driving = model.displace(self._run.states.at(starts), aside), driving_rows(*self._commands(ahead))
        states = self._filter.ahead_of(state, self._numbers, driving, starts, ahead, kicks)
        return np.asarray(model.measure(states.T, self.nuisance, _ARRAYS).T)

    @cached_property
    def uncertainty(self) -> tuple[Array, Array, Array, Array]:
        """Of the joined system about the mean flight, nose north: its transition, and the covariances of what disturbs
        it, of the sensors' noise and of what the observer makes of a reading."""
        vehicle, record = self.vehicle, self.record
        numbers = vehicle.values(), self.noise, self.nuisance, [0.0]
        rows = FilterNumbers(*(np.array([row], dtype=np.float64) for row in numbers))
        model = stochastic_model(vehicle, record.output_names, record.dt, noise=self.noise)
        A, C, Q, R = (part[0] for part in joined_at(model, rows, seen_at_start(vehicle, record)))
        predicted = steady_gain(A, C, Q, R)[2]
        return A, Q, R, predicted - gain_at(predicted, C, R) @ C @ predicted

    def sigma(self, ahead: int) -> Array:
        """Standard deviations (ahead, 12) of predictions 1, 2, ... samples ahead.

        Uncertainty of the start and of the gusts to come; that of the parameters is not in it.
        """
        A, Q, _, P = self.uncertainty
        sigmas, body = [], self._body
        for _ in range(ahead):
            P = A @ P @ A.T + Q
            sigmas.append(np.sqrt(np.maximum(np.diag(P)[body], 0.0)))
        return np.array(sigmas)

    def predict(
        self,
        *,
        horizon: float = max(HORIZONS),
        every: float = 0.1,
        settling: float = SETTLING,
        early: float | None = None,
        close_loop: Sequence[str] = (),
    ) -> Predictions:
        """Predict `horizon` seconds ahead from starts every `every` seconds, the first after `settling` seconds.

        With `early` starts at the same distance begin before it, from `early` seconds on.

        At each start the observer has seen the record up to that sample and nothing after it. From there on the
        equations run on the recorded inputs; gusts fade and drifts stay as the observer last saw them. `close_loop`
        names axes that are predicted again with their controller, as the seconds before tell it, in the place of their
        recorded command.
        """
        record = self.record
        n, ahead = record.time.size, round(horizon / record.dt)
        first, step = round(settling / record.dt), max(1, round(every / record.dt))
        if early is not None:
            first -= max(0, (first - round(early / record.dt)) // step) * step
        starts = np.arange(first, max(n - 1, 0), step)
        laws = learnt(self._begun_vehicle, record, self.states, axes=close_loop, seconds=settling)
        return Predictions(
            starts=starts,
            states=self.ahead(starts, ahead),
            filtered=self.states,
            innovations=self._run.innovations,
            covariance=np.asarray(self._begin.gain.covariance),
            disturbances=self._run.states.gust[:, :N_DISTURBANCES] + self._run.states.drift,
            closed=self.closed_ahead(laws, starts, ahead) if laws else None,
            laws=laws,
        )


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


class Fan(NamedTuple):
    """Paths of drawn models about the predictions of one record, by start, samples ahead and body state.

    Attributes:
        below: how many of the `paths` lie below what came (starts, n, 12); nonsense beyond the record's end.
        variance: mean square of the paths about the prediction; by_parameters: that of the drawn models' predictions.
        missed: square of what came about the prediction. wider: as `spread` was asked (12,).
    """

    paths: int
    below: Array
    variance: Array
    by_parameters: Array
    missed: Array
    wider: Array

    @property
    def sigma(self) -> Array:
        """Root mean square of the paths about the prediction (starts, n, 12)."""
        return np.sqrt(self.variance)

    def at(self, horizon: float, record: Record, starts: NDArray[np.intp]) -> BandedRecord:
        """One horizon [s], from the first `starts` (those whose horizon lies within the record)."""
        rows, last = slice(len(starts)), round(horizon / record.dt) - 1
        below, variance, own_variance, missed = (
            part[rows, last] for part in (self.below, self.variance, self.by_parameters, self.missed)
        )
        return BandedRecord(record.time[starts], below, self.paths, variance, own_variance, missed, self.wider)


def spread(
    views: Sequence[ObservedRecord],
    *,
    predictions: Predictions,
    truth: Array,
    longest: int | None = None,
    wider: Array | float = 1.0,
) -> Fan:
    """The fan of drawn models about a model's predictions.

    Args:
        views: of `paths`. predictions: of the model itself.
        truth: body states (n, 12) that came.
        longest: samples ahead that count; all of the predictions' where None.
        wider: how many times as far from the prediction the paths are taken, (12,).
    """
    starts, about = predictions.starts, predictions.states[:, :longest]
    ahead = about.shape[1]
    places = np.minimum(starts[:, None] + np.arange(1, ahead + 1), len(truth) - 1)
    came = truth[places]
    below, variance, own_variance = (np.zeros(about.shape) for _ in range(3))
    for path, undisturbed in paths(views, starts=starts, ahead=ahead):
        below += about + wider * (path - about) < came
        variance += (wider * (path - about)) ** 2 / len(views)
        own_variance += (wider * (undisturbed - about)) ** 2 / len(views)
    return Fan(len(views), below, variance, own_variance, (came - about) ** 2, np.broadcast_to(wider, about.shape[-1:]))


def paths(
    views: Sequence[ObservedRecord], *, starts: NDArray[np.intp], ahead: int, seed: int = 0
) -> Iterator[tuple[Array, Array]]:
    """Of each drawn model a path and its prediction from each start: body states (starts, ahead, 12), those of the path
    as `measured_states` would show them.

    A path begins where the drawn model's own observer saw the aircraft, a draw of that observer's error aside. Gusts,
    drifts and white accelerations are drawn anew along it, and so is the noise of the sensors. Delays, trims and lever
    arm are what the record told the model.

    Args:
        views: a record by models that a fit cannot tell apart. starts: samples. ahead: how many samples.
        seed: of all that is random.
    """
    random, before = np.random.default_rng(seed), None
    for observed in views:
        record = observed.record
        half = samples_smoothed(record.dt) // 2
        length = ahead + half
        if observed is not before:
            _, Q, R, P = observed.uncertainty
            roots = [_root(part) for part in (P, Q, R)]
            undisturbed, before = observed.ahead(starts, ahead), observed
        aside, kicks, shaken = (
            random.standard_normal((len(starts), *count, len(root))) @ root.T
            for root, count in zip(roots, ((), (length,), (length,)), strict=True)
        )
        readings = observed.shown(starts, aside, kicks) + shaken
        reached = record.outputs[np.maximum(starts[:, None] + np.arange(1 - half, 1), 0)]  # by the smoothing
        joined = np.concatenate([reached, readings], axis=1)
        flat = joined.reshape(-1, joined.shape[-1])
        side_by_side = replace(record, time=np.linspace(0.0, record.dt * (len(flat) - 1), len(flat)), outputs=flat)
        states = measured_states(side_by_side, observed.nuisance).reshape(*joined.shape[:2], len(PREDICTED))
        yield states[:, half : half + ahead], undisturbed  # where the smoothing reaches no neighbour


def _root(covariance: Array) -> Array:
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
