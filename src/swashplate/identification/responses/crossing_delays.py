"""The delays at which a loop's frequency response says that it begins to grow: what every delay margin is read from."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from swashplate.arrays import Array


def crossing_delays(frequencies: ArrayLike, loop: ArrayLike) -> Array:
    """Delays of all opened inputs together at which an eigenvalue of L e^(-jwT) is -1 [s], ascending.

    MacFarlane and Postlethwaite (1977); of one loop phase margin over crossover, at every crossover. Good below a fifth
    of Nyquist's frequency, where a sampled loop with a delay is the loop times e^(-jwT).

    Args:
        frequencies: [rad/s], shape (n,), rising.
        loop: shape (n, m, m).
    """
    w, values = np.asarray(frequencies, dtype=np.float64), np.linalg.eigvals(np.asarray(loop))
    order = np.argsort(np.abs(values), axis=1)
    values = np.take_along_axis(values, order, axis=1)
    sizes = np.log(np.abs(values) + 1e-300)
    turned = np.mod(np.pi + np.angle(values), 2.0 * np.pi)
    delays = []
    for size, phase in zip(sizes.T, turned.T, strict=True):
        for i in np.flatnonzero(np.diff(np.sign(size))):
            share = size[i] / (size[i] - size[i + 1])
            at = w[i] * (w[i + 1] / w[i]) ** share
            ends = np.unwrap(phase[i : i + 2])
            delays.append(float(np.mod(ends[0] + share * (ends[1] - ends[0]), 2.0 * np.pi) / at))
    return np.sort(np.array(delays))
