"""Predictions from many start points on a flight, each from what a causal observer knew at its start.

Predictions with a controller in the loop: its command answers the motion that is predicted, not what was flown.

A recorded command answers gusts that no prediction knows. Where past motion explains most of a command, a model that
runs on the recorded one turns against disturbances that it never met, and a model that fits there has taken in minus
the controller's inverse (docs/explanation/flights-under-feedback.md). Here the controller is identified beside the
aircraft instead: proportional to position and rate, some samples late. After a start nothing that was recorded of the
axis is used.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, lengthened
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import N_DISTURBANCES, FilterState, stochastic_model
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
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.identification.time.record_filter import FilterRun, RecordFilter, record_filter
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import ArrayBackend
from swashplate.validation.controller_law import Law, learnt, shares_of

_ARRAYS = ArrayBackend()


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
        told = calibrate(self.vehicle, self.record, noise=self.noise, prior=self.nuisance, seconds=seconds, trims=trims)
        return replace(self, nuisance=told)

    @cached_property
    def _flown(self) -> Vehicle:
        return as_begun(self.vehicle, self.record)

    @cached_property
    def _filter(self) -> RecordFilter:
        names, dt = self.record.output_names, self.record.dt
        return record_filter(stochastic_model(self._flown, names, dt, noise=self.noise))

    @cached_property
    def _numbers(self) -> FilterNumbers:
        starting = self._commands(0)[0][: starting_samples(self.record.dt)].mean(axis=0)
        rows = self._flown.values(), self.noise, self.nuisance, starting
        return FilterNumbers(*(np.array(row, dtype=np.float64) for row in rows))

    @cached_property
    def _begin(self) -> Begun:
        return begun(self._filter.model, self._numbers, seen_at_start(self._flown, self.record))

    @cached_property
    def _run(self) -> FilterRun:
        series = RecordSeries(self.record.outputs, driving_rows(*self._commands(0)))
        return self._filter.along(self._begin, self._numbers, series)

    @cached_property
    def _constants(self) -> Array:
        return numbers_and_constants(self._flown, self._numbers.parameters)

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
        return commands_moved(self._flown, self.record.dt, inputs, self.nuisance)[0], voltage

    @property
    def states(self) -> Array:
        """Body states after each reading (n, 12)."""
        return self._run.states.x[:, self._body]

    def ahead(self, starts: NDArray[np.intp], ahead: int) -> Array:
        """Body states 1, 2, ... samples after some starts, with nothing measured any more (starts, ahead, 12)."""
        known = self._run.states, self._numbers, *self._commands(ahead)
        return self._filter.ahead_of(*known, starts, ahead)[..., self._body]

    def closed_ahead(self, laws: Sequence[Law], starts: NDArray[np.intp], ahead: int) -> Array:
        """As `ahead`, with the loops of some axes closed."""
        inputs, (reaching, voltage) = self.record.inputs, self._commands(ahead)
        vehicle, nuisance, dt = self._flown, self.nuisance, self.record.dt
        trims = np.array([getattr(nuisance, f"trim_{name}", 0.0) for name in vehicle.input_names], dtype=float)
        delays = np.where(motors(vehicle), nuisance.delay_motor, nuisance.delay_servo)
        delay_steps = np.round(delays / dt).astype(int)
        # What reaches the vehicle is a curve through four logged samples: until here, all are from before the start.
        known = np.maximum(np.floor(delays / dt).astype(int) - 1, 0)
        reach = round(_REACH / dt)
        before = np.concatenate([np.repeat(self.states[:1], reach, axis=0), self.states])
        shares, gains, late, references = [], [], [], []
        for law in laws:
            share = shares_of(vehicle, law.axis)
            gain = np.array([dict(zip(law.motion, law.gains, strict=True)).get(name, 0.0) for name in PREDICTED])
            lag = round(law.lag / dt)
            left = np.cumsum(np.concatenate([[0.0], inputs @ share - (before @ gain)[reach - lag : len(before) - lag]]))
            low = np.maximum(starts + 1 - round(_REFERENCE / dt), 0)
            references.append((left[starts + 1] - left[low]) / (starts + 1 - low) + share @ trims)
            shares.append(share)
            gains.append(gain)
            late.append(min(lag + int(delay_steps[np.flatnonzero(share)[0]]), reach - 1))
        shared, back = np.array(shares), np.array([share / (share @ share) for share in shares])
        since = np.where(np.any(shared != 0.0, axis=0), known, ahead)  # from when each input answers
        reference, answering = np.stack(references, axis=1), reach - 1 - np.array(late)
        past = before[starts[:, None] + np.arange(1, reach + 1)]
        body, fade = self._body, self._fade
        x, gust, drift = (np.asarray(part)[starts] for part in self._run.states[:3])
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
        model, (commands, voltage) = self._filter.model, self._commands(kicks.shape[1])
        fade = self._fade
        state = model.displace(FilterState(*(np.asarray(part)[starts] for part in self._run.states)), aside)
        shown = []
        for k in range(kicks.shape[1]):
            here = starts + k
            x = self._filter.step(state.x, state.gust, state.drift, commands[here], voltage[here], self._constants)
            state = model.displace(FilterState(x, fade * state.gust, state.drift), kicks[:, k])
            shown.append(model.measure(state.x.T, self.nuisance, _ARRAYS).T)
        return np.stack(shown, axis=1)

    @cached_property
    def uncertainty(self) -> tuple[Array, Array, Array, Array]:
        """Of the joined system about the mean flight, nose north: its transition, and the covariances of what disturbs
        it, of the sensors' noise and of what the observer makes of a reading."""
        vehicle, record = self.vehicle, self.record
        told = vehicle.values(), self.noise, self.nuisance, [0.0]
        rows = FilterNumbers(*(np.array([row], dtype=np.float64) for row in told))
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
        laws = learnt(self._flown, record, self.states, axes=close_loop, seconds=settling)
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
