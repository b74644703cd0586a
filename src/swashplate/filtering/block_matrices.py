"""Matrices made of rows and of blocks, with any axes in front."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from swashplate.arrays import Array


def diagonal(rows: Array) -> Array:
    """Diagonal matrices of rows (..., n)."""
    return rows[..., None] * np.eye(rows.shape[-1])


def blocks(rows: Sequence[Sequence[Array | None]], sizes: tuple[int, ...]) -> Array:
    """Matrices of blocks of these sizes, with any axes in front; None is zeros."""
    front = np.broadcast_shapes(*(block.shape[:-2] for row in rows for block in row if block is not None))
    whole = np.zeros((*front, sum(sizes), sum(sizes)))
    ends = np.concatenate([[0], np.cumsum(sizes)])
    for i, row in enumerate(rows):
        for j, block in enumerate(row):
            if block is not None:
                whole[..., ends[i] : ends[i + 1], ends[j] : ends[j + 1]] = block
    return whole
