"""Which broken rate loops keep the margins of a suggestion: alone, and with Betaflight's ANGLE mode around them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, Complex
from swashplate.control.analysis.cascade import BrokenLoops

PHASE_MARGIN, GAIN_MARGIN, PEAK = 45.0, 6.0, 2.0
"""Degrees, decibels and largest sensitivity that every suggestion keeps."""
ANGLE = 5.0
"""Demanded rate over a missing angle [1/s]: angle_p_gain of 50, Betaflight's own."""


def keeps_margins(loops: Complex) -> NDArray[np.bool_]:
    """Which loops are stable by Nyquist's count of a stable plant, and far enough from -1 at every crossing, (m,).

    One whose gain is above one to the end of what is judged has a crossover, and a delay margin, that nobody has seen.
    """
    around = 1.0 + loops
    turns = np.unwrap(np.angle(around), axis=1)
    size, phase = np.abs(loops), np.degrees(np.angle(loops))
    above = size > 1.0
    crossing = above[:, :-1] != above[:, 1:]
    narrow = (crossing & (180.0 - np.abs(phase[:, :-1]) < PHASE_MARGIN)).any(axis=1)
    loud = (np.abs(np.diff(phase, axis=1)) > 180.0) & (size[:, :-1] >= 10.0 ** (-GAIN_MARGIN / 20.0))
    encircled = np.abs(turns[:, -1] - turns[:, 0]) > np.pi
    near = np.abs(around).min(axis=1) <= 1.0 / PEAK
    return np.asarray(~encircled & ~narrow & ~loud.any(axis=1) & ~near & ~above[:, -1])


def keeps_with_angle(omega: Array, loops: Complex, ahead: Complex) -> NDArray[np.bool_]:
    """Which of m loops keep their margins at every crossing, broken at the command with the angle closed, shape (m,).

    Args:
        omega: [rad/s], shape (n,).
        loops: of the rate alone, stable when closed, shape (m, n).
        ahead: from the demanded rate to the rate with the rate loop open, shape (m, n).
    """
    with_angle = np.asarray(loops + ahead * ANGLE / (1j * omega), dtype=np.complex128)
    broken = BrokenLoops(omega, with_angle[..., None], np.zeros(len(with_angle)))
    kept = (broken.phase >= PHASE_MARGIN) & (broken.gain >= GAIN_MARGIN) & (broken.peak <= PEAK)
    return np.asarray(kept[:, 0] & (np.abs(with_angle[:, -1]) < 1.0))
