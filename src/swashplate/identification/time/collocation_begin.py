"""Where a fit by collocation begins: first guesses of its noise, and steps that stay within their bounds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.core.parameter_row import Entry
from swashplate.identification.core.records import Record

_LEAST, _MOST = 1e-4, 1e3
"""Noise in sizes of what it disturbs: below the least it is none (and the factor would lose its digits)."""


def noise_entry(name: str, start: float, size: float) -> Entry:
    """A standard deviation of noise [the unit of `size`] as the row keeps it, by its logarithm."""
    low, high = np.log(_LEAST * size), np.log(_MOST * size)
    return Entry(
        name, "noise", float(np.clip(np.log(start), low, high)), 1.0, float(low), float(high), logarithmic=True
    )


def rough_noise(records: Sequence[Record]) -> Array:
    """What third differences say of the noise of each output: 20 variances if white, and little of smooth motion."""
    third = np.concatenate([np.diff(record.outputs, n=3, axis=0) for record in records])
    return np.asarray(np.sqrt(np.mean(third**2, axis=0) / 20.0) + 1e-300)


def step_within(matrix: Array, pull: Array, low: Array, high: Array) -> Array:
    """The solution of a linear system with what would leave its bounds held there, and the rest solved again."""
    held, step = np.zeros(pull.size, dtype=bool), np.zeros(pull.size)
    for _ in range(pull.size + 1):
        free = ~held
        right = pull[free] - matrix[np.ix_(free, held)] @ step[held]
        scale = np.sqrt(np.diag(matrix)[free])
        step[free] = np.linalg.lstsq(matrix[np.ix_(free, free)] / np.outer(scale, scale), right / scale)[0] / scale
        away = free & ((step < low) | (step > high))
        if not away.any():
            break
        step[away] = np.clip(step, low, high)[away]
        held |= away
    return np.clip(step, low, high)
