"""Butterworth and Savitzky-Golay filters as SciPy's, without loading `scipy.signal`, which takes a quarter of a second.

A first answer in seconds has no time for the statistics that come with that package. The filters are the same, and
their numbers to rounding (the tests compare them).
"""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg.blas import dtbsv

from swashplate.arrays import Array, Complex

_REAL = 1e-10
"""Imaginary part below which a pole is real."""


def butterworth(order: int, cutoff: float | tuple[float, float], *, rate: float) -> Array:
    """Second-order sections (n, 6) of a digital Butterworth low-pass, or band-pass where two corners are given [Hz].

    By the bilinear transform of the prewarped prototype (Oppenheim and Schafer 2010, sec. 7.2); each section has the
    gain one where the whole has.
    """
    warped = 4.0 * np.tan(np.pi * np.atleast_1d(np.asarray(cutoff, dtype=np.float64)) / rate)
    prototype = -np.exp(0.5j * np.pi * np.arange(-order + 1, order, 2) / order)
    if warped.size == 1:
        poles, numerator, centre = warped[0] * prototype, (1.0, 2.0, 1.0), 0.0
    else:
        half, middle = 0.5 * (warped[1] - warped[0]) * prototype, warped[0] * warped[1]
        apart = np.sqrt(half**2 - middle + 0j)
        poles, numerator, centre = np.concatenate([half + apart, half - apart]), (1.0, 0.0, -1.0), np.sqrt(middle)
    sections = []
    at_one = (4.0 + 1j * centre) / (4.0 - 1j * centre)
    for a in _pairs((4.0 + poles) / (4.0 - poles)):
        b = np.array(numerator if a[2] else (1.0, 1.0, 0.0))
        sections.append([*(b * np.abs(np.polyval(a, at_one) / np.polyval(b, at_one))), *a])
    return np.array(sections)


def _pairs(poles: Complex) -> list[Array]:
    """Denominators: of conjugate poles, of pairs of real ones, of the one left over; the least damped last."""
    above = poles[poles.imag > _REAL]
    real = np.sort(poles[np.abs(poles.imag) <= _REAL].real)
    made = [np.array([1.0, -2.0 * p.real, abs(p) ** 2]) for p in above[np.argsort(np.abs(above))]]
    two = [np.array([1.0, -(p + q), p * q]) for p, q in zip(real[0::2], real[1::2], strict=False)]
    return [*([np.array([1.0, -real[-1], 0.0])] if real.size % 2 else []), *two, *made]


def forwards(sections: Array, values: Array) -> Array:
    """A record (n,) or (n, m) through the sections, from rest at its first value."""
    columns = values.reshape(len(values), -1).T.astype(np.float64)
    return np.stack([_run(sections, column) for column in columns], axis=1).reshape(values.shape)


def both_ways(sections: Array, values: Array) -> Array:
    """The same forwards and backwards, the ends mirrored through their points, as `scipy.signal.sosfiltfilt`."""
    at_origin = min(int(np.sum(sections[:, 2] == 0.0)), int(np.sum(sections[:, 5] == 0.0)))
    pad = 3 * (2 * len(sections) + 1 - at_origin)
    long = np.concatenate([2.0 * values[:1] - values[pad:0:-1], values, 2.0 * values[-1:] - values[-2 : -2 - pad : -1]])
    return forwards(sections, forwards(sections, long)[::-1])[::-1][pad : pad + len(values)]


def _run(sections: Array, signal: Array) -> Array:
    """Each section's recursion is a lower triangular band that is solved, its past held at the first value."""
    level = signal[0]
    for b0, b1, b2, _, a1, a2 in sections:
        before, after = level, level * (b0 + b1 + b2) / (1.0 + a1 + a2)
        past = np.concatenate([[before, before], signal])
        driven = b0 * past[2:] + b1 * past[1:-1] + b2 * past[:-2]
        driven[0] -= (a1 + a2) * after
        driven[1:2] -= a2 * after
        band = np.empty((3, signal.size), order="F")
        band[0], band[1], band[2] = 1.0, a1, a2
        signal, level = dtbsv(2, band, driven, lower=1, diag=1, overwrite_x=1), after
    return signal


def savitzky_golay(values: Array, length: int, order: int, *, derivative: int = 0, step: float = 1.0) -> Array:
    """Values or derivatives of polynomials fitted to `length` samples about each, as `scipy.signal.savgol_filter`.

    Args:
        values: shape (n,) or (n, m), along the first axis, at least `length` of them.
        length: an odd number of samples.
        order: of the polynomials.
        derivative: 0 for the values themselves.
        step: between samples, for derivatives.
    """
    half, last = length // 2, len(values) - length + 1
    table = np.vander(np.arange(-half, half + 1.0), order + 1, increasing=True)
    derived = np.zeros_like(table)
    factor = np.array([math.perm(k, derivative) for k in range(derivative, order + 1)], dtype=np.float64)
    derived[:, derivative:] = factor * table[:, : order + 1 - derivative]
    weights = derived @ np.linalg.pinv(table) / step**derivative  # at each place of a window, from the values there
    inner = sum(weight * values[k : k + last] for k, weight in enumerate(weights[half]))
    ends = weights[:half] @ values[:length], weights[half + 1 :] @ values[-length:]
    return np.concatenate([ends[0], inner, ends[1]])
