"""Spectral matrices of records: overlapped Hann windows, evaluated at any frequencies.

The sums are those of the chirp-z transform (Rabiner, Schafer and Rader 1969): the frequency grid is free of the
window's length. On a logarithmic grid of some hundred lines one matrix product gives them exactly and faster than a
chirp-z transform of an equally fine linear grid (`scipy.signal.czt`, which the tests compare with).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, Complex
from swashplate.errors import FlightError
from swashplate.flights.conditioning.filters import detrended
from swashplate.flights.flight import Flight
from swashplate.identification.core.records import uniform_table


@dataclass(frozen=True)
class Signals:
    """One unbroken piece of a flight.

    Attributes:
        name: source and interval.
        dt: sample time [s].
        values: channels side by side, without their straight line, shape (n, n_channels).
        start: of the piece on its flight's clock [s].
    """

    name: str
    dt: float
    values: Array
    start: float = 0.0

    @property
    def duration(self) -> float:
        return self.dt * len(self.values)


def signals(flights: Sequence[Flight], names: Sequence[str]) -> list[Signals]:
    """The unbroken pieces of flights, each channel without its mean and straight line.

    Raises:
        FlightError: a channel that is missing or not finite, a grid that is not uniform, flights of different rates.
    """
    unbroken = []
    for flight in flights:
        for piece in flight.split():
            time, table = uniform_table(piece, names, who="the frequency response")
            dt = float((time[-1] - time[0]) / (time.size - 1))
            name = f"{piece.provenance.source or 'flight'} {time[0]:.2f}-{time[-1]:.2f} s"
            unbroken.append(Signals(name, dt, detrended(table), float(time[0])))
    if not unbroken:
        raise FlightError("there is no flight to work on.")
    rates = sorted({round(1.0 / piece.dt, 3) for piece in unbroken})
    if len(rates) > 1:
        raise FlightError(
            f"the flights have different rates ({', '.join(f'{rate:g}' for rate in rates)} Hz).",
            where=", ".join(piece.name for piece in unbroken),
            hint="Bring all of them to one rate (--rate).",
        )
    return unbroken


def runs(inside: NDArray[np.bool_]) -> list[slice]:
    """The unbroken stretches of samples that are inside, in order."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], inside.astype(int), [0]])))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


@dataclass(frozen=True)
class SpectralMatrix:
    """Averaged spectra of all channels from windows of one length.

    Attributes:
        window: its length [s].
        averages: number of independent windows, n_d (total length of the records over the window's).
        values: one-sided spectral densities [units^2/Hz], `values[f, i, j]` = average of conj(Z_i) Z_j; NaN at
            frequencies below `periods` per window. Shape (n_frequencies, n_channels, n_channels).
        used: names of the records that are long enough for this window.
    """

    window: float
    averages: float
    values: Complex
    used: tuple[str, ...]


def spectral_matrix(
    pieces: Sequence[Signals], omega: Array, *, window: float, overlap: float, periods: float = 1.0
) -> SpectralMatrix | None:
    """The spectral matrix from windows of one length, never across the join of two records.

    Args:
        pieces: records of one rate.
        omega: frequencies [rad/s].
        window: length [s].
        overlap: share of a window that the next one repeats, 0 to below 1.
        periods: of the lowest frequency that a window must hold.

    Returns:
        None where no record is as long as the window.
    """
    dt, channels = pieces[0].dt, pieces[0].values.shape[1]
    n = round(window / dt)
    long_enough = [piece for piece in pieces if len(piece.values) >= n]
    if not long_enough or n < 4:
        return None
    taper = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(n) / n)  # Hann's window, periodic
    resolved = omega * n * dt >= 2.0 * np.pi * periods * (1.0 - 1e-9)
    kernel = _kernel(omega[resolved], taper, dt)
    step = max(1, round((1.0 - overlap) * n))
    total = np.zeros((int(resolved.sum()), channels, channels), dtype=np.complex128)
    for piece in long_enough:
        # Half a window of nothing before and after: otherwise a taper would hide the ends, where sweeps begin and end,
        # and the more so the longer the window.
        padded = np.pad(piece.values, ((n // 2, n // 2 + step), (0, 0)))
        cut = np.lib.stride_tricks.sliding_window_view(padded, n, axis=0)[::step]
        both = cut.reshape(-1, n) @ kernel
        z = (both[:, : both.shape[1] // 2] + 1j * both[:, both.shape[1] // 2 :]).reshape(len(cut), channels, -1)
        by_line = np.ascontiguousarray(z.transpose(2, 1, 0))
        total += by_line.conj() @ by_line.transpose(0, 2, 1)
    values = np.full((omega.size, channels, channels), np.nan, dtype=np.complex128)
    length = sum(piece.duration for piece in long_enough)
    # Every sample lies under the same total of squared tapers: dividing by the records' length keeps the power.
    values[resolved] = total * (2.0 * dt / (length / (step * dt) * float(taper @ taper)))
    averages = length / (n * dt)
    return SpectralMatrix(n * dt, averages, values, tuple(piece.name for piece in long_enough))


_BLOCK = 64
"""Samples of a kernel that are made at once: few enough to stay in a processor's cache."""


def _kernel(omega: Array, taper: Array, dt: float) -> Array:
    """Columns of cosines and minus sines under the taper, blind to a constant, shape (n, 2 n_frequencies)."""
    # e^(-j omega dt n) with n = 64 b + a as a product of two small tables: sines are dear, products are not.
    fine = np.exp(-1j * dt * np.outer(np.arange(_BLOCK), omega))
    coarse = np.exp(-1j * dt * _BLOCK * np.outer(np.arange(-(-taper.size // _BLOCK)), omega))
    kernel = np.empty((taper.size, 2 * omega.size))
    blocks = [slice(first, first + _BLOCK) for first in range(0, taper.size, _BLOCK)]
    for start, block in zip(coarse, blocks, strict=True):
        weight = taper[block, None]
        wave = start * fine[: len(weight)]
        np.multiply(wave.real, weight, out=kernel[block, : omega.size])
        np.multiply(wave.imag, weight, out=kernel[block, omega.size :])
    # The tapered mean is taken out of every window: at the lowest line it would leak in from frequency zero.
    mean = kernel.sum(axis=0) / taper.sum()
    for block in blocks:
        kernel[block] -= taper[block, None] * mean
    return kernel
