"""How a channel agrees with what another part of the log says of the same motion: correlation, and the factor between.

Both sides are noisy. The slope of a channel over a noisy reference is too small, and the inverse of the reverse slope
is too large where the channel is noisy: the factor lies between the two (Frisch 1934; Fuller 1987, sec. 1.1). How far
each is known is told by leaving one window out at a time (jackknife; Efron 1982).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.conditioning.filters import within
from swashplate.flights.conditioning.resample import common, unbroken
from swashplate.flights.flight import Flight

Reference = Callable[[Array], Array]
"""What the other side of the log says about the three axes at the times of a uniform grid, shape (n, 3)."""

BANDS = (((0.2, 3.0), 5.0), ((0.1, 0.8), 10.0))
"""Bands [Hz] with windows [s]: above drift, below rotor shake and what a delay of 50 ms turns round; and a slow one."""
_FASTEST = 50.0  # Hz: over ten times the highest corner; what is sampled faster is averaged down to it first
SHORTEST = 60  # samples
_FEWEST = 3  # windows in which an axis must move
_QUIET = 0.15  # of its usual motion: a window in which an axis moves less is not judged
_MAX_GAP = 0.25  # s
_SLIGHT = 0.03  # a factor this near to 1 is nothing: filters and mountings make that
_ERRORS = 4.0  # standard errors beyond which a factor is none of chance: real logs reach 3.6
_CONTRADICTED = 2.0  # standard errors in another band: what is not the same there is a filter, no scale


@dataclass(frozen=True)
class Agreement:
    """Of a channel with an axis, over the windows in which the axis moves.

    Attributes:
        correlation: median over the windows.
        low, high: bounds of the factor's size: slopes of either side over the other.
        error_low, error_high: relative standard errors of the two.
    """

    correlation: float
    low: float
    high: float
    error_low: float
    error_high: float

    @property
    def ratio(self) -> float:
        """The factor, signed: between the bounds."""
        return float(np.copysign(np.sqrt(self.low * self.high), self.correlation))

    @property
    def sigma(self) -> float:
        """Standard error of the factor: of what scatters and of what noise leaves open."""
        scatter = max(self.error_low, self.error_high)
        return float(abs(self.ratio) * np.hypot(scatter, 0.5 * np.log(self.high / self.low)))

    @property
    def scaled(self) -> bool:
        """Whether the factor's size is none of 1, beyond chance and noise on either side."""
        above = np.log(self.low) - np.log(1.0 + _SLIGHT)
        below = -np.log(self.high) - np.log(1.0 + _SLIGHT)
        return bool(above > _ERRORS * self.error_low or below > _ERRORS * self.error_high)

    def excludes(self, ratio: float) -> bool:
        """Whether a factor of this size lies outside the bounds."""
        low = np.log(self.low) - _CONTRADICTED * self.error_low
        high = np.log(self.high) + _CONTRADICTED * self.error_high
        slight = np.log(1.0 + _SLIGHT)
        return not low - slight <= np.log(abs(ratio)) <= high + slight


def series(flight: Flight, name: str) -> tuple[Array, Array]:
    """Finite samples of a channel: stamps and values."""
    time, values = flight.time(name), flight.values(name)
    good = np.isfinite(values) & np.isfinite(time)
    return time[good], values[good]


def thinned(time: Array, table: Array) -> tuple[Array, Array]:
    """Means over blocks of samples, so that a fast recording comes down to between 50 and 100 Hz; shapes (n,), (n, m).

    A block that spans a gap is left out. A slower recording is returned as it is.
    """
    step = float(np.median(np.diff(time))) if time.size > 1 else np.inf
    k = int(min(1.0 / (step * _FASTEST), time.size + 1)) if step > 0.0 else 1
    if k < 2 or time.size < k:
        return time, table
    blocks = time.size // k
    stamps = time[: blocks * k].reshape(blocks, k)
    steady = stamps[:, -1] - stamps[:, 0] < 2.0 * k * step
    means = table[: blocks * k].reshape(blocks, k, *table.shape[1:]).mean(axis=1)
    return stamps.mean(axis=1)[steady], means[steady]


def pieces(flight: Flight, names: Sequence[str], time: Array, reference: Reference) -> Iterator[tuple[float, Array]]:
    """Rate [Hz] and columns (channels, then three axes) of each piece without a gap on either clock, on one grid."""
    table = np.stack([flight.values(name) for name in names], axis=-1)
    stamps = flight.time(names[0])
    good = np.isfinite(table).all(axis=1) & np.isfinite(stamps)
    stamps, table = thinned(stamps[good], table[good])
    if stamps.size < SHORTEST or time.size < SHORTEST:
        return
    native = 1.0 / float(np.median(np.diff(stamps)))
    rate = min(native, 1.0 / float(np.median(np.diff(time))), _FASTEST)
    width = round(native / rate)
    if width > 1:  # vibration must not fold into the band
        from scipy.ndimage import uniform_filter1d  # a quarter of a second that most logs need not wait

        table = uniform_filter1d(table, width, axis=0)
    rows = np.ascontiguousarray(table.T)  # once, for all pieces
    gap = max(_MAX_GAP, 2.5 / rate)
    for start, stop in common(unbroken(time, max_gap=gap), unbroken(stamps, max_gap=gap)):
        grid = start + np.arange(int((stop - start) * rate)) / rate
        if grid.size >= SHORTEST:
            columns = [np.interp(grid, stamps, values) for values in rows]
            yield rate, np.column_stack([*columns, reference(grid)])


def agreements(
    parts: Sequence[tuple[float, Array]],
    there: Sequence[int],
    axes: tuple[int, ...],
    *,
    band: tuple[float, float],
    window: float,
) -> dict[int, dict[int, Agreement]]:
    """By channel and axis: how they agree in a band [Hz], over windows of that length [s].

    Args:
        parts: as `pieces` gives them.
        there: the channels' own axes, in the order of their columns.
    """
    products = [
        centred.T @ centred
        for rate, columns in parts
        if band[1] <= 0.4 * rate and columns.shape[0] >= max(SHORTEST, window * rate)
        for centred in _windows(columns, rate, band, int(window * rate))
    ]
    found_pairs: dict[int, dict[int, Agreement]] = {}
    if not products:
        return found_pairs
    every, k = np.array(products), len(there)
    power = np.diagonal(every, axis1=1, axis2=2)
    for row, i in enumerate(there):
        for j in axes:
            axis, channel = power[:, k + j], power[:, row]
            moves = (axis > _QUIET**2 * np.median(axis)) & (channel > 0.0) & (axis > 0.0)
            if moves.sum() >= _FEWEST and (pair := _agreement(channel[moves], axis[moves], every[moves, row, k + j])):
                found_pairs.setdefault(i, {})[j] = pair
    return found_pairs


def _windows(columns: Array, rate: float, band: tuple[float, float], n: int) -> Iterator[Array]:
    smooth = within(columns - columns.mean(axis=0), rate=rate, band=band)
    for part in smooth[: smooth.shape[0] // n * n].reshape(-1, n, smooth.shape[1]):
        yield part - part.mean(axis=0)


def _agreement(channel: Array, axis: Array, cross: Array) -> Agreement | None:
    """Of the powers of both sides and their product by window, shape (n,) each; None where they share nothing."""
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = float(np.median(cross / np.sqrt(channel * axis)))
    sums = np.array([channel.sum(), axis.sum(), abs(cross.sum())])
    without = np.abs(sums - np.stack([channel, axis, np.sign(cross.sum()) * cross], axis=1))
    least = np.sqrt(np.finfo(np.float64).tiny)
    if not (np.isfinite(correlation) and (sums > least).all() and (without > least).all()):
        return None
    low, high = np.log(sums[2] / sums[1]), np.log(sums[0] / sums[2])
    errors = [
        np.sqrt((channel.size - 1) * np.var(np.log(without[:, above] / without[:, below])))
        for above, below in ((2, 1), (0, 2))
    ]
    return Agreement(correlation, float(np.exp(low)), float(np.exp(high)), *map(float, errors))
