"""How well a rate loop follows its target, frequency by frequency: error, coherence, gain and phase over octaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.flights.averaged_spectra import cross_density
from swashplate.flights.review.stretches import Stretch

_WINDOW = 4.0  # s
_LOWEST = 0.5  # Hz: two periods in a window
_COHERENT = 0.5
_LEAST = 6  # windows: of fewer, coherence is high by chance (bias 1 / windows)


@dataclass(frozen=True)
class Octave:
    """One octave of a loop.

    Attributes:
        low, high: [Hz].
        target, motion, error: rms [rad/s]; error is of motion minus target.
        coherence: of target and motion, 0 to 1; gain, phase [rad]: of motion to target, in the middle.
    """

    low: float
    high: float
    target: float
    motion: float
    error: float
    coherence: float
    gain: float
    phase: float


def tracking(pieces: Sequence[Stretch]) -> tuple[tuple[Octave, ...], float]:
    """Octaves from 0.5 Hz on, and the frequency [Hz] up to which target and motion are coherent (0: nowhere).

    Args:
        pieces: target and motion side by side [rad/s].
    """
    if not pieces:
        return (), 0.0
    rate = float(np.median([piece.rate for piece in pieces]))
    size = round(_WINDOW * rate)
    sums, count = np.zeros((4, size // 2 + 1), dtype=np.complex128), 0
    for piece in pieces:
        windows = 1 + (len(piece.values) - size) // (size - size // 2)
        if windows < 1 or abs(piece.rate - rate) > 0.05 * rate:
            continue
        x, y = piece.values[:, 0], piece.values[:, 1]
        for k, (a, b) in enumerate(((x, x), (y, y), (x, y), (y - x, y - x))):
            frequency, density = cross_density(a, b, rate=rate, window=size)
            sums[k] += windows * density
        count += windows
    if count < _LEAST:
        return (), 0.0
    targets, other, cross, error = sums / count
    step = float(frequency[1])
    octaves = []
    low = _LOWEST
    while 2.0 * low <= 0.45 * rate:
        inside = (frequency >= low) & (frequency < 2.0 * low)
        power = np.sum(targets[inside].real), np.sum(other[inside].real)
        response = np.sum(cross[inside]) / max(power[0], np.finfo(np.float64).tiny)
        # Phase turns within an octave: coherence is averaged line by line, by the target's power.
        lines = np.abs(cross[inside]) ** 2 / np.maximum(targets[inside].real * other[inside].real, 1e-300)
        weight = targets[inside].real / max(power[0], 1e-300)
        target, motion, off = (float(np.sqrt(max(step * np.sum(e[inside].real), 0.0))) for e in (targets, other, error))
        coherence, gain, phase = float(np.sum(weight * lines)), float(abs(response)), float(np.angle(response))
        octaves.append(Octave(low, 2.0 * low, target, motion, off, coherence, gain, phase))
        low *= 2.0
    usable = 0.0
    for octave in octaves:
        if octave.coherence < _COHERENT:
            break
        usable = octave.high
    return tuple(octaves), usable
