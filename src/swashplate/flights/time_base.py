"""When a stream's samples come: rate, jitter, gaps, and the pauses of a message that some modes alone write."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swashplate.arrays import Array

_GAP = 3.0  # usual steps; a step longer than this has lost at least two samples
_TURN = 31  # steps whose median is the usual one there: half as many slow ones in a row are another rate, no gaps
_JITTER = 0.05  # of the median step; beyond it, equal steps cannot be assumed
_ALIKE, _SEVERAL = 0.2, 4  # long steps in a row that differ by less of themselves: another rate, and no gaps
_FEW = 2  # so many of them do where the log begins shortly before a change of mode, with which rates change
_SWITCHING = 0.5  # s between a change of mode and the message that this mode alone writes
_MAD_TO_SIGMA = 1.4826  # of a normal distribution: 1 / Phi^-1(3/4)


@dataclass(frozen=True)
class StreamSummary:
    """Time base of a stream.

    Attributes:
        rate: sample rate [Hz] from the median step; NaN for a single sample.
        jitter: scatter of the steps that are no gaps: 1.4826 times the median absolute deviation [s].
        gaps: steps longer than three usual ones there; longest_gap: the longest of them [s] (0 where there is none).
        rates: the slowest and the fastest usual rate [Hz]: autopilots log some messages slowly outside tests. Both are
            `rate` where no step is three times another one.
        pause: the longest step from one change of mode to another [s], 0 for none: some modes alone write the stream.
    """

    name: str
    n: int
    start: float
    stop: float
    rate: float
    jitter: float
    gaps: int
    longest_gap: float
    rates: tuple[float, float]
    pause: float = 0.0

    @property
    def problems(self) -> list[str]:
        """What is wrong with it alone, in words: its gaps (`jittering` tells the rest of all streams together)."""
        if not self.gaps:
            return []
        return [
            f"{self.name}: {self.gaps} gap{'s' * (self.gaps != 1)} in the time stamps, the longest "
            f"{1e3 * self.longest_gap:.0f} ms (usual step {1e3 / self.rate:.1f} ms)"
        ]

    @property
    def notes(self) -> list[str]:
        """What a user must know of it, in words."""
        slow, fast = self.rates
        notes = []
        if fast > _GAP * slow:
            rates = f"recorded at {slow:.3g} Hz and at {fast:.3g} Hz by turns"
            notes.append(f"{self.name}: {rates}; take a piece of one rate for a fit")
        if self.pause:
            notes.append(f"{self.name}: written in some modes only; it pauses for up to {self.pause:.3g} s in others")
        return notes


def jittering(streams: Iterable[StreamSummary]) -> list[str]:
    """What to say of streams whose stamps jitter, in one sentence; nothing where none does."""
    uneven = [stream for stream in streams if stream.jitter * stream.rate > _JITTER]
    if not uneven:
        return []
    least, most = (f"{1e3 * chosen(stream.jitter for stream in uneven):.2f}" for chosen in (min, max))
    by = most if least == most else f"{least} to {most}"
    names = ", ".join(stream.name for stream in uneven)
    return [f"{names}: time stamps jitter by {by} ms; bring them to one rate before a fit"]


def time_base(name: str, data: xr.Dataset, switched: Array) -> StreamSummary:
    """A stream's time base; `switched`: when the mode changed [s]."""
    time = np.asarray(data["time"].values, dtype=np.float64)
    if time.size < 2:
        edge = float(time[0]) if time.size else float("nan")
        nothing = float("nan")
        return StreamSummary(name, time.size, edge, edge, nothing, nothing, 0, 0.0, (nothing, nothing))
    steps = np.diff(time)
    median = float(np.median(steps))
    rates, usual = (1.0 / median, 1.0 / median), np.full(steps.shape, median)
    if float(steps.max()) > _GAP * float(steps.min()):
        from scipy.ndimage import median_filter  # a quarter of a second that an even log need not wait

        by_turns = median_filter(steps, size=_TURN, mode="mirror")
        rates = (1.0 / float(by_turns.max()), 1.0 / float(by_turns.min()))
        if rates[1] > _GAP * rates[0]:
            usual = by_turns
    long = steps > _GAP * usual
    beside = _beside(time[:-1], switched) & _beside(time[1:], switched)
    long[long] = ~_steady(np.flatnonzero(long), steps[long], first=_FEW if long[0] and beside[0] else _SEVERAL)
    inside = np.searchsorted(switched, time + _SWITCHING)[1:] - np.searchsorted(switched, time - _SWITCHING)[:-1]
    pauses = long & (inside > 1) & beside
    long &= ~pauses
    return StreamSummary(
        name,
        time.size,
        float(time[0]),
        float(time[-1]),
        rate=1.0 / median,
        jitter=_MAD_TO_SIGMA * float(np.median(np.abs(steps - usual)[~long])),
        gaps=int(long.sum()),
        longest_gap=float(steps[long].max()) if long.any() else 0.0,
        rates=rates,
        pause=float(steps[pauses].max()) if pauses.any() else 0.0,
    )


def _steady(place: NDArray[np.intp], steps: Array, *, first: int) -> NDArray[np.bool_]:
    """Which of the long steps are even, one behind the other: a stretch at a slower rate, in which nothing is lost.

    A stretch has at least `_SEVERAL` of them; the first one `first`, for the log's beginning may cut it.

    The step that leads into such a stretch or out of it belongs to it, where it is no longer than its own.
    """
    follows = np.diff(place, prepend=-2) == 1
    starts = np.flatnonzero(~follows | (np.abs(np.diff(steps, prepend=0.0)) > _ALIKE * steps))
    lengths = np.diff(starts, append=place.size)
    least = np.where(starts == 0, first, _SEVERAL)
    even = np.repeat(lengths >= least, lengths)
    seam = follows[1:] & (steps[1:] < (1.0 + _ALIKE) * steps[:-1]) & even[:-1]
    lead = follows[1:] & (steps[:-1] < (1.0 + _ALIKE) * steps[1:]) & even[1:]
    even[1:] |= seam
    even[:-1] |= lead
    return even


def _beside(time: Array, switched: Array) -> NDArray[np.bool_]:
    """Which stamps lie beside a change of mode."""
    if not switched.size:
        return np.zeros(time.shape, dtype=np.bool_)
    near = np.searchsorted(switched, time)
    return (
        np.minimum(
            np.abs(time - switched[np.minimum(near, switched.size - 1)]),
            np.abs(time - switched[np.maximum(near - 1, 0)]),
        )
        <= _SWITCHING
    )
