"""Outliers: single samples and short glitches that no motion of the aircraft explains.

A sample is an outlier where it disagrees with three predictions at once, each measured against the local scale of
the residual: a robust parabola through both neighbourhoods (Hampel 1974; Cleveland 1979 for the robust local fit),
a robust line through the samples before it, and one through those after it. The two one-sided lines are the jump
test: the first sample of a real step agrees with what follows it, a glitch agrees with neither side.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.conditioning.attitude import continuous
from swashplate.flights.flight import Flight
from swashplate.flights.schema import CHANNELS, QUATERNION
from swashplate.flights.storage import over_time, timed

Mask = NDArray[np.bool_]
HALF_WINDOW = 6  # samples each side: a glitch of three samples is then a quarter of the neighbourhood
SCALE_WINDOW = 1.0  # s: the scale follows how lively the flight is at that moment
_CURVED = 0.02  # of the movement in the window: what a parabola may miss of a fast motion without noise
_MAD_TO_SIGMA = 1.4826  # normal distribution
_MINIMUM_LENGTH = 0.5  # a quaternion shorter than this means that tracking was lost


@dataclass(frozen=True)
class OutlierRule:
    """How far off is too far.

    Attributes:
        threshold: residual against local standard deviations (two-sided prediction); half of it for the sided ones.
        longest: a run of more flagged samples than this is motion, and is kept.
    """

    threshold: float = 6.0
    longest: int = 5


def _windows(n: int, first: int, last: int) -> NDArray[np.intp]:
    """Indices of the samples from `first` to `last` around every sample, kept inside the record; a column each."""
    around = np.arange(first, last + 1)[:, None] + np.arange(n)
    shift = np.maximum(0, -around[0]) - np.maximum(0, around[-1] - (n - 1))
    return np.asarray(around + shift, dtype=np.intp)


def _middle(rows: Array) -> Array:
    """The median of every column, (n,): a sort where `numpy.median` looks for what is not a number as well."""
    half = len(rows) // 2
    if len(rows) % 2:
        return np.asarray(np.partition(rows, half, axis=0)[half])
    return np.asarray(np.partition(rows, (half - 1, half), axis=0)[half - 1 : half + 1].mean(axis=0))


def _parabola(moments: list[Array], right: list[Array]) -> list[Array]:
    """The coefficients of parabolas by elimination in their normal equations, of which every column is one."""
    ridge = 1e-9
    first, second, third = moments[0] + ridge, moments[2] + ridge, moments[4] + ridge
    by, over = moments[1] / first, moments[2] / first
    second, cross, third = second - by * moments[1], moments[3] - by * moments[2], third - over * moments[2]
    linear, square = right[1] - by * right[0], right[2] - over * right[0]
    square = (square - cross / second * linear) / (third - cross / second * cross)
    linear = (linear - cross * square) / second
    return [(right[0] - moments[1] * linear - moments[2] * square) / first, linear, square]


def _two_sided(time: Array, values: Array, passes: int = 5) -> Array:
    """Residual against a robust parabola through the neighbours, the sample itself left out; shape (n,)."""
    n = time.size
    window = _windows(n, -HALF_WINDOW, HALF_WINDOW)
    offset = time[window] - time
    offset /= np.max(np.abs(offset), axis=0)
    near = values[window]
    square = offset**2
    powers = [np.ones_like(offset), offset, square, square * offset, square**2]
    others = (window != np.arange(n)).astype(np.float64)
    weight = others.copy()
    fit = [np.zeros(n)]
    for _ in range(passes):
        moments = [np.einsum("jn,jn->n", weight, power) for power in powers]  # the normal equations' entries
        right = [np.einsum("jn,jn->n", weight * near, power) for power in powers[:3]]
        fit = _parabola(moments, right)
        residual = np.abs(near - (fit[0] + offset * (fit[1] + offset * fit[2])))
        scale = _middle(residual) * 6.0 + np.finfo(float).tiny
        weight = others * (np.maximum(0.0, 1.0 - (residual / scale) ** 2) ** 2 + 1e-6)
    return values - fit[0]


def _one_sided(time: Array, values: Array, *, after: bool) -> Array:
    """Residual against a Theil-Sen line (Sen 1968) through the samples before (or after), extrapolated; (n,)."""
    window = _windows(time.size, 1, HALF_WINDOW) if after else _windows(time.size, -HALF_WINDOW, -1)
    offset = time[window] - time
    near = values[window]
    pairs = np.array(list(combinations(range(HALF_WINDOW), 2))).T
    slope = _middle((near[pairs[1]] - near[pairs[0]]) / (offset[pairs[1]] - offset[pairs[0]]))
    return values - _middle(near - slope * offset)


def _local_sigma(time: Array, residual: Array) -> Array:
    """Running standard deviation of the residual by median absolute deviation, shape (n,)."""
    span = max(3, round(SCALE_WINDOW / float(np.median(np.diff(time)))) | 1)
    size = np.abs(residual)
    local = np.asarray(median_filter(size, size=min(span, size.size), mode="mirror"), dtype=np.float64)
    # A quiet second must not make the next ordinary sample an outlier.
    return np.asarray(_MAD_TO_SIGMA * np.maximum(local, np.median(size)), dtype=np.float64)


def _local_range(values: Array) -> Array:
    """How far the channel moves within the window (10 to 90 %, so that no glitch counts), shape (n,)."""
    near = values[_windows(values.size, -HALF_WINDOW, HALF_WINDOW)]
    low, high = np.percentile(near, [10.0, 90.0], axis=0)
    return np.asarray((high - low) / 0.8, dtype=np.float64)


def outliers(time: Array, values: Array, *, rule: OutlierRule | None = None) -> Mask:
    """Which samples of one channel are outliers.

    Args:
        time: strictly increasing stamps [s], shape (n,); they may jitter.
        values: the channel, shape (n,), any unit.
        rule: thresholds.

    Returns:
        shape (n,), True where the sample is not a number or an outlier.
    """
    rule = rule or OutlierRule()
    flagged = ~np.isfinite(values)
    good = np.flatnonzero(~flagged)
    if good.size < 2 * HALF_WINDOW + 1:
        return flagged
    t, y = time[good], values[good]
    rounding = 1e-9 * (np.max(y) - np.min(y)) + np.finfo(float).eps * np.max(np.abs(y)) + np.finfo(float).tiny
    both = _two_sided(t, y)
    limit = np.maximum(rule.threshold * _local_sigma(t, both), _CURVED * _local_range(y)) + rounding
    sided = [2.0 * np.abs(_one_sided(t, y, after=after)) for after in (False, True)]
    score = np.min([np.abs(both), *sided], axis=0) / limit
    odd = np.zeros(good.size, dtype=np.bool_)
    # A long run may be motion with a glitch on top of it: look at it again with a coarser measure.
    for factor in (1.0, 3.0, 9.0):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], (score > factor).astype(np.int8), [0]])))
        for start, stop in zip(edges[::2], edges[1::2], strict=True):
            if stop - start <= rule.longest:
                odd[start:stop] = True
    flagged[good] = odd
    return flagged


def _channels(data: xr.Dataset) -> tuple[dict[str, Array], Mask]:
    """The columns to be tested, and the samples whose quaternion has no length; its signs are made continuous."""
    columns = {str(name): np.asarray(values.values, dtype=np.float64) for name, values in data.data_vars.items()}
    lost = np.zeros(data.sizes["time"], dtype=np.bool_)
    if all(name in columns for name in QUATERNION):
        q = np.stack([columns[name] for name in QUATERNION], axis=-1)
        lost = ~(np.linalg.norm(q, axis=1) > _MINIMUM_LENGTH)
        if not lost.all():
            q[~lost] = continuous(q[~lost])
        q[lost] = np.nan
        columns.update(zip(QUATERNION, q.T, strict=True))
    for name in ("phi", "psi"):
        if name in columns and np.isfinite(columns[name]).all():
            columns[name] = np.unwrap(columns[name])
    return columns, lost


def remove_outliers(flight: Flight, *, threshold: float = 6.0, longest: int = 5) -> Flight:
    """The flight without outliers: a sample that is one in any channel of its stream becomes a gap in that stream.

    The history says how many went and in which channel. Quaternion signs are made continuous on the way. Channels that
    the schema does not know are judged by being finite only.

    Args:
        flight: at its native stamps.
        threshold: in local standard deviations of the prediction residual.
        longest: longest glitch [samples]; what lasts longer is taken for motion.

    Raises:
        FlightError: where a channel has no finite sample at all.
    """
    rule = OutlierRule(threshold=threshold, longest=longest)
    streams: dict[str, xr.Dataset] = {}
    removed: dict[str, int] = {}
    by_channel: dict[str, int] = {}
    for name, data in flight.streams.items():
        time = np.asarray(data["time"].values, dtype=np.float64)
        columns, lost = _channels(data)
        bad = lost.copy()
        for channel, values in columns.items():
            if values.size and not np.isfinite(values).any():
                raise FlightError(
                    "has no finite sample (all are NaN or infinite).",
                    where=flight.provenance.source or None,
                    channel=channel,
                    hint="Leave the channel out when reading, or repair the log.",
                )
            # A channel outside the schema (a log's own estimates) takes no sample of the others with it.
            here = outliers(time, values, rule=rule) if channel in CHANNELS else ~np.isfinite(values)
            if here.any():
                by_channel[channel] = int(here.sum())
            bad |= here
        removed[name] = int(bad.sum())
        cleaned = data.assign({q: timed(columns[q], data[q].attrs) for q in QUATERNION if q in columns})
        kept = {str(n): timed(v.values[~bad], v.attrs) for n, v in cleaned.variables.items()}
        streams[name] = over_time(kept.pop("time"), kept, cleaned.attrs)
    return flight.with_streams(streams).done(
        "remove_outliers", threshold=threshold, longest=longest, removed=removed, by_channel=by_channel
    )
