"""Windows blur responses: what a first estimate explains is taken out of the outputs before the second one.

A window of T seconds sees a response through a lobe 4/T wide. Where a sweep dwells, or a mode is lightly damped, the
lobe mixes the neighbours in and the coherence falls although nothing is noisy: a record of 59 s with a dwell at 0.15 Hz
showed a first-order washout 1 dB off at 0.23 Hz with a coherence of 0.96. What the first estimate leaves of the outputs
has nothing steep in it; its response is added to what was taken out (prewhitening: Bendat and Piersol 2010, sec. 11.6;
"twicing": Tukey 1977, ch. 16).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from swashplate.arrays import Array, Complex
from swashplate.identification.responses.frequency_response import LEAST_COHERENCE, FrequencyResponse
from swashplate.identification.responses.spectra import Signals

TWICED = 1.25
"""How much more the second estimate scatters than the random error of its coherence says: it carries the first one's
noise nearly twice, less once more blurred. Measured: 1.06 times (40 records of noise through a first-order lag), and
1.22 (median) to 1.47 (95th percentile) on an R-50 in hover, over 1,600 points of 3 flights."""

BLURRED, LONGER = 0.3, 1.4
"""Change [dB] that the second estimate makes, above which a longer window is wanted, and how much longer."""


@dataclass(frozen=True)
class _Between:
    """Places between the lines of a grid, once for all pairs."""

    below: Array
    share: Array

    @staticmethod
    def of(omega: Array, at: Array) -> _Between:
        x = np.interp(np.log(np.maximum(at, 1e-12)), np.log(omega), np.arange(omega.size))
        below = np.minimum(x.astype(int), omega.size - 2)
        return _Between(below, x - below)

    def __call__(self, values: Array) -> Array:
        return np.asarray(values[self.below] * (1.0 - self.share) + values[self.below + 1] * self.share)


def first_guess(responses: FrequencyResponse) -> Complex:
    """A response at every line: what is coherent, straight across holes and held at the ends; zero for hopeless pairs.

    Returns:
        Shape (n_f, n_outputs, n_inputs).
    """
    return coherent_guess(responses.omega, responses.response, responses.coherence)


def coherent_guess(omega: Array, response: Complex, coherence: Array) -> Complex:
    """As `first_guess`, of plain arrays: frequencies [rad/s], responses and coherences of shape (n_f, n_out, n_in)."""
    guess = np.zeros(response.shape, dtype=np.complex128)
    x = np.log(omega)
    for o in range(response.shape[1]):
        for i in range(response.shape[2]):
            h = response[:, o, i]
            known = np.isfinite(h) & (coherence[:, o, i] >= LEAST_COHERENCE) & (np.abs(h) > 0.0)
            if known.sum() >= 4:
                gain = np.interp(x, x[known], np.log(np.abs(h[known])))
                guess[:, o, i] = np.exp(gain + 1j * np.interp(x, x[known], np.unwrap(np.angle(h[known]))))
    return guess


def without(pieces: Sequence[Signals], omega: Array, guess: Complex) -> list[Signals]:
    """Records whose outputs lack what a response makes of their inputs (from rest).

    Args:
        pieces: channels in the order inputs, outputs, others.
        omega: frequencies [rad/s] of the response, rising.
        guess: shape (n_f, n_outputs, n_inputs); zero for pairs that are left alone.
    """
    n_out, n_in = guess.shape[1:]
    left = []
    for piece in pieces:
        n = len(piece.values)
        size = int(next_fast_len(2 * n, real=True))
        spectra = np.asarray(rfft(piece.values[:, :n_in], size, axis=0))
        between = _Between.of(omega, 2.0 * np.pi * rfftfreq(size, piece.dt))
        values = piece.values.copy()
        for o in range(n_out):
            for i in np.flatnonzero(np.any(guess[:, o, :], axis=0)):
                h = guess[:, o, i]
                response = np.exp(between(np.log(np.abs(h))) + 1j * between(np.unwrap(np.angle(h))))
                values[:, n_in + o] -= irfft(response * spectra[:, i], size)[:n]
        left.append(replace(piece, values=values))
    return left


def blur(first: FrequencyResponse, second: FrequencyResponse) -> str:
    """Pairs that windows had blurred so much that something of it may be left, in words ("" for none).

    Args:
        first, second: estimates before and after.
    """
    places, worst = [], 0.0
    for output in second.outputs:
        for name in second.inputs:
            band = second.band(output, name)
            if band is None:
                continue
            before, after = first.pair(output, name)[0], second.pair(output, name)[0]
            inside = (second.omega >= band[0]) & (second.omega <= band[1]) & np.isfinite(before) & np.isfinite(after)
            change = np.zeros(second.omega.size)
            change[inside] = np.abs(20.0 * np.log10(np.abs(after[inside] / before[inside])))
            noise = 20.0 * np.log10(1.0 + np.nan_to_num(second.pair(output, name)[2]))
            off = np.flatnonzero(inside & (change > np.maximum(BLURRED, noise)))
            if off.size >= 3:
                low, high = second.omega[off[[0, -1]]] / (2.0 * np.pi)
                places.append(f"{output} / {name} at {low:.3g}-{high:.3g} Hz")
                worst = max(worst, float(change[off].max()))
    return f"blurred {', '.join(places)}, by up to {worst:.1f} dB before it was sharpened" if places else ""
