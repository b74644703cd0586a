"""Long series for a page: fewer points, every peak kept."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array

MAX_POINTS = 1500
"""Points that one line of a page may have: a least and a greatest for each column of a screen's plot, or nearly."""


def kept(values: Array, *, limit: int = MAX_POINTS) -> NDArray[np.int64]:
    """Indices of at most `limit` samples: the least and the greatest of every stretch, and both ends.

    A line through them looks the same at any width of fewer than limit / 2 pixels.

    Args:
        values: shape (n,); NaN mark gaps and stay.
        limit: at least 4.
    """
    n = values.size
    if n <= limit:
        return np.arange(n, dtype=np.int64)
    gaps = np.flatnonzero(~np.isfinite(values))
    stretches = max(1, (limit - 2 - gaps.size) // 2)
    width = -(-n // stretches)
    padded = np.full(width * -(-n // width), np.nan)
    padded[:n] = values
    rows = padded.reshape(-1, width)
    finite = np.isfinite(rows)
    lowest = np.where(finite, rows, np.inf).argmin(axis=1)
    highest = np.where(finite, rows, -np.inf).argmax(axis=1)
    first = np.arange(rows.shape[0]) * width
    drawn = finite.any(axis=1)
    return np.unique(np.concatenate([[0, n - 1], gaps, (first + lowest)[drawn], (first + highest)[drawn]])).astype(
        np.int64
    )


def joined(pieces: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Time and values of several pieces in one row, with a gap (NaN) between them so that no line bridges it."""
    times: list[Array] = []
    values: list[Array] = []
    for time, row in pieces:
        if times:
            middle = 0.5 * (times[-1][-1] + time[0])
            times.append(np.array([middle]))
            values.append(np.array([np.nan]))
        times.append(np.asarray(time, dtype=np.float64))
        values.append(np.asarray(row, dtype=np.float64))
    return np.concatenate(times), np.concatenate(values)
