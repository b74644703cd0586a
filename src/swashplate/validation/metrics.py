"""How good a prediction is: fit, RMS error and Theil's coefficient."""

from __future__ import annotations

import numpy as np

from swashplate.arrays import Array


def rms(rows: Array) -> Array:
    """Root mean square over the first axis."""
    return np.asarray(np.sqrt(np.mean(np.square(rows), axis=0)), dtype=np.float64)


def fit_percent(predicted: Array, truth: Array, at_start: Array) -> Array:
    """100 (1 - rms error / rms of the change since the start), per column.

    Holding the last value scores 0, a perfect prediction 100; below 0 it would have been better to predict nothing.
    """
    return 100.0 * (1.0 - rms(predicted - truth) / rms(truth - at_start))


def theil(predicted: Array, truth: Array, at_start: Array) -> Array:
    """Theil's inequality coefficient of the changes since the start: 0 perfect, 1 no better than the opposite sign.

    rms(error) / (rms(predicted change) + rms(true change)) (Theil 1966; Jategaonkar 2015, sec. 11.2.3).
    """
    return rms(predicted - truth) / (rms(predicted - at_start) + rms(truth - at_start))
