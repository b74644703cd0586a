"""From what Blackbox frames have written to their values: prediction, time, and what cannot be trusted.

Source: "Blackbox logging internals" of Betaflight's documentation (sections "Field predictors", "Logging interval",
"Log validation").
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.flights.readers.blackbox_encodings import Whole
from swashplate.flights.readers.blackbox_frames import FoundFrames
from swashplate.flights.readers.blackbox_header import Header
from swashplate.flights.readers.clocked import TURN

_LEAP = 10_000_000  # us: a clock that goes further from one frame to the next is damaged, says the documentation
_LONG = 1024  # frames behind one I frame: longer rows are added up one by one, shorter ones side by side
_WILD = 3  # frames at a seam of two runs of the clock that may be left out of the first
_RESUMES = 14  # the event that announces a leap


@dataclass(frozen=True)
class Main:
    """The main frames that can be trusted.

    Attributes:
        columns: values by field name, whole numbers, shape (n,).
        time: of each frame [s], on the autopilot's clock, shape (n,).
        kept: which of the frames found they are.
        clock: time of every frame found [s].
        damage: what had to be left out, in words. notes: what a user must know.
    """

    columns: dict[str, Whole]
    time: Array
    kept: NDArray[np.bool_]
    clock: Array
    damage: tuple[str, ...]
    notes: tuple[str, ...]


def _fitting(values: Whole, signed: bool) -> Whole:
    """Numbers of 32 bits, as the autopilot holds them."""
    low = values & 0xFFFFFFFF
    return np.asarray((low ^ 0x80000000) - 0x80000000 if signed else low)


def constants(header: Header) -> dict[int, int]:
    """What the predictors that do not look back stand for; where the header is silent, what blackbox-tools takes."""
    least = header.number("minthrottle", 1150.0)
    return {
        4: int(least),
        8: 1500,
        9: int(header.number("vbatref", 4095.0)),
        11: int(header.number("motorOutput", least)),
    }


def predicted(frames: FoundFrames, header: Header) -> Whole:
    """Values of all main frames, shape (fields, n). Every row of frames begins with an I frame."""
    intra_layout, inter_layout = header.layouts["I"], header.layouts["P"]
    fixed, names = constants(header), intra_layout.names
    values, intra = frames.written.copy(), frames.intra
    if not intra.size:
        return values
    starts = np.flatnonzero(intra)
    row_of = np.cumsum(intra) - 1
    inter = np.flatnonzero(~intra)
    averaged = []
    first = names.index("motor[0]") if "motor[0]" in names else -1
    # motor[0] comes first: others are predicted from it
    for i in sorted(range(len(names)), key=lambda i: i != first):
        signed = intra_layout.signed[i]
        row = values[i]
        for chosen, layout in ((starts, intra_layout), (inter, inter_layout)):
            predictor = layout.predictors[i]
            row[chosen] += fixed.get(predictor, 0)
            if predictor == 5 and i != first and chosen is starts:
                row[chosen] += values[first][chosen]
        row[starts] = _fitting(row[starts], signed)
        predictor = inter_layout.predictors[i]
        if predictor == 3:
            averaged.append(i)
            continue
        if predictor == 6:
            row[:] = _counted(row[starts], row_of, starts, header)
        elif predictor in (1, 2):
            steps = np.where(intra, 0, row)
            for _ in range(predictor):
                total = np.cumsum(steps)
                steps = total - total[starts][row_of]
            row[:] = steps + row[starts][row_of]
        row[:] = _fitting(row, signed)
    for signed in (True, False):
        fields = [i for i in averaged if intra_layout.signed[i] == signed]
        if fields:
            values[fields] = _averaged(values[fields], starts, signed=signed)
    for i, predictor in enumerate(inter_layout.predictors):
        if predictor == 5 and i != first:  # now that motor[0] is whole
            values[i][inter] = _fitting(values[i][inter] + values[first][inter], intra_layout.signed[i])
    return values


def _counted(first: Whole, row_of: Whole, starts: Whole, header: Header) -> Whole:
    """Loop iterations: those of I frames, and the logged ones behind them by the header's intervals."""
    intra, top, bottom = header.intervals
    offsets = np.arange(intra)
    logged = offsets[(offsets == 0) | ((offsets + top - 1) % bottom < top)]
    ahead = np.arange(row_of.size) - starts[row_of]
    base = np.searchsorted(logged, first % intra, side="right")[row_of] - 1 + ahead
    exact = first[row_of] // intra * intra + base // logged.size * intra + logged[base % logged.size]
    return np.asarray(np.where(ahead == 0, first[row_of], exact))


def _averaged(values: Whole, starts: Whole, *, signed: bool) -> Whole:
    """Each frame adds to the mean of the two before it, cut towards zero; both are the I frame behind an I frame."""
    lengths = np.diff(np.append(starts, values.shape[1]))
    for start, length in zip(starts[lengths > _LONG].tolist(), lengths[lengths > _LONG].tolist(), strict=True):
        for row in values[:, start : start + length]:
            row[:] = _one_by_one(row.tolist(), signed=signed)
    short = np.flatnonzero(lengths <= _LONG)
    order = short[np.argsort(-lengths[short], kind="stable")]
    ordered, sizes = starts[order], lengths[order]
    for step in range(1, int(sizes.max(initial=0))):
        at = ordered[: np.searchsorted(-sizes, -step, side="left")] + step
        total = values[:, at - 1] + values[:, at - min(step, 2)]
        values[:, at] = _fitting(values[:, at] + ((total + (total < 0)) >> 1), signed)
    return values


def _one_by_one(row: list[int], *, signed: bool) -> list[int]:
    one = two = row[0]
    for i in range(1, len(row)):
        total = one + two
        value = (row[i] + ((total + (total < 0)) >> 1)) & 0xFFFFFFFF
        if signed and value & 0x80000000:
            value -= TURN
        row[i] = value
        one, two = value, one
    return row


def main_frames(frames: FoundFrames, header: Header) -> Main:
    """The values of the main frames, without those that cannot be trusted."""
    names = header.layouts["I"].names
    values = predicted(frames, header)
    damage, notes = list[str](), list[str]()
    keep = _complete(frames, header, damage, notes)
    ticks = values[names.index("time")] & (TURN - 1)
    clock = _clock(frames, ticks, keep, damage)
    columns = {name: values[i][keep] for i, name in enumerate(names)}
    return Main(columns, clock[keep] / 1e6, keep, clock / 1e6, tuple(damage), tuple(notes))


def _complete(frames: FoundFrames, header: Header, damage: list[str], notes: list[str]) -> NDArray[np.bool_]:
    """Leaves out P frames of rows that lack some: whichever came behind the lost one builds on the wrong history.

    A row is whole where it has as many frames as most rows have.
    """
    keep = np.ones(frames.intra.size, dtype=np.bool_)
    # A frame into which the loss fell may end at a letter by chance: it would be half of one and half of another.
    spliced = frames.broken[(frames.broken > 0) & (frames.broken < keep.size)] - 1
    keep[spliced] = False
    if spliced.size:
        damage.append(f"{spliced.size} main frames that end where bytes were lost may be spliced: left out")
    starts = np.flatnonzero(frames.intra)
    if starts.size < 2:
        return keep
    lengths = np.diff(starts)
    resumed = [event.after for event in frames.events if event.kind == _RESUMES]
    unbroken = ~np.isin(starts[1:], frames.broken) & ~np.isin(starts[1:], np.asarray(resumed, dtype=np.int64))
    if not unbroken.any():
        return keep
    sizes, counts = np.unique(lengths[unbroken], return_counts=True)
    usual = int(sizes[np.argmax(counts)])
    intra, top, bottom = header.intervals
    said = 1 + sum((offset + top - 1) % bottom < top for offset in range(1, intra))
    if usual != said and 2 * counts.max() <= unbroken.sum():
        usual = said
    elif usual != said:
        notes.append(f"the header promises {said} main frames from I frame to I frame; there are {usual}")
    short = np.flatnonzero(unbroken & (lengths != usual))
    dropped = 0
    for i in short.tolist():
        keep[starts[i] + 1 : starts[i + 1]] = False
        dropped += int(lengths[i]) - 1
    if short.size:
        damage.append(
            f"{short.size} of {lengths.size} rows of frames lack some without a trace: their {dropped} P frames were "
            "left out, as nobody can tell which of them are right"
        )
    return keep


def _clock(frames: FoundFrames, ticks: Whole, keep: NDArray[np.bool_], damage: list[str]) -> Array:
    """Microseconds that do not turn over; frames whose clock leaps or stands still leave `keep`."""
    resumed = {event.after for event in frames.events if event.kind == _RESUMES}
    chosen = np.flatnonzero(keep)
    if not chosen.size:
        return np.zeros(ticks.size)
    steps = np.diff(ticks[chosen], prepend=ticks[chosen[:1]]) % TURN
    leaps = (steps == 0) | (steps > _LEAP)
    leaps[0] = False
    at_resume = np.isin(chosen, np.fromiter(resumed, dtype=np.int64)) if resumed else np.zeros(chosen.size, np.bool_)
    leaps &= ~(at_resume & (steps > 0) & (steps < TURN // 2))
    if leaps.any():
        runs = np.cumsum(leaps)
        # A single wild frame parts one run into two that go on alike: join what continues.
        best = _joined(ticks[chosen], runs)
        lost = chosen[~best]
        keep[lost] = False
        damage.append(
            f"the clock leaps at {int(leaps.sum())} places; {lost.size} of {chosen.size} main frames off the longest "
            "run were left out"
        )
        chosen = chosen[best]
        steps = np.diff(ticks[chosen], prepend=ticks[chosen[:1]]) % TURN
    clock = np.zeros(ticks.size)
    clock[chosen] = float(ticks[chosen[0]]) + np.cumsum(steps)
    between = np.interp(np.arange(ticks.size), chosen, clock[chosen])
    return np.asarray(between)


def _joined(ticks: Whole, runs: Whole) -> NDArray[np.bool_]:
    """The frames of the longest chain of runs in which each goes on within a leap of the one before it.

    Frames at a seam that are wild, or stand there twice, are left out.
    """
    edges = np.flatnonzero(np.diff(runs, prepend=-1))
    ends = np.append(edges[1:], runs.size)
    sizes = ends - edges
    best = np.zeros(runs.size, dtype=np.bool_)
    seed = int(np.argmax(sizes))
    best[edges[seed] : ends[seed]] = True
    for direction in (1, -1):
        last = seed
        run = seed + direction
        while 0 <= run < edges.size:
            early, later = (last, run) if direction > 0 else (run, last)
            cut, skip = _seam(ticks[edges[early] : ends[early]], ticks[edges[later] : ends[later]])
            if skip >= 0:
                best[edges[run] : ends[run]] = True
                best[ends[early] - cut : edges[later] + skip] = False
                last = run
            run += direction
    return best


def _seam(early: Whole, later: Whole) -> tuple[int, int]:
    """How many frames to leave out at the end of one run and the beginning of the next so that the clock goes on.

    Wild frames, or some that stand in the log twice. The second is -1 where nothing helps.
    """
    seams = [(0, -1)]
    for cut in range(min(_WILD, early.size)):
        after = (later - early[-1 - cut]) % TURN
        goes_on = (after > 0) & (after <= _LEAP)
        if goes_on.any():
            seams.append((cut, int(np.argmax(goes_on))))
    return min(seams[1:], key=sum, default=seams[0])
