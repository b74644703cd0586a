"""Polynomials fitted to the samples around each one (Savitzky and Golay 1964, Analytical Chemistry 36, 1627-1639)."""

from __future__ import annotations

import math

import numpy as np

from swashplate.arrays import Array


def local_polynomials(values: Array, window: int, order: int, *, slope: float | None = None) -> Array:
    """Values (n, ...) smoothed, or their slopes; near the ends by the first and the last whole window.

    Args:
        window: samples, an odd number of at most n.
        order: of the polynomials.
        slope: seconds between samples, for slopes; None: the values themselves.
    """
    derivative, half = int(slope is not None), window // 2
    places = np.arange(-half, half + 1, dtype=np.float64)
    fitted = np.linalg.pinv(np.vander(places / max(half, 1), order + 1, increasing=True))
    powers = np.arange(order + 1)
    factors = np.array([math.perm(k, derivative) for k in powers], dtype=np.float64)
    at = (places / max(half, 1))[:, None] ** np.maximum(powers - derivative, 0) * factors
    weights = at @ fitted / (max(half, 1) * (1.0 if slope is None else slope)) ** derivative
    flat = values.reshape(len(values), -1)
    smooth = np.empty_like(flat)
    for column in range(flat.shape[1]):
        smooth[half : len(flat) - half, column] = np.convolve(flat[:, column], weights[half, ::-1], mode="valid")
    smooth[:half] = weights[:half] @ flat[:window]
    smooth[len(flat) - half :] = weights[half + 1 :] @ flat[len(flat) - window :]
    return smooth.reshape(values.shape)
