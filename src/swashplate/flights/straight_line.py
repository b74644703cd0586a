"""Signals without their straight line."""

from __future__ import annotations

import numpy as np

from swashplate.arrays import Array


def detrended(values: Array) -> Array:
    """Values less the straight line that fits them best, along the first axis; shape as given, (n,) or (n, m)."""
    ramp = np.linspace(-1.0, 1.0, len(values)) if len(values) > 1 else np.zeros(len(values))
    slope = (ramp @ values) / max(float(ramp @ ramp), 1e-300)
    line = np.multiply.outer(ramp, slope) + np.mean(values, axis=0)
    return np.asarray(values - line, dtype=np.float64)
