"""Spectral densities averaged over windows that overlap by half (Welch 1967, IEEE Trans. Audio 15, 70-73)."""

from __future__ import annotations

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.flights.conditioning.filters import detrended


def cross_density(
    first: Array, second: Array, *, rate: float, window: int, line: bool = False
) -> tuple[Array, Complex]:
    """Frequencies [Hz] and one-sided cross spectral densities, conjugate of the first times the second, per Hz.

    Args:
        first, second: two channels (n,), perhaps the same.
        rate: sample rate [Hz]. window: samples of each window (Hann's), at most n.
        line: take each window's straight line away; otherwise its mean.
    """
    hann = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(window) / window)
    step = window - window // 2

    def spectra(values: Array) -> Complex:
        parts = np.lib.stride_tricks.sliding_window_view(values, window)[::step].T
        level = detrended(parts) if line else parts - parts.mean(axis=0)
        return np.asarray(np.fft.rfft(level * hann[:, None], axis=0), dtype=np.complex128)

    one = spectra(first)
    density = (np.conj(one) * (one if second is first else spectra(second))).mean(axis=1)
    density *= 2.0 / (rate * float(hann @ hann))
    density[0] *= 0.5
    if window % 2 == 0:
        density[-1] *= 0.5
    return np.arange(window // 2 + 1) * rate / window, density


def power_density(values: Array, *, rate: float, window: int, line: bool = False) -> tuple[Array, Array]:
    """Frequencies [Hz] and one-sided power spectral density; arguments as of `cross_density`."""
    frequency, cross = cross_density(values, values, rate=rate, window=window, line=line)
    return frequency, cross.real
