"""The noise of records with controls: how it is coloured, how large it is by band, and how sure that is.

A long autoregression with controls, A(z) y = B(z) u + e, is fitted to the records themselves, which also works in a
loop (Ljung 1999, ch. 13). A is the filter that whitens gusts and noise, e their innovations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, Complex

_MEMORY = 2.0
"""Longest fading time [s] of the filter: gusts and attitudes, which the outputs need not hold, last about as long."""

_LEAST = 1e-4
"""Innovations below this share of a channel's movement are no noise, but how it was made (derived, or simulated)."""

INDEPENDENT = 18.0 / 35.0
"""Independent lines behind a Hann window, per line: (mean w^2)^2 / mean w^4."""

_ROWS_PER_NUMBER = 4.0
"""Samples per number of the noise filter below which a record is too short."""


@dataclass(frozen=True)
class Piece:
    """One unbroken record.

    Attributes:
        source: its name. inputs, outputs: deviations (n, m), (n, k). dt: step [s].
        moved: whether something from outside moved an input (`flights/excitation.py`). In a loop without a sweep
            commands and motion are related by minus the controller's inverse, whatever the model.
    """

    source: str
    inputs: Array
    outputs: Array
    dt: float
    moved: bool


@dataclass(frozen=True)
class NoiseFilter:
    """A(z) of A(z) y = B(z) u + e, the same for every model that is judged by the same records.

    Attributes:
        memories: factors (p,) per sample by which averages of the past fade; weights: (p, k, k), y(t) = sum of
            average_l(t) @ weights[l] + ... . noise: rms of e by record and output (r, k).
        every: samples averaged into one. innovations: e over its noise by record, (n, k) each.
        span: by record, its rows (n, q) of orthonormal columns: of white noise the fit takes out the part along them.
        together: by record, what of y (n, k) moves at the same instant as the inputs: their effect, or their cause.
    """

    memories: Array
    weights: Array
    noise: Array
    every: int
    innovations: tuple[Array, ...]
    span: tuple[Array, ...]
    together: tuple[Array, ...]

    @classmethod
    def of(cls, pieces: Sequence[Piece], every: int, low: float) -> NoiseFilter | None:
        """By least squares over all records, for frequencies above `low` [Hz]; None where they are too short."""
        tables = [averaged(np.hstack([p.inputs, p.outputs]), every) for p in pieces]
        m, k = pieces[0].inputs.shape[1], pieces[0].outputs.shape[1]
        memories = _memories(pieces[0].dt * every, low)
        rows = sum(len(t) for t in tables)
        count = min(memories.size, int((rows / _ROWS_PER_NUMBER - m - 1) / (m + k)))
        if count < 2:
            return None
        memories = memories[:count]
        tables = [t - t.mean(axis=0) for t in tables]
        past = [np.hstack([_past(t[:, m:], memories), _past(t[:, :m], memories), np.ones((len(t), 1))]) for t in tables]
        z, y, now = np.vstack(past), np.vstack([t[:, m:] for t in tables]), np.vstack([t[:, :m] for t in tables])
        record = np.repeat(np.arange(len(tables)), [len(t) for t in tables])
        size = np.maximum(np.linalg.norm(z, axis=0), 1e-300)
        span, stretch, turn = np.linalg.svd(z / size, full_matrices=False)
        kept = stretch > 1e-10 * stretch[0]
        span, stretch, turn = span[:, kept], stretch[kept], turn[kept]
        # What the inputs of the same instant add to the past. In a loop it may as well be the controller's answer.
        fresh = now - span @ (span.T @ now)
        aside, wide, mixed = np.linalg.svd(fresh / np.maximum(np.linalg.norm(now, axis=0), 1e-300), full_matrices=False)
        kept = wide > 1e-8
        aside, wide, mixed = aside[:, kept], wide[kept], mixed[kept]
        at_once = aside @ (aside.T @ y)
        direct = now @ (
            mixed.T @ (aside.T @ y / wide[:, None]) / np.maximum(np.linalg.norm(now, axis=0), 1e-300)[:, None]
        )
        numbers = turn.T @ (span.T @ (y - direct) / stretch[:, None]) / size[:, None]
        left = y - span @ (span.T @ y) - at_once
        span = np.hstack([span, aside])
        noise = np.array([np.sqrt(np.mean(left[record == r] ** 2, axis=0)) for r in range(len(tables))])
        noise = np.maximum(noise, _LEAST * np.maximum(np.std(y, axis=0), 1e-300))
        parts = [record == r for r in range(len(tables))]
        innovations = tuple(left[at] / noise[r] for r, at in enumerate(parts))
        weights = numbers[: k * count].reshape(count, k, k)
        spans = tuple(span[at] for at in parts)
        together = tuple(at_once[at] / noise[r] for r, at in enumerate(parts))
        return cls(memories, weights, noise, every, innovations, spans, together)

    def __call__(self, values: Array, record: int) -> Array:
        """A of outputs (n, k, ...) at the full rate, over the noise: white of size one where there is no more."""
        slow = averaged(values, self.every)
        n, k = len(slow), self.weights.shape[1]
        flat = slow.reshape(n, k, -1)
        explained = np.zeros_like(flat)
        for memory, weight in zip(self.memories, self.weights, strict=True):
            explained += weight.T @ _fading(flat, memory)
        return np.asarray(((flat - explained) / self.noise[record][None, :, None]).reshape(slow.shape))

    def response(self, omega: Array, dt: float) -> Complex:
        """A at frequencies [rad/s] as (n, k from, k to), `dt` of the averaged samples."""
        turn = np.exp(-1j * omega[:, None] * dt)
        fading = (1.0 - self.memories) * turn / (1.0 - self.memories * turn)
        return np.asarray(np.eye(self.weights.shape[1]) - np.einsum("fl,lko->fko", fading, self.weights))


def _memories(dt: float, low: float) -> Array:
    """The last sample, and averages of the past that fade ever more slowly, each half as fast as the one before."""
    slowest = max(min(_MEMORY, 1.0 / (2.0 * np.pi * low)), 2.0 * dt)
    times = np.geomspace(dt / 1.5, slowest, 2 + int(np.log2(slowest / dt)))
    return np.concatenate([[0.0], np.exp(-dt / times)])


def _fading(values: Array, memory: float) -> Array:
    """Fading average of a signal's past samples; before the first one nothing moved."""
    from scipy.signal import lfilter

    delayed = np.concatenate([np.zeros_like(values[:1]), values[:-1]])
    return np.asarray(lfilter([1.0 - memory], [1.0, -memory], delayed, axis=0))


def _past(values: Array, memories: Array) -> Array:
    return np.hstack([_fading(values, memory) for memory in memories])


@dataclass(frozen=True)
class NoiseLevel:
    """What noise leaves of the predictions of a right model, beyond the innovations, by record and band.

    The errors of a right model are white noise w behind the filter, the innovations are (1 - P) w: the fit has taken
    P w along its own columns. So a right model's predictions are off from the filter's by P w, and no more.

    Attributes:
        bands: by record, which lines of a transform lie in each band (n_bands, n_lines).
        colour: mean square of w by band and output (n_bands, k). free: lines of all records that tell it, by band.
        lines: by record and band. floor: mean square of P w for w of size one. freedom: its degrees of freedom.
    """

    bands: tuple[NDArray[np.bool_], ...]
    colour: Array
    free: Array
    lines: NDArray[np.intp]
    floor: Array
    freedom: Array

    @classmethod
    def behind(cls, filter: NoiseFilter, dt: float, edges: Array) -> NoiseLevel:
        """The levels between edges [Hz], `dt` of the averaged samples."""
        bands = tuple(_bands(len(e), dt, edges) for e in filter.innovations)
        lines = np.array([np.sum(inside, axis=1) for inside in bands])
        power, taken, freedom = np.zeros((edges.size - 1, filter.weights.shape[1])), np.zeros(lines.shape), lines + 1.0
        for r, (e, span, inside) in enumerate(zip(filter.innovations, filter.span, bands, strict=True)):
            if not len(e):
                continue
            power += inside @ np.abs(spectrum(e)) ** 2
            columns = spectrum(span)
            for b, here in enumerate(inside):
                # |P w|^2 of a band is a quadratic form c' K c of standard normal c: its first two moments.
                form = np.real(columns[here].conj().T @ columns[here])
                taken[r, b] = np.trace(form)
                freedom[r, b] = taken[r, b] ** 2 / max(float(np.sum(form**2)), 1e-300)
        free = np.sum(lines - taken, axis=0)
        colour = np.maximum(power / np.maximum(free, 1e-9)[:, None], _LEAST)
        return cls(bands, colour, free, lines, taken / np.maximum(lines, 1), np.maximum(freedom, 1.0))

    @property
    def known(self) -> NDArray[np.bool_]:
        """Bands (n_bands, 1) of which the fit has left at least half: elsewhere it is the noise that was fitted."""
        return np.asarray(self.free >= 0.5 * np.sum(self.lines, axis=0))[:, None]

    def power(self, record: int, values: Array) -> Array:
        """Mean square of what comes out of the filter (n, k) by band and output, relative to the noise."""
        return self.of_lines(record, np.abs(spectrum(values)) ** 2)

    def of_lines(self, record: int, lines: Array) -> Array:
        """The same of squared lines (n_lines, k, ...)."""
        divided = np.maximum(self.lines[record], 1)[:, None] * self.colour
        power = np.tensordot(self.bands[record], lines, 1)
        return np.asarray(power / divided.reshape(*divided.shape, *[1] * (lines.ndim - 2)))

    def inverse(self, record: int) -> Array:
        """By what lines are multiplied to have noise of size one (n_lines, k); zero outside the bands."""
        return np.asarray(self.bands[record].T @ (1.0 / np.sqrt(self.colour)))

    def inside(self, record: int, cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Which lines lie in some bands and outputs (n_bands, k), as (n_lines, k)."""
        return np.asarray(self.bands[record].T.astype(int) @ cells > 0)

    def largest(self, record: int, chance: float) -> Array:
        """Root mean square by band (n_bands, 1) that P w stays below but for a chance (Fisher's F)."""
        from scipy.stats import f as fisher

        behind = np.maximum(2.0 * INDEPENDENT * self.free, 1.0)
        square = self.floor[record] * fisher.isf(chance, self.freedom[record], behind)
        return np.asarray(np.sqrt(square)[:, None])


def averaged(values: Array, every: int) -> Array:
    """Means over `every` samples."""
    n = values.shape[0] // every
    return np.asarray(values[: n * every].reshape(n, every, *values.shape[1:]).mean(axis=1))


def spectrum(values: Array) -> Complex:
    """Of a record behind a Hann window, which keeps what is outside a band out of it; white of size one gives one."""
    n = len(values)
    window = np.sqrt(8.0 / 3.0 / n) * np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2
    return np.asarray(np.fft.rfft(window.reshape(-1, *[1] * (values.ndim - 1)) * values, axis=0))


def _bands(n: int, step: float, edges: Array) -> NDArray[np.bool_]:
    hertz = np.fft.rfftfreq(n, step) if n else np.zeros(0)
    return np.array([(hertz >= low) & (hertz < high) for low, high in pairwise(edges)])
