"""A channel thinned for the screen: of every bin of samples the lowest and the highest stay, at their own times."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.flights.stored_column import StoredColumn

_GAP = (10.0, 0.5)
"""Usual steps, and seconds: a step longer than both is a gap. The rule of `flights.maneuvers.sweeps`."""


class BinnedTrace(NamedTuple):
    """What is drawn: times [s] and values, NaN where the line is broken."""

    time: Array
    values: Array
    thinned: bool


def gaps(time: Array) -> NDArray[np.int64]:
    """Indices of the samples before which the log has a gap."""
    if time.size < 2:
        return np.zeros(0, dtype=np.int64)
    steps = np.diff(time)
    return np.flatnonzero(steps > max(_GAP[0] * float(np.median(steps)), _GAP[1])) + 1


def window(time: Array, start: float, stop: float) -> slice:
    """The samples from start to stop [s], with one more at each side: the line runs to the edge of the plot."""
    first = max(0, int(np.searchsorted(time, start, side="left")) - 1)
    last = min(time.size, int(np.searchsorted(time, stop, side="right")) + 1)
    return slice(first, last)


def extremes(values: NDArray[np.generic], bins: int) -> NDArray[np.int64]:
    """Indices of the lowest and the highest sample of each bin, rising and without repetition.

    Args:
        values: shape (n,); samples that are not finite count only where a bin holds no other.
        bins: at most so many, of equal numbers of samples; the last one may hold fewer.
    """
    n = values.size
    if n == 0:
        return np.zeros(0, dtype=np.int64)
    size = -(-n // bins)
    full = n // size * size
    table = values[:full].reshape(-1, size)
    with np.errstate(invalid="ignore", over="ignore"):
        all_finite = bool(np.isfinite(table.sum()))  # one pass: NaN and infinity show in a sum
    if all_finite:
        low, high = table.argmin(axis=1), table.argmax(axis=1)
    else:
        finite = np.isfinite(table)
        low = np.where(finite, table, np.inf).argmin(axis=1)
        high = np.where(finite, table, -np.inf).argmax(axis=1)
    begin = np.arange(0, full, size)
    indices = [begin + low, begin + high]
    if full < n:
        rest = values[full:]
        finite_rest = np.isfinite(rest)
        indices.append(full + np.array([np.argmin(np.where(finite_rest, rest, np.inf))]))
        indices.append(full + np.array([np.argmax(np.where(finite_rest, rest, -np.inf))]))
    return np.unique(np.concatenate(indices))


def trace(
    time: Array, values: Array | StoredColumn, *, start: float, stop: float, bins: int, breaks: NDArray[np.int64]
) -> BinnedTrace:
    """A channel between two times, thinned where it has more than two samples a bin, broken at its gaps.

    Args:
        time: strictly increasing [s], shape (n,); values: shape (n,).
        start, stop: [s].
        bins: of the screen.
        breaks: of the whole channel, from `gaps`.
    """
    part = window(time, start, stop)
    column = values if isinstance(values, StoredColumn) else StoredColumn(values)
    inside = column.stored[part]
    thinned = inside.size > 2 * bins
    chosen = part.start + (extremes(inside, bins) if thinned else np.arange(inside.size))
    shown_time, shown = time[chosen], column.at(chosen)
    shown = np.where(np.isfinite(shown), shown, np.nan)
    here = breaks[(breaks > part.start) & (breaks < part.stop)]
    # The place in what is shown before which each gap lies, and a time inside it.
    places = np.searchsorted(chosen, here)
    inner = (places > 0) & (places < chosen.size)
    places, middle = places[inner], 0.5 * (time[here[inner] - 1] + time[here[inner]])
    return BinnedTrace(np.insert(shown_time, places, middle), np.insert(shown, places, np.nan), thinned)
