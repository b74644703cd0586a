"""Flights that a model and its gusts might have gone on to make from a start, as the sensors would have shown them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import FilterState
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.records import Record
from swashplate.identification.time.beginning import numbers_and_constants
from swashplate.identification.time.kinematics import PREDICTED, measured_states, samples_smoothed
from swashplate.identification.time.record_filter import record_filter
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import ArrayBackend
from swashplate.validation.bands import BandedRecord
from swashplate.validation.prediction import Observed, Predictions, observed, uncertainty

_ARRAYS = ArrayBackend()


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
    draws: Sequence[Vehicle],
    record: Record,
    *,
    noise: Noise,
    nuisance: Nuisance,
    predictions: Predictions,
    truth: Array,
    longest: int | None = None,
    wider: Array | float = 1.0,
) -> Fan:
    """The fan of drawn models about a model's predictions.

    Args:
        draws, record, noise, nuisance: of `paths`. predictions: of the model itself.
        truth: body states (n, 12) that came.
        longest: samples ahead that count; all of the predictions' where None.
        wider: how many times as far from the prediction the paths are taken, (12,).
    """
    starts, about = predictions.starts, predictions.states[:, :longest]
    ahead = about.shape[1]
    places = np.minimum(starts[:, None] + np.arange(1, ahead + 1), len(truth) - 1)
    came = truth[places]
    below, variance, own_variance = (np.zeros(about.shape) for _ in range(3))
    for path, undisturbed in paths(draws, record, noise=noise, nuisance=nuisance, starts=starts, ahead=ahead):
        below += about + wider * (path - about) < came
        variance += (wider * (path - about)) ** 2 / len(draws)
        own_variance += (wider * (undisturbed - about)) ** 2 / len(draws)
    return Fan(len(draws), below, variance, own_variance, (came - about) ** 2, np.broadcast_to(wider, about.shape[-1:]))


def paths(
    draws: Sequence[Vehicle],
    record: Record,
    *,
    noise: Noise,
    nuisance: Nuisance,
    starts: NDArray[np.intp],
    ahead: int,
    seed: int = 0,
) -> Iterator[tuple[Array, Array]]:
    """Of each drawn model a path and its prediction from each start: body states (starts, ahead, 12), those of the path
    as `measured_states` would show them.

    A path begins where the drawn model's own observer saw the aircraft, a draw of that observer's error aside. Gusts,
    drifts and white accelerations are drawn anew along it, and so is the noise of the sensors. Delays, trims and lever
    arm are what the record told the model.

    Args:
        draws: models that a fit cannot tell apart. record: what is predicted.
        noise: of the model. nuisance: of the record. starts: samples. ahead: how many samples.
        seed: of all that is random.
    """
    random, half = np.random.default_rng(seed), samples_smoothed(record.dt) // 2
    length = ahead + half
    before: Vehicle | None = None
    for vehicle in draws:
        if vehicle is not before:
            filtered = observed(vehicle, record, noise=noise, nuisance=nuisance, beyond=length)
            _, _, Q, R, P = uncertainty(vehicle, record, noise=noise, nuisance=nuisance)
            roots = [_root(part) for part in (P, Q, R)]
            undisturbed = filtered.ahead(starts, ahead)
            before = vehicle
        aside, kicks, shaken = (
            random.standard_normal((len(starts), *count, len(root))) @ root.T
            for root, count in zip(roots, ((), (length,), (length,)), strict=True)
        )
        readings = _shown(filtered, starts, aside, kicks) + shaken
        reached = record.outputs[np.maximum(starts[:, None] + np.arange(1 - half, 1), 0)]  # by the smoothing
        joined = np.concatenate([reached, readings], axis=1)
        flat = joined.reshape(-1, joined.shape[-1])
        side_by_side = replace(record, time=np.linspace(0.0, record.dt * (len(flat) - 1), len(flat)), outputs=flat)
        states = measured_states(side_by_side, nuisance).reshape(*joined.shape[:2], len(PREDICTED))
        # Where the smoothing reaches no neighbour.
        yield states[:, half : half + ahead], undisturbed[..., [vehicle.index(name) for name in PREDICTED]]


def _root(covariance: Array) -> Array:
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def _shown(filtered: Observed, starts: NDArray[np.intp], aside: Array, kicks: Array) -> Array:
    """Readings without the sensors' noise (runs, samples, outputs), of states that begin `aside` (runs, joined) and are
    kicked at every sample (runs, samples, joined)."""
    model, numbers = filtered.model, numbers_and_constants(filtered.model.vehicle, filtered.numbers.parameters)
    noise, nuisance = Noise(*filtered.numbers.noise), Nuisance(*filtered.numbers.nuisance)
    fade, step = model.fade(noise), record_filter(model).step
    state = FilterState(*(np.asarray(part)[starts] for part in filtered.filtered))
    state, shown = model.displace(state, aside), []
    for k in range(kicks.shape[1]):
        here = starts + k
        x = step(state.x, state.gust, state.drift, filtered.commands[here], filtered.voltage[here], numbers)
        state = model.displace(FilterState(x, fade * state.gust, state.drift), kicks[:, k])
        shown.append(model.measure(state.x.T, nuisance, _ARRAYS).T)
    return np.stack(shown, axis=1)
