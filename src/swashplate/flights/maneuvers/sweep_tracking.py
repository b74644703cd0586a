"""A sweep taken out of a recorded signal: narrow-band, along its own instantaneous frequency.

What a loop makes of gusts is spread over all frequencies and over the whole flight; a sweep is at one frequency at a
time. The signal is turned back by the sweep's phase, smoothed over a few cycles, and turned forward again: a complex
demodulation (Bloomfield 2000, ch. 7), counted in cycles instead of seconds, so that its bandwidth is a share of the
frequency. The phase is at first that of the ridge of the signal's scalogram, then the signal's own, smoothed.

Programs sweep by a law. All usual ones (linear, exponential, Tischler's) have a frequency a + b exp(c t); where it
holds, the phase is the law's, the window is long, and the sweep is followed beyond the ridge's ends. Hands keep no law.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, Complex

_BINS = 16
"""Places per cycle at which the turned-back signal is averaged."""
_FINDING, _BY_HAND, _BY_LAW = 1.0, 0.6, 4.0
"""Standard deviations of the window [cycles]: while a phase is found, and of what a hand and a program flew."""
_SMOOTH = 4.0
"""Standard deviation [points] over which a ridge's steps of an eighth of an octave are rounded off."""
_STEADY = 0.8
"""Share of a sweep's power that must be left in the long window for its law to hold."""
_CLEAR, _OTHER_TIMES, _LEVEL = 2.5, (-0.4, -0.2, 0.2, 0.4), 1.5
"""Power of a sweep over that of the same course at other times (shares of the record), both smoothed over cycles, from
which on it counts: two fifths may be what the loop makes of gusts."""
_FADED = 0.25
"""Of a lawful sweep's median amplitude: there it ends."""


@dataclass(frozen=True)
class Ridge:
    """The course of a sweep's frequency in a signal.

    Attributes:
        time: of its points [s], rising, shape (n,).
        frequency: there [Hz], shape (n,). amplitude: there, shape (n,).
        share: of the power around it that it holds, on average.
    """

    time: Array
    frequency: Array
    amplitude: Array
    share: float

    @property
    def start(self) -> float:
        return float(self.time[0])

    @property
    def stop(self) -> float:
        return float(self.time[-1])


@dataclass(frozen=True)
class Course:
    """The phase of a sweep over the samples that it lies in.

    Attributes:
        inside: those samples of the record, shape (n,).
        phase: there [rad], rising, shape (number inside,).
        lawful: whether a program's law gives it.
    """

    inside: NDArray[np.bool_]
    phase: Array
    lawful: bool

    def in_signal(self, values: Array) -> Array:
        """The part of a signal that follows the sweep, zero before and after it, shape (n,).

        It is zero too where what follows the same course at other times is nearly as strong: that is no sweep's.
        """
        cycles = _BY_LAW if self.lawful else _BY_HAND
        envelope = _envelope(values[self.inside], self.phase, cycles)
        others = [np.roll(values, round(share * values.size))[self.inside] for share in _OTHER_TIMES]
        levels = [_level(_envelope(other, self.phase, cycles), self.phase) for other in others]
        clear = _level(envelope, self.phase) >= _CLEAR * np.median(levels, axis=0)
        part = np.zeros(values.shape)
        part[self.inside] = np.where(clear, 2.0 * np.real(envelope * np.exp(1j * self.phase)), 0.0)
        return part


def course_of(time: Array, values: Array, ridge: Ridge) -> Course:
    """The course of a sweep from its ridge and the signal that shows it.

    Args:
        time: uniform stamps [s], shape (n,). values: the signal without its mean, shape (n,).
        ridge: of the sweep in this signal.
    """
    from scipy.ndimage import gaussian_filter1d  # slow to import, and looking for sweeps needs none of it

    inside = (time >= ridge.start) & (time <= ridge.stop)
    at, signal = time[inside], values[inside]
    octaves = gaussian_filter1d(np.log2(ridge.frequency), _SMOOTH, mode="nearest")
    frequency = 2.0 ** np.interp(at, ridge.time, octaves)
    phase = 2.0 * np.pi * np.cumsum(frequency) * float(time[1] - time[0])
    for _ in range(2):
        turned = phase + np.unwrap(np.angle(_envelope(signal, phase, _FINDING)))
        phase = np.maximum.accumulate(turned)  # a phase never turns back
    return _by_law(time, values, at, phase) or Course(inside, phase, lawful=False)


def _by_law(time: Array, values: Array, at: Array, phase: Array) -> Course | None:
    """The course that a program's law gives; None where the sweep does not keep to one."""
    size = np.abs(_envelope(np.interp(at, time, values), phase, _FINDING))
    middle = float(at[0])
    span = float(at[-1] - middle)

    def basis(stamps: Array, c: float) -> Array:
        x = (stamps - middle) / span
        grown = np.expm1(c * x) / c if abs(c) > 1e-6 else x
        return np.stack([np.ones_like(x), x, (grown - x) / max(abs(c), 0.1)], axis=1)

    def fitted(c: float) -> tuple[float, Array]:
        columns = basis(at, c) * size[:, None]
        coefficients = np.linalg.lstsq(columns, phase * size, rcond=None)[0]
        return float(np.sum((columns @ coefficients - phase * size) ** 2)), np.asarray(coefficients, dtype=np.float64)

    grid = np.linspace(-2.0, 10.0, 49)
    best = int(np.argmin([fitted(float(c))[0] for c in grid]))
    low, high = float(grid[max(best - 1, 0)]), float(grid[min(best + 1, grid.size - 1)])
    for _ in range(25):  # golden section
        one, other = high - 0.618 * (high - low), low + 0.618 * (high - low)
        low, high = (low, other) if fitted(one)[0] < fitted(other)[0] else (one, high)
    c = 0.5 * (low + high)
    coefficients = fitted(c)[1]
    law = basis(at, c) @ coefficients
    if np.any(np.diff(law) <= 0.0):
        return None
    signal = np.interp(at, time, values)
    kept = np.mean(np.abs(_envelope(signal, law, _BY_LAW)) ** 2)
    if kept < _STEADY * np.mean(np.abs(_envelope(signal, phase, _FINDING)) ** 2):
        return None
    turns = basis(time, c) @ coefficients
    step = np.diff(turns, prepend=2.0 * turns[0] - turns[1])
    rises = (step > 0.0) & (step < np.pi)  # a law carried far beyond its sweep rises beyond all that samples tell
    first, last = int(np.searchsorted(time, at[0])), int(np.searchsorted(time, at[-1]))
    begin = first - int(np.argmin(rises[first::-1])) + 1 if not rises[: first + 1].all() else 0
    end = last + int(np.argmin(rises[last:])) if not rises[last:].all() else time.size
    part = slice(begin, end)
    strength = np.abs(_envelope(values[part], turns[part], _FINDING))
    loud = strength > _FADED * float(np.median(strength[first - begin : last - begin]))
    begin, end = _run_around(loud, first - begin, last - begin) + np.array([begin, begin])
    inside = np.zeros(time.size, dtype=bool)
    inside[begin:end] = True
    return Course(inside, turns[begin:end], lawful=True)


def _level(envelope: Complex, phase: Array) -> Array:
    """Power of an envelope, smoothed over cycles."""
    return np.asarray(np.real(_envelope(np.abs(envelope) ** 2 * np.exp(1j * phase), phase, _LEVEL)))


def _run_around(loud: NDArray[np.bool_], first: int, last: int) -> NDArray[np.int64]:
    """First and behind-last place of what is loud without a break before `first` and behind `last`."""
    before, after = np.flatnonzero(~loud[:first]), np.flatnonzero(~loud[last:])
    return np.array([before[-1] + 1 if before.size else 0, last + (after[0] if after.size else loud.size - last)])


def _envelope(values: Array, phase: Array, cycles: float) -> Complex:
    """Half the complex amplitude of what follows a phase, smoothed over cycles, shape (n,)."""
    from scipy.ndimage import gaussian_filter1d

    turns = (phase - phase[0]) / (2.0 * np.pi)
    width = np.maximum(np.gradient(turns), 1e-9)
    # Averages over bins of the cycle count, by differences of a running sum: nothing folds, however slow the sweep.
    edges = np.concatenate([[0.0], np.cumsum(width)])
    sums = np.concatenate([[0.0], np.cumsum(values * np.exp(-1j * phase) * width)])
    count = int(edges[-1] * _BINS) + 1
    at = np.minimum(np.arange(count + 1) / _BINS, edges[-1])
    part = np.diff(np.interp(at, edges, sums.real) + 1j * np.interp(at, edges, sums.imag))
    real, imaginary, weight = (
        gaussian_filter1d(each, cycles * _BINS, mode="constant") for each in (part.real, part.imag, np.diff(at))
    )
    places, centres = (at[:-1] + at[1:]) / 2.0, (edges[:-1] + edges[1:]) / 2.0
    held = np.maximum(weight, 1e-12)
    envelope = np.interp(centres, places, real / held) + 1j * np.interp(centres, places, imaginary / held)
    return np.asarray(envelope, dtype=np.complex128)
