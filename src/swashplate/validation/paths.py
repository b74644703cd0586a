"""Flights that a model and its gusts might have gone on to make from a start, as the sensors would have shown them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.identification.core.records import Record
from swashplate.identification.time.kinematics import PREDICTED, measured_states, samples_smoothed
from swashplate.validation.bands import BandedRecord
from swashplate.validation.prediction import ObservedRecord, Predictions


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
