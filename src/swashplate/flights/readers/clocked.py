"""What a log's clock did, by one rule for every reader.

* A counter of 32 bits that turned over is counted on: nothing is lost, and a note says so.
* Where the clock was started anew, the longest run is read. Two runs are never spliced.
* Of that run the most samples whose stamps increase are kept.
* A sample that stands in the log twice, stamp and numbers, is a copy: leaving one out loses nothing.

Whatever else is left out is lost. It is told as damage, a problem with its share of the log.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights import units
from swashplate.flights.flight import stream
from swashplate.flights.readers import checks
from swashplate.flights.readers.source import Places
from swashplate.flights.schema import channel
from swashplate.flights.stored_column import StoredColumn

Mask = NDArray[np.bool_]
Number = TypeVar("Number", bound=np.generic)

TURN = 1 << 32  # ticks: where a counter of 32 bits begins anew, after 71.6 minutes of microseconds
DAY = 86400.0  # s: where a time of day begins anew

_END = 1 << 62  # behind every place in a file
_FALL = 1.0  # s: messages overtake each other by milliseconds; a clock that falls by more was started anew
_WINDOW = 11  # messages: fewer damaged stamps than half of that do not look like a reset
_SEAM = 3.0  # usual steps, and a second at least: a longer pause leaves open whether a counter turned over


@dataclass
class Remarks:
    """What a reader says of a log: `notes` for the user to know, `damage` for what is lost."""

    notes: list[str] = field(default_factory=list)
    damage: list[str] = field(default_factory=list)


def share(count: int, total: int, what: str = "samples") -> str:
    """How much of something is meant: "600 of 1200 samples (50 %)"."""
    return f"{count} of {total} {what} ({100.0 * count / max(total, 1):.3g} %)"


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


# ---- one row of stamps -----------------------------------------------------------------------------------------------
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


def unturned(time: Array, turns: Iterable[float]) -> tuple[Array, int]:
    """Stamps of a counter that turned over, counted on, and how often it did.

    A fall counts as a turn where one of `turns` explains it to within a usual step; any other fall is left as it is.

    Args:
        time: [s], shape (n,), finite.
        turns: what the counter may hold [s].
    """
    steps = np.diff(time)
    falls = steps < 0.0
    if not falls.any() or not (steps > 0.0).any():
        return time, 0
    usual = max(1.0, _SEAM * float(np.median(steps[steps > 0.0])))
    for turn in turns:
        # Neighbours that overtake each other at the seam step back over it: up by nearly a turn.
        over = np.where(np.abs(np.abs(steps) - turn) < usual, -np.sign(steps), 0.0)
        count = int(np.sum(over))
        if count > 0 and turn > 2.0 * usual:
            return np.asarray(time + turn * np.concatenate(([0.0], np.cumsum(over)))), count
    return time, 0


def copies(time: Array, columns: Iterable[NDArray[np.generic]]) -> Mask:
    """Which samples are the one before them once more: the same stamp and the same numbers, shape (n,).

    Args:
        columns: of shape (n,) or (n, k).
    """
    same = np.concatenate(([False], time[1:] == time[:-1]))[: time.size]
    doubled = np.flatnonzero(same)
    for values in columns if doubled.size else ():
        now, before = values[doubled], values[doubled - 1]
        alike = (now == before) | ((now != now) & (before != before))
        same[doubled] &= alike if alike.ndim == 1 else alike.all(axis=1)
    return np.asarray(same)


def usable(
    time: Array,
    columns: Iterable[Array] = (),
    *,
    where: str,
    bad_stamps: str,
    remarks: Remarks,
    channel: str = "time",
    tick: float = 1e-6,
    turns: Sequence[float] = (),
) -> tuple[Array, Mask]:
    """The stamps of a table that can be used, and which samples they are of.

    A table's owner can mend it, so by default bad stamps are an error; what is dropped on request is told as damage.

    Args:
        time: stamps [s], shape (n,).
        columns: the samples' numbers, of shape (n,) or (n, k).
        bad_stamps: "error" (a stamp that repeats or goes back is an error that names the sample) or "drop".
        remarks: takes what was left out.
        tick: of the file's counter [s], beside micro- and milliseconds.
        turns: other times [s] at which the clock begins anew.

    Returns:
        Stamps that increase, shape (m,), and a mask of the samples that are kept, shape (n,).
    """
    if bad_stamps not in ("error", "drop"):
        raise FlightError(f"bad_stamps is '{bad_stamps}', expected 'error' or 'drop'.", where=where)
    if time.size < 2:
        count = "one sample" if time.size else "no samples"
        raise FlightError(
            f"has {count}; a flight needs at least two.", where=where, channel=channel, hint="Give a longer record."
        )
    checks.finite(time, channel=channel, where=where)
    time, turned = unturned(time, (*turns, *dict.fromkeys(TURN * each for each in (1e-6, 1e-3, tick))))
    if turned:
        remarks.notes.append(f"the clock's counter turned over {_times(turned)}: it was counted on")
    twice = copies(time, columns)
    if twice.any():
        remarks.notes.append(f"{share(int(twice.sum()), time.size)} are copies of the one before them: left out")
    place = np.flatnonzero(~twice)
    (first, last), anew = longest_run([(place, time[place])])
    keep = ~twice & (np.arange(time.size) >= first) & (np.arange(time.size) < last)
    keep[keep] = longest_increasing(time[keep])
    lost = ~keep & ~twice
    if lost.any():
        some, (bad, what) = share(int(lost.sum()), time.size), _first_bad(time, twice)
        said = anew or f"{some} are lost because their time repeats or goes backwards, first at sample {bad}"
        if bad_stamps == "error":
            raise FlightError(
                f"{what}; {some} can not be used{': the clock starts anew there' * bool(anew)}.",
                where=where,
                channel=channel,
                hint="Repair the log, or leave these samples out: --drop-bad-stamps (in Python bad_stamps='drop').",
            )
        remarks.damage.append(said)
    if keep.sum() < 2:
        raise FlightError("less than two samples have increasing times.", where=where, channel=channel)
    return time[keep], keep


def _first_bad(time: Array, twice: Mask) -> tuple[int, str]:
    """The first sample whose time does not increase, and what is wrong with it in words."""
    before = np.maximum.accumulate(time)[:-1]
    at = int(np.flatnonzero((time[1:] <= before) & ~twice[1:])[0]) + 1
    what = "repeats the stamp before it" if time[at] == before[at - 1] else "goes backwards"
    return at, f"time {what} at sample {at} ({before[at - 1]:.6f} s, then {time[at]:.6f} s)"


# ---- the stamps of a whole log ---------------------------------------------------------------------------------------
def resets(place: Places, time: Array) -> NDArray[np.int64]:
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


def longest_run(clocks: Sequence[tuple[Places, Array]]) -> tuple[tuple[int, int], str]:
    """The part of a file (first place, place after its last) with the most messages between clock resets.

    Args:
        clocks: places (increasing, comparable between clocks) and stamps [s] of the messages that one clock stamps.

    Returns:
        The part, and in words what is lost ("" where no clock falls back).
    """
    total, anew, first, last = sum(place.size for place, _ in clocks), 0, 0, _END
    inside = sorted(clocks, key=lambda clock: -clock[0].size)  # fast ones know the place best
    while True:
        edges = next((at for place, time in inside if (at := resets(place, time)).size), None)
        if edges is None:
            break
        bounds = [first, *edges.tolist(), last]
        counts = np.sum([np.histogram(place, bins=bounds)[0] for place, _ in inside], axis=0)
        best = int(np.argmax(counts))
        first, last, anew = bounds[best], bounds[best + 1], anew + len(edges)
        chosen = [(place >= first) & (place < last) for place, _ in inside]
        inside = [(place[mask], time[mask]) for (place, time), mask in zip(inside, chosen, strict=True)]
    if not anew:
        return (first, last), ""
    lost = total - sum(place.size for place, _ in inside)
    said = f"the clock starts anew {_times(anew)}; only the longest run was read: {share(lost, total)} are lost"
    return (first, last), said


def converted(values: Array | StoredColumn, unit: str) -> tuple[Array | StoredColumn, str]:
    """Values in the unit inside, and that unit."""
    if isinstance(values, StoredColumn):
        factor = float(units.to_inside(1.0, unit)) if unit else 1.0
        return StoredColumn(values.stored, *values.factors, factor), units.inside_unit(unit) if unit else ""
    numbers = np.asarray(values, dtype=np.float64)
    return (units.to_inside(numbers, unit), units.inside_unit(unit)) if unit else (numbers, "")


def numbers_of(values: Array | StoredColumn) -> Array:
    """What a column stands for."""
    return values.numbers if isinstance(values, StoredColumn) else values


def _stored(values: Array | StoredColumn) -> NDArray[np.generic]:
    return values.stored if isinstance(values, StoredColumn) else values


def made_stream(
    name: str, time: Array, columns: Mapping[str, tuple[Array | StoredColumn, str]], *, remarks: Remarks
) -> xr.Dataset | None:
    """A stream from what a log holds; None where fewer than two samples can be used.

    Args:
        name: of the stream, for what is told.
        time: stamps [s], shape (n,), in any state.
        columns: values and their unit in the log, by channel.
        remarks: takes a line for what was left out.
    """
    channels = {channel_name: converted(*column) for channel_name, column in columns.items()}
    good = np.isfinite(time)
    for key, (values, _) in list(channels.items()):
        stored = _stored(values)
        if stored.dtype.kind == "f":  # whole numbers are finite
            finite = np.isfinite(stored)
            if finite.any():
                good &= finite
            else:
                del channels[key]
    if not channels or time.size < 2:
        return None
    if not good.all():
        lost = share(int(good.size - good.sum()), good.size)
        remarks.damage.append(f"{name}: {lost} are lost because a number is missing or not finite")
    twice = copies(_rows(time, good), (_rows(_stored(values), good) for values, _ in channels.values()))
    if twice.any():
        remarks.notes.append(
            f"{name}: {share(int(twice.sum()), good.size)} are copies of the one before them: left out"
        )
    good[good] = ~twice
    rising = longest_increasing(_rows(time, good))
    if not rising.all():
        lost = share(int(rising.size - rising.sum()), rising.size)
        remarks.damage.append(f"{name}: {lost} are lost because their time repeats or goes backwards")
    good[good] = rising
    if good.sum() < 2:
        return None
    known = {key: channel(key).unit for key in channels}
    labels = {key: unit for key, (_, unit) in channels.items() if not known[key]}
    return stream(_rows(time, good), {key: _chosen(values, good) for key, (values, _) in channels.items()}, labels)


def _chosen(values: Array | StoredColumn, chosen: Mask) -> Array | StoredColumn:
    if isinstance(values, StoredColumn):
        return StoredColumn(_rows(values.stored, chosen), *values.factors)
    return _rows(values, chosen)


def _rows(values: NDArray[Number], chosen: Mask) -> NDArray[Number]:
    """What is chosen; the values themselves where all are, for a log of a gigabyte has no room for copies."""
    return np.ascontiguousarray(values) if chosen.all() else values[chosen]


def unread(counts: Mapping[str, int], read: Sequence[str]) -> tuple[str, ...]:
    """A note on the messages that a log holds beside those that were read."""
    rest = {name: n for name, n in counts.items() if name not in read}
    if not rest:
        return ()
    listed = ", ".join(f"{name} ({n})" for name, n in sorted(rest.items(), key=lambda item: (-item[1], item[0])))
    return (f"also in the log (`swash open` finds and plots all of it): {listed}",)
