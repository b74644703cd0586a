"""A line that moves slowly in a complex signal: its frequency over time with bounds, and whether it stands out at all.

A rotor that is out of balance or out of track shakes the body once per turn. Of two signals that lie across each
other, such as roll and pitch, roll + i pitch turns with the rotor: clockwise from above is a positive frequency,
counter-clockwise a negative one, so that two rotors of opposite sense cannot be confused.

The line is the best path through the spectra of overlapping windows (dynamic programming, Viterbi 1967), each spectrum
over its own surroundings. Noise has a best path too: what it scores is found with noise that is made and tracked alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from swashplate.arrays import Array, Complex

WINDOW, HOP = 1.0, 0.1
"""Seconds of one spectrum, and between spectra."""

STANDS_OUT = 6.0
"""Standard deviations of noise's score above its mean that a line must reach."""

_FASTEST = 20.0  # Hz per second that a line may move
_SURROUNDINGS = 8.0  # Hz to either side that are a bin's surroundings
_FINE = 4  # bins per resolved one
_DRAWS, _SEED = 12, 1
_LONGEST = 40.0  # seconds of noise that are drawn
_LOBE = 2.5  # resolved bins to either side that belong to a line
_APART = 6.0  # resolved bins by which two lines must part somewhere to be two


@dataclass(frozen=True)
class SpectralLine:
    """A tracked line.

    Attributes:
        time: middles of the windows [s], shape (n,). frequency: [Hz], signed. sigma: its standard deviation [Hz].
        decibel: mean power over its surroundings [dB]. score: standard deviations of noise's score above its mean.
        crossing: times [s] where another line comes within what a window resolves; empty where none does.
    """

    time: Array
    frequency: Array
    sigma: Array
    decibel: float
    score: float
    crossing: tuple[float, ...]


def spectra(signal: Complex, rate: float, band: tuple[float, float]) -> tuple[Array, Array]:
    """Frequencies (f,) [Hz] in a band, rising, and power over surroundings (frames, f), one for noise on average."""
    length, hop = round(WINDOW * rate), max(1, round(HOP * rate))
    frames = np.lib.stride_tricks.sliding_window_view(signal, length)[::hop]
    at = np.linspace(-1.0, 1.0, length)
    smooth = np.linalg.qr(np.vander(at, 4))[0]  # what moves in a window as a cubic is no vibration
    level = frames - (frames @ smooth) @ smooth.T
    size = _FINE * length
    frequency = np.fft.fftshift(np.fft.fftfreq(size, 1.0 / rate))
    near = (frequency >= band[0] - _SURROUNDINGS) & (frequency <= band[1] + _SURROUNDINGS)
    power = np.abs(np.fft.fftshift(np.fft.fft(level * np.hanning(length), size, axis=1), axes=1)[:, near]) ** 2
    width = 2 * round(_SURROUNDINGS * size / rate) + 1
    around = median_filter(power, size=(1, width), mode="mirror") / np.log(2.0)  # of exponential noise: the mean
    inside = (frequency[near] >= band[0]) & (frequency[near] <= band[1])
    above = np.asarray(power / np.maximum(around, 1e-300), dtype=np.float64)
    return np.asarray(frequency[near][inside], dtype=np.float64), above[:, inside]


def track(pieces: list[tuple[Array, Complex]], rate: float, band: tuple[float, float]) -> SpectralLine | None:
    """The line within a band of frequencies, or None where the pieces are shorter than a window.

    Args:
        pieces: stamps [s] and signal of unbroken stretches, evenly sampled.
        rate: samples per second [Hz]. band: signed limits [Hz].
    """
    length = round(WINDOW * rate)
    kept = [(t, z) for t, z in pieces if t.size > length]
    if not kept:
        return None
    tables, middles, hertz = [], [], np.zeros(0)
    for t, z in kept:
        hertz, ratio = spectra(z, rate, band)
        tables.append(ratio)
        middles.append(t[0] + (np.arange(len(ratio)) * max(1, round(HOP * rate)) + 0.5 * (length - 1)) / rate)
    scores, paths = _mean_score(tables, hertz)
    usual, scatter = _of_noise(tuple(t.size for t, _ in kept), rate, band)
    resolved = 1.0 / WINDOW
    others = [_without(table, hertz[path], hertz, _LOBE * resolved) for table, path in zip(tables, paths, strict=True)]
    second, beside = _mean_score(others, hertz)
    crossing: list[float] = []
    if second > usual + STANDS_OUT * scatter:
        apart = np.concatenate([np.abs(hertz[a] - hertz[b]) for a, b in zip(paths, beside, strict=True)])
        if apart.max() > _APART * resolved:
            crossing = [float(t) for t in np.concatenate(middles)[apart < (_LOBE + 1.0) * resolved]]
    rows = np.concatenate(tables)
    place = np.concatenate(paths)
    peak = rows[np.arange(place.size), place]
    return SpectralLine(
        np.concatenate(middles),
        _between_bins(rows, place, hertz),
        _sigma(peak, rate),
        float(10.0 * np.log10(max(np.mean(peak), 1e-12))),
        (scores - usual) / scatter,
        tuple(crossing),
    )


@lru_cache(maxsize=32)
def _of_noise(sizes: tuple[int, ...], rate: float, band: tuple[float, float]) -> tuple[float, float]:
    """Mean and standard deviation of the score of white noise in stretches of these sizes; long ones by their root."""
    rng, most = np.random.default_rng(_SEED), round(_LONGEST * rate)
    short = [min(size, most) for size in sorted(sizes)[::-1]][: max(1, round(most / max(max(sizes), 1)))]
    scores = []
    for _ in range(_DRAWS):
        drawn = [rng.standard_normal(n) + 1j * rng.standard_normal(n) for n in short]
        tables = [spectra(z, rate, band) for z in drawn]
        scores.append(_mean_score([table for _, table in tables], tables[0][0])[0])
    return float(np.mean(scores)), float(np.std(scores) * np.sqrt(sum(short) / sum(sizes)))


def _mean_score(tables: list[Array], hertz: Array) -> tuple[float, list[NDArray[np.intp]]]:
    """Mean of log(1 + power) along the best path of each stretch, and the paths as bins."""
    paths = [_path(np.log1p(table), hertz) for table in tables]
    values = [np.log1p(table)[np.arange(len(path)), path] for table, path in zip(tables, paths, strict=True)]
    return float(np.mean(np.concatenate(values))), paths


def _path(score: Array, hertz: Array) -> NDArray[np.intp]:
    """Bins of the path of highest score that moves no faster than a rotor may."""
    reach = max(1, round(_FASTEST * HOP / float(hertz[1] - hertz[0])))
    steps = np.arange(-reach, reach + 1)
    n, width = score.shape
    total, came = score[0].copy(), np.zeros((n, width), dtype=np.intp)
    for k in range(1, n):
        padded = np.pad(total, reach, constant_values=-np.inf)
        ways = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
        best = np.argmax(ways, axis=1)
        came[k] = np.arange(width) + steps[best]
        total = ways[np.arange(width), best] + score[k]
    path = np.zeros(n, dtype=np.intp)
    path[-1] = int(np.argmax(total))
    for k in range(n - 1, 0, -1):
        path[k - 1] = came[k, path[k]]
    return path


def _without(table: Array, line: Array, hertz: Array, width: float) -> Array:
    near = np.abs(hertz[None, :] - line[:, None]) < width
    return np.where(near, 0.0, table)


def _between_bins(rows: Array, place: NDArray[np.intp], hertz: Array) -> Array:
    """The top of a parabola through the logarithms of a peak and its neighbours."""
    at = np.clip(place, 1, rows.shape[1] - 2)
    left, top, right = (np.log(np.maximum(rows[np.arange(at.size), at + k], 1e-12)) for k in (-1, 0, 1))
    bend = left - 2.0 * top + right
    shift = np.where(bend < 0.0, 0.5 * (left - right) / np.where(bend < 0.0, bend, 1.0), 0.0)
    return np.asarray(hertz[at] + np.clip(shift, -1.0, 1.0) * (hertz[1] - hertz[0]))


def _sigma(peak: Array, rate: float) -> Array:
    """Standard deviation [Hz] of the frequency at which a windowed tone in white noise has its peak.

    To first order, var(omega) = (noise / 2) sum (w t)^2 / (A sum w t^2)^2; the peak over the noise is
    A^2 (sum w)^2 / (noise sum w^2).
    """
    n = round(WINDOW * rate)
    w, t = np.hanning(n), (np.arange(n) - 0.5 * (n - 1)) / rate
    power = np.maximum(peak - 1.0, 0.3) * np.sum(w**2) / np.sum(w) ** 2  # A^2 over the noise
    return np.asarray(np.sqrt(0.5 / power * np.sum((w * t) ** 2)) / np.sum(w * t**2) / (2.0 * np.pi))
