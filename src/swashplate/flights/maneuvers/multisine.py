"""Multisines for several axes at once: harmonics that no other axis has, and phases that keep the peak low.

Harmonics of one record dealt out in turn leave the axes uncorrelated over the whole record (Morelli 2003). The phases
start from Schroeder's (1970) and are optimised for the lowest peak by norms of rising order (Guillaume, Schoukens,
Pintelon and Kollar 1991), which needs no more than a few hundred Fourier transforms.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array

# Half the norms' orders, and the steps of each one's search: few, so that rounding does not grow into another signal on
# another machine (by 2e-8 of the peak at most; 40 steps and order 32 gave 8e-3 and peaks no lower).
_ORDERS = (2, 8, 16)
_STEPS = 12
_WORK = 400_000  # samples transformed in each order's search: long records get fewer steps, down to
_FEWEST = 3
_BLOCK = 64  # harmonics summed at once


def dealt(low: float, high: float, duration: float, *, axes: int) -> list[NDArray[np.int64]]:
    """Numbers of the record's harmonics in a band [Hz], dealt out to the axes in turn."""
    numbers = np.arange(max(1, int(np.ceil(low * duration - 1e-9))), int(high * duration + 1e-9) + 1)
    return [numbers[i::axes] for i in range(axes)]


def wave(harmonics: NDArray[np.int64], time: Array, *, duration: float) -> Array:
    """The multisine of these harmonics at times [s], largest value one, zero (and a whole period) at its ends."""
    phases, peak = _optimised(tuple(harmonics.tolist()))
    return _sum(harmonics, np.asarray(phases), np.asarray(time, dtype=np.float64) / duration) / peak


def relative_peak_factor(signal: Array) -> float:
    """Peak to peak over 2 sqrt 2 times the root mean square: one for a sine (Morelli 2003, eq. 5)."""
    spread = float(np.std(signal))
    return float(np.ptp(signal)) / (2.0 * np.sqrt(2.0) * spread) if spread > 0.0 else float("inf")


def least_peak(numbers: tuple[int, ...], amplitudes: tuple[float, ...]) -> tuple[tuple[float, ...], float]:
    """Phases of least peak of lines with amplitudes of their own, begun at zero, and that peak."""
    return _optimised(numbers, amplitudes)


def _sum(harmonics: NDArray[np.int64], phases: Array, turns: Array, amplitudes: Array | None = None) -> Array:
    """Sum of cosines at times counted in records; whole records are taken off first, which keeps the angles exact."""
    part = np.mod(turns, 1.0)
    total = np.zeros(part.shape)
    for i in range(0, harmonics.size, _BLOCK):
        block = harmonics[i : i + _BLOCK]
        waves = np.cos(2.0 * np.pi * np.multiply.outer(part, block) + phases[i : i + _BLOCK])
        total += (waves if amplitudes is None else waves * amplitudes[i : i + _BLOCK]).sum(axis=-1)
    return total


@lru_cache(maxsize=64)
def _optimised(
    numbers: tuple[int, ...], amplitudes: tuple[float, ...] | None = None
) -> tuple[tuple[float, ...], float]:
    """Phases of least peak, turned so that the signal begins at zero, and that peak."""
    from scipy.optimize import minimize

    harmonics = np.asarray(numbers, dtype=np.int64)
    size = int(2 ** np.ceil(np.log2(8 * harmonics[-1])))
    number = np.arange(1.0, harmonics.size + 1.0)
    weights = None if amplitudes is None else np.asarray(amplitudes)
    phases = -np.pi * number * (number - 1.0) / harmonics.size

    def signal(angles: Array, n: int = size) -> Array:
        spectrum = np.zeros(n // 2 + 1, dtype=np.complex128)
        spectrum[harmonics] = 0.5 * n * np.exp(1j * angles) * (1.0 if weights is None else weights)
        return np.asarray(np.fft.irfft(spectrum, n))

    def norm(angles: Array, order: int) -> tuple[float, Array]:
        """Logarithm of the norm of order 2 * `order`, and its slope in each phase."""
        x = signal(angles)
        top = float(np.max(np.abs(x)))
        part = x / top
        raised = part.copy()
        for _ in range(order.bit_length() - 1):  # to the power 2 order - 1, by squaring: order is a power of two
            raised = raised * raised * part
        total = float(np.sum(raised * part))
        moments = np.fft.rfft(raised)[harmonics]
        slope = np.imag(moments * np.exp(-1j * angles)) / (top * total) * (1.0 if weights is None else weights)
        return np.log(top) + np.log(total / size) / (2 * order), slope

    best = phases
    steps = min(_STEPS, max(_FEWEST, _WORK // size))
    for order in _ORDERS:
        optimum = minimize(norm, best, args=(order,), jac=True, method="CG", options={"maxiter": steps})
        if np.max(np.abs(signal(optimum.x))) < np.max(np.abs(signal(best))):
            best = np.asarray(optimum.x, dtype=np.float64)
    return _from_zero(harmonics, best, signal(best, 8 * size), weights)


def _from_zero(
    harmonics: NDArray[np.int64], phases: Array, x: Array, amplitudes: Array | None
) -> tuple[tuple[float, ...], float]:
    """The same signal begun at its gentlest upward passage through zero."""
    from scipy.optimize import brentq

    up = np.flatnonzero((x <= 0.0) & (np.roll(x, -1) > 0.0))
    first = int(up[np.argmin(np.roll(x, -1)[up] - x[up])])

    def value(turn: float) -> float:
        return float(_sum(harmonics, phases, np.asarray([turn]), amplitudes)[0])

    ends = first / x.size, (first + 1) / x.size
    # Few lines may touch zero at a sample, where rounding gives the sign.
    at = (
        brentq(value, *ends, xtol=1e-14)
        if value(ends[0]) <= 0.0 < value(ends[1])
        else min(ends, key=lambda t: abs(value(t)))
    )
    turned = np.mod(phases + 2.0 * np.pi * harmonics * at, 2.0 * np.pi)
    return tuple(turned.tolist()), float(np.max(np.abs(x)))
