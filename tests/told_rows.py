"""What a page of `swash live` tells of a flight: a CoaX that hovers and turns slowly."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

import swashplate as sp


@lru_cache
def _hover() -> tuple[np.ndarray, int]:
    vehicle = sp.vehicle("coax")
    trim = sp.trim(vehicle)
    return np.concatenate([trim.state, trim.inputs, [0.0, 0.0, 0.0, 12.0]]), vehicle.state_names.index("psi")


def rows(count: int) -> np.ndarray:
    """So many periods, shape (count, states and inputs and surroundings)."""
    row, psi = _hover()
    table = np.tile(row, (count, 1))
    table[:, psi] = np.linspace(0.0, 0.5, count)
    return table


def told(version: int, first: int, count: int) -> bytes:
    """The same as a page says it, numbered from `first`."""
    numbered = np.column_stack([np.full(count, version), np.arange(first, first + count), rows(count)])
    return numbered.astype("<f8").tobytes()
