"""Which parts of a log can tell of a rate loop: flown, unbroken, in one mode, and without a sweep in them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.sweeps import unbroken_in_mode

Interval = tuple[float, float]


@dataclass(frozen=True)
class LoopAxis:
    """One rate loop: its name, the channels of target, motion, command, and of the angle that is asked for."""

    name: str
    target: str
    motion: str
    command: str
    reference: str


AXES = (
    LoopAxis("roll", "p_demand", "p", "mixer_roll", "phi_demand"),
    LoopAxis("pitch", "q_demand", "q", "mixer_pitch", "theta_demand"),
    LoopAxis("yaw", "r_demand", "r", "mixer_yaw", ""),
)


@dataclass(frozen=True)
class Stretch:
    """Signals at equal steps: start [s], rate [Hz], and values of shape (n, signals)."""

    start: float
    rate: float
    values: Array

    @property
    def time(self) -> Array:
        return self.start + np.arange(len(self.values)) / self.rate


def armed(flight: Flight) -> list[Interval]:
    """From and to [s] with the motors armed; the whole log where it does not say."""
    changes = [event for event in flight.provenance.events if event.kind in ("armed", "disarmed")]
    if not changes:
        return [(flight.start, flight.stop)]
    begin = flight.start if changes[0].kind == "disarmed" else None
    intervals: list[Interval] = []
    for event in changes:
        if event.kind == "armed" and begin is None:
            begin = event.time
        elif event.kind == "disarmed" and begin is not None:
            intervals.append((begin, event.time))
            begin = None
    return [*intervals, (begin, flight.stop)] if begin is not None else intervals


def without(intervals: Iterable[Interval], others: Iterable[Interval]) -> list[Interval]:
    """The intervals without what they share with others."""
    left = list(intervals)
    for a, b in others:
        left = [
            piece
            for start, stop in left
            for piece in ((start, min(stop, a)), (max(start, b), stop))
            if piece[1] > piece[0]
        ]
    return left


def common(one: Iterable[Interval], other: Iterable[Interval]) -> list[Interval]:
    """What two rows of intervals share."""
    others = list(other)
    shared = [(max(a, c), min(b, d)) for a, b in one for c, d in others]
    return [(start, stop) for start, stop in shared if stop > start]


def pieces(
    flight: Flight, names: Iterable[str], *, swept: Iterable[Interval], fastest: float, shortest: float
) -> list[Stretch]:
    """The signals side by side at equal steps, in every stretch that can be used.

    Args:
        names: channels; the first one's stamps decide where the log is broken and how fast it is.
        swept: from and to of sweeps [s]: what is added there is no target.
        fastest: rate [Hz] above which samples are averaged; all signals alike.
        shortest: a stretch that is no longer is left out [s].
    """
    channels = list(names)
    stamps = flight.time(channels[0])
    intervals = []
    stretches = without(common(unbroken_in_mode(flight, stamps), armed(flight)), swept)
    for start, stop in stretches:
        inside = (stamps >= start) & (stamps <= stop)
        if stop - start <= shortest or inside.sum() < 2:
            continue
        native = 1.0 / float(np.median(np.diff(stamps[inside])))
        rate = min(native, fastest)
        grid = start + np.arange(int((stop - start) * rate)) / rate
        columns = [_on(grid, flight.time(name), flight.values(name), rate) for name in channels]
        intervals.append(Stretch(start, rate, np.stack(columns, axis=-1)))
    return intervals


def _on(grid: Array, time: Array, values: Array, rate: float) -> Array:
    """A signal at the times of a grid, averaged over the steps of a slower one."""
    good = np.isfinite(values)
    time, values = time[good], values[good]
    if time.size < 2:
        return np.zeros(grid.size)
    width = round(1.0 / (rate * float(np.median(np.diff(time)))))
    if width > 1:
        values = np.convolve(values, np.full(width, 1.0 / width), mode="same")
    return np.asarray(np.interp(grid, time, values))
