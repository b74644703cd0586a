"""Channels that are copies of each other, in size and delay: between them there is nothing to identify.

A command and the sum of the terms that it is made of are one signal where nothing was added between them: a loop that
is "broken" there has a response of exactly one, whatever the aircraft does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from swashplate.arrays import Array, Complex
from swashplate.errors import FlightError
from swashplate.flights.conditioning.filters import detrended
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.responses.spectra import Signals, runs

_EXACT = 1e-5
"""What a copy of the same samples may be off by, of its size: logs keep numbers in single precision (1e-7), and what
two messages make of the same number differs by little more."""
_LATE, _BENT = 2e-5, 0.1
"""... one that is late by a part of a sample, and the share of a delay's second-order term that it may differ by."""
_ALIKE = 0.98
"""Correlation from which on a delay is looked for: the ends that a shift leaves over cost some."""
_FEWEST = 20  # samples by which a copy is told
_EDGE = 0.1  # s: about the ends of a sweep, where stamps and interpolation put something of it
_LONGEST = 0.5  # s: of a delay
_SMOOTH, _STEPS = 3.0, 6
"""Standard deviation [samples] of the smoothing under which a spline is exact between samples, and steps to a shift."""


@dataclass(frozen=True)
class Copy:
    """One channel that is another one times `factor`, `delay` later [s]."""

    one: str
    other: str
    factor: float
    delay: float

    def __str__(self) -> str:
        size = "" if abs(self.factor - 1.0) < 1e-3 else f" times {self.factor:.4g}"
        delay = f", {1e3 * self.delay:+.3g} ms later" if self.delay else ""
        return f"'{self.other}' is a copy of '{self.one}'{size}{delay}"


def copies_of(pieces: Sequence[Signals], ones: Mapping[str, int], others: Mapping[str, int]) -> list[Copy]:
    """Which of the `others` are copies of which of the `ones` in all records; what never moves is no copy.

    Args:
        pieces: records. ones, others: columns by name.
    """
    places = [*ones.values(), *others.values()]
    raw = [piece.values[:, places] for piece in pieces]
    smooth = [_smoothed(table) for table in raw]
    longest = max(smooth, key=len)
    reach = round(_LONGEST / pieces[0].dt)
    spectra = np.asarray(rfft(longest, int(next_fast_len(len(longest) + reach, real=True)), axis=0))
    copies = []
    for i, one in enumerate(ones):
        for j, other in enumerate(others, start=len(ones)):
            pairs = [table[:, [i, j]] for table in raw]
            if not all(np.any([np.any(table[:, k]) for table in pairs]) for k in (0, 1)):
                continue
            factor, off = _factor(np.concatenate(pairs))
            if off < _EXACT:
                copies.append(Copy(one, other, factor, 0.0))
                continue
            lag = _lag(spectra[:, [i, j]], longest[:, [i, j]], reach)
            match = None if lag is None else _delayed_match([table[:, [i, j]] for table in smooth], lag, reach)
            if match is not None:
                copies.append(Copy(one, other, match[0], match[1] * pieces[0].dt))
    return copies


def broken_at(
    pieces: Sequence[Signals], references: Sequence[Array], input: int, outputs: Mapping[str, int]
) -> tuple[str, ...]:
    """The outputs that an input is made of, apart from its own reference: a loop, broken between the two.

    Args:
        pieces: records. references: of the input, for each of them, shape (n,): where it is silent, such an output is
            a copy of the input.
        input, outputs: columns.
    """
    edge = round(_EDGE / pieces[0].dt)
    silent = [
        replace(piece, values=detrended(piece.values[run.start + edge : run.stop - edge]))
        for piece, reference in zip(pieces, references, strict=True)
        for run in runs(reference == 0.0)
        if run.stop - run.start >= 2 * edge + _FEWEST
    ]
    if not silent:
        return ()
    return tuple(copy.other for copy in copies_of(silent, {"input": input}, outputs) if copy.delay == 0.0)


def refuse_copied_references(pieces: Sequence[Signals], references: Mapping[str, int], fed: Mapping[str, int]) -> None:
    """Raise where a reference is a copy of an input or output.

    Raises:
        FlightError: naming both.
    """
    for copy in copies_of(pieces, references, fed):
        raise FlightError(
            f"is named as a reference, and {copy}: a reference is what comes from outside, before any loop acts.",
            channel=copy.one,
            hint="Leave --references away where nothing is fed back; otherwise name what a program adds to a command.",
        )


def without_copies(pairs: FrequencyResponse, copies: Sequence[Copy]) -> FrequencyResponse:
    """The responses less those of outputs that are copies of an input."""
    response = pairs.response.copy()
    response[:, [pairs.outputs.index(copy.other) for copy in copies]] = np.nan
    return replace(pairs, response=response) if copies else pairs


def copy_words(copies: Sequence[Copy]) -> list[str]:
    return [
        f"{copy.other} / {copy.one}: {copy}. Nothing acts between them in these records: no number is given. For a "
        "loop broken there, name a record in which a sweep was added between the two."
        for copy in copies
    ]


def _smoothed(table: Array) -> Array:
    from scipy.ndimage import gaussian_filter1d  # slow to import

    return np.asarray(gaussian_filter1d(table, _SMOOTH, axis=0))


def _factor(both: Array) -> tuple[float, float]:
    """The multiple of the first column that the second is best, and what it leaves of it, of its size."""
    one, other = both.T
    factor = float(one @ other / float(one @ one))
    return factor, float(np.linalg.norm(other - factor * one) / np.linalg.norm(other))


def _lag(spectra: Complex, both: Array, reach: int) -> float | None:
    """Samples by which the second column follows the first, at most `reach` either way; None where it does not."""
    size = float(np.prod(np.linalg.norm(both, axis=0)))
    products = np.abs(irfft(spectra[:, 1] * spectra[:, 0].conj()))
    lags = np.arange(-reach, reach + 1)
    best = int(lags[np.argmax(products[lags])])
    return float(best) if products[best] > _ALIKE * size else None


def _delayed_match(tables: Sequence[Array], lag: float, reach: int) -> tuple[float, float] | None:
    """Factor and lag [samples] by which the second columns are copies of the first; None where they are none.

    A slow signal behind a quick lag is nearly late by its time constant. To the second order a lag differs: H is
    1 - d s + d^2 s^2 / 2 for a delay d, and the last term is d^2 s^2 for a first-order lag.
    """
    for _ in range(_STEPS):
        shifted = np.concatenate([_shifted(table, lag, reach) for table in tables])
        first, second = shifted[:, 0], shifted[:, 3]
        off = float(np.linalg.norm(second - first * (first @ second) / (first @ first)) / np.linalg.norm(second))
        terms = shifted[:, :3] if off < _LATE else shifted[:, :2]
        factor, change, *rest = map(float, np.linalg.lstsq(terms, second, rcond=None)[0])
        if off < _LATE:
            return (factor, lag) if abs(rest[0]) < _BENT * abs(factor) * lag**2 / 2.0 else None
        lag -= float(np.clip(change / (factor or 1.0), -1.0, 1.0))
    return None


def _shifted(table: Array, lag: float, reach: int) -> Array:
    """The first column later by `lag` samples, its slope and bend, and the second, less their straight lines."""
    from scipy.interpolate import CubicSpline

    inside = np.arange(reach + 1, len(table) - reach - 1)
    if inside.size < 4:
        return np.zeros((0, 4))
    spline = CubicSpline(np.arange(len(table)), table[:, 0])
    terms = [spline(inside - lag, order) for order in range(3)]
    return detrended(np.stack([*terms, table[inside, 1]], axis=1))
