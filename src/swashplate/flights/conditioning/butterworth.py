"""Butterworth filters run forwards and backwards: what `scipy.signal` has, without the half second of loading it."""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dtbtrs

from swashplate.arrays import Array


def butterworth_sections(order: int, corners: Array, *, rate: float) -> Array:
    """Sections (n, 6) of a Butterworth filter by the bilinear transform: b0, b1, b2, a0 = 1, a1, a2.

    Oppenheim and Schafer 2010, sec. 7.2 and 7.3.

    Args:
        order: of the low-pass; a band-pass has twice as many poles.
        corners: [Hz], one of a low-pass or two of a band-pass, between zero and half the rate.
        rate: sample rate [Hz].
    """
    warped = np.tan(np.pi * corners / rate)
    poles = np.exp(1j * np.pi * (np.arange(order) * 2 + order + 1) / (2 * order))
    band = corners.size == 2
    middle = float(np.sqrt(warped.prod())) if band else 0.0
    if band:
        half = 0.5 * (warped[1] - warped[0]) * poles
        apart = np.sqrt(half**2 - middle**2)
        poles = np.concatenate([half + apart, half - apart])
    else:
        poles = poles * warped[0]
    poles = (1.0 + poles) / (1.0 - poles)
    real = np.sort(poles[np.abs(poles.imag) < 1e-12].real)
    ends = [(-2.0 * p.real, float(abs(p)) ** 2) for p in poles[poles.imag >= 1e-12]]
    ends += [(-(p + q), p * q) for p, q in real[: real.size // 2 * 2].reshape(-1, 2)]
    sections = [[1.0, 0.0, -1.0, 1.0, *end] if band else [1.0, 2.0, 1.0, 1.0, *end] for end in ends]
    sections += [[1.0, 1.0, 0.0, 1.0, -p, 0.0] for p in real[real.size // 2 * 2 :]]
    cascade = np.array(sections)
    here = (1.0 + 1j * middle) / (1.0 - 1j * middle)  # where the gain is one: a low-pass's is at rest
    powers = here ** -np.arange(3)
    cascade[:, :3] *= np.abs((cascade[:, 3:] @ powers) / (cascade[:, :3] @ powers))[:, None]
    return cascade


def both_ways(sections: Array, values: Array, *, padding: int) -> Array:
    """Values (n, ...) after the sections forwards and backwards, begun as if their first had always been.

    Args:
        sections: of `butterworth_sections`.
        padding: samples by which both ends go on, turned about the last one (Gustafsson 1996, IEEE Trans. Signal
            Processing 44, 988-992, on what ends do); fewer than n.
    """
    before, after = values[padding:0:-1], values[-2 : -padding - 2 : -1]
    long = np.concatenate([2.0 * values[:1] - before, values, 2.0 * values[-1:] - after])
    for _ in range(2):
        long = _forwards(sections, long)[::-1]
    return np.array(long[padding : padding + len(values)])


def _forwards(sections: Array, values: Array) -> Array:
    """Values after the sections; recursions are systems of equations with a band, solved from the first row on."""
    rest = float(np.prod(sections[:, :3].sum(axis=1) / sections[:, 3:].sum(axis=1)))
    driven = (values - values[:1]).reshape(len(values), -1)
    for b0, b1, b2, *poles in sections:
        reached = b0 * driven
        reached[1:] += b1 * driven[:-1]
        reached[2:] += b2 * driven[:-2]
        driven, _ = dtbtrs(np.repeat(np.array(poles)[:, None], len(values), axis=1), reached, uplo="L", diag="U")
    return np.asarray(driven.reshape(values.shape) + rest * values[:1], dtype=np.float64)
