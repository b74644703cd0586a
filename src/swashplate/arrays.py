"""Names of array types that signatures use; shapes stand in the docstrings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Values = float | Array | Complex
"""One number, or rows of them; imaginary parts are slopes."""

_SAME = 1e-6


def largest_first(sizes: Array) -> NDArray[np.int64]:
    """Places of `sizes` (n,), none negative, from the largest down; what is equal but for rounding keeps its order.

    Rounding differs from processor to processor: by `argsort` alone, states that share a mode equally would change
    places from machine to machine.
    """
    relative = sizes / max(float(np.max(sizes, initial=0.0)), np.finfo(float).tiny)
    return np.argsort(-np.round(relative / _SAME), kind="stable")


def lengthened(rows: Array, length: int) -> Array:
    """Rows (n, ...) with the last one repeated up to `length` of them."""
    return np.concatenate([rows, np.repeat(rows[-1:], length - len(rows), axis=0)])


IMAGINARY = 1e-30
"""Step of a slope by complex numbers, exact to rounding (Squire and Trapp 1998)."""
