"""Huber's loss on whitened residuals: quadratic in the middle, linear for the outliers that conditioning left."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np

from swashplate.arrays import Array

KNEE = 4.0
"""Whitened residuals beyond this many standard deviations count linearly (Huber 1964)."""


def huber(whitened: Array) -> float:
    """Sum of the loss."""
    return float(losses(whitened, np).sum())


def losses(whitened: Any, xp: ModuleType) -> Any:
    """The loss of each whitened residual, by the array functions `xp`."""
    size = xp.abs(whitened)
    return xp.where(size < KNEE, 0.5 * size**2, KNEE * size - 0.5 * KNEE**2)


def weights(whitened: Array) -> Array:
    """Derivative of the loss over the residual: 1 inside the knee, falling outside."""
    size = np.abs(whitened)
    return np.where(size < KNEE, 1.0, KNEE / np.maximum(size, KNEE))
