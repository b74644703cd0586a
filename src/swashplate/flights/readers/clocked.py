"""Streams from a log's stamped samples: what to do about stamps that fall back, and numbers that are none."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.flights import units
from swashplate.flights.flight import stream
from swashplate.flights.schema import channel

Mask = NDArray[np.bool_]

_END = 1 << 62  # behind every place in a file
_FALL = 1.0  # s: messages overtake each other by milliseconds; a clock that falls by more was started anew
_WINDOW = 11  # messages: fewer damaged stamps than half of that do not look like a reset


def longest_increasing(time: Array) -> Mask:
    """Which stamps to keep so that the most of them strictly increase (longest increasing subsequence).

    One wild stamp, high or low, costs itself and nothing else (Fredman, 1975: n log n).
    """
    keep = np.ones(time.size, dtype=np.bool_)
    if time.size < 2 or bool(np.all(time[1:] > time[:-1])):
        return keep
    values = time.tolist()
    ends: list[float] = []  # smallest end of an increasing run of each length
    at: list[int] = []
    before = [-1] * len(values)
    for i, value in enumerate(values):
        if value != value:
            continue
        length = bisect_left(ends, value)
        before[i] = at[length - 1] if length else -1
        if length == len(ends):
            ends.append(value)
            at.append(i)
        else:
            ends[length], at[length] = value, i
    keep[:] = False
    i = at[-1] if at else -1
    while i >= 0:
        keep[i] = True
        i = before[i]
    return keep


def resets(place: NDArray[np.int64], time: Array) -> NDArray[np.int64]:
    """Places in the file at which the clock of the log started anew, in order.

    Args:
        place: of every stamped message of the log, increasing, shape (n,).
        time: its stamp [s].
    """
    if not np.any(np.diff(time) < 0.0):
        return np.zeros(0, dtype=np.int64)
    from scipy.ndimage import median_filter  # a third of a second that most logs need not wait

    smooth = median_filter(time, size=_WINDOW, mode="nearest")
    falls = np.flatnonzero(np.diff(smooth) < -_FALL)
    places = []
    for i in falls.tolist():
        near = np.arange(max(0, i - _WINDOW), min(time.size - 1, i + _WINDOW))
        places.append(int(place[near[np.argmin(np.diff(time)[near])] + 1]))
    return np.unique(np.asarray(places, dtype=np.int64))


def longest_run(place: NDArray[np.int64], time: Array) -> tuple[tuple[int, int], str]:
    """The part of the file (first place, place after its last) with the most messages between clock resets.

    Returns:
        The part, and in words what was left out ("" where the clock never falls back).
    """
    edges = [0, *resets(place, time).tolist(), _END]
    counts = np.histogram(place, bins=edges)[0] if len(edges) > 2 else np.array([place.size])
    best = int(np.argmax(counts))
    said = ""
    if len(edges) > 2:
        said = (
            f"the clock starts anew {len(edges) - 2} times; only the longest run was read ({counts[best]} of "
            f"{counts.sum()} messages, the {best + 1}. run)"
        )
    return (edges[best], edges[best + 1]), said


def converted(values: Array, unit: str) -> tuple[Array, str]:
    """Values in the unit inside, and that unit."""
    return (units.to_inside(values, unit), units.inside_unit(unit)) if unit else (values, "")


def made_stream(
    name: str, time: Array, columns: Mapping[str, tuple[Array, str]], *, notes: list[str]
) -> xr.Dataset | None:
    """A stream from what a log holds; None where fewer than two samples can be used.

    Args:
        name: of the stream, for the notes.
        time: stamps [s], shape (n,), in any state.
        columns: values and their unit in the log, by channel.
        notes: takes a line for what was left out.
    """
    channels = {
        channel_name: converted(np.asarray(v, dtype=np.float64), unit) for channel_name, (v, unit) in columns.items()
    }
    empty = [key for key, (values, _) in channels.items() if not np.isfinite(values).any()]
    for key in empty:
        del channels[key]
    if not channels or time.size < 2:
        return None
    usable = np.isfinite(time)
    for values, _ in channels.values():
        usable &= np.isfinite(values)
    lost = int(usable.size - usable.sum())
    if lost:
        notes.append(f"{name}: {lost} of {usable.size} samples left out because a number is missing or not finite")
    rising = longest_increasing(time[usable])
    if not rising.all():
        count = int(rising.size - rising.sum())
        notes.append(f"{name}: {count} of {rising.size} samples left out because their time repeats or goes backwards")
    if rising.sum() < 2:
        return None
    stamps = time[usable][rising]
    known = {key: channel(key).unit for key in channels}
    labels = {key: unit for key, (_, unit) in channels.items() if not known[key]}
    return stream(stamps, {key: values[usable][rising] for key, (values, _) in channels.items()}, labels)


def unread(counts: Mapping[str, int], read: Sequence[str]) -> tuple[str, ...]:
    """A note on the messages that a log holds beside those that were read."""
    rest = {name: n for name, n in counts.items() if name not in read}
    if not rest:
        return ()
    listed = ", ".join(f"{name} ({n})" for name, n in sorted(rest.items(), key=lambda item: (-item[1], item[0])))
    return (f"also in the log, not read: {listed}",)
