"""Matrices made of rows and of blocks, with any axes in front, for NumPy and JAX."""

from __future__ import annotations

from typing import Any

import numpy as np


def diagonal(rows: Any, xp: Any) -> Any:
    """Diagonal matrices of rows (..., n)."""
    return rows[..., None] * xp.eye(rows.shape[-1])


def blocks(rows: Any, sizes: tuple[int, ...], xp: Any) -> Any:
    """Matrices of blocks of these sizes, with any axes in front; None is zeros."""
    front = np.broadcast_shapes(*(block.shape[:-2] for row in rows for block in row if block is not None))
    whole = [
        xp.concatenate(
            [
                xp.zeros((*front, high, wide)) if block is None else xp.broadcast_to(block, (*front, high, wide))
                for block, wide in zip(row, sizes, strict=True)
            ],
            axis=-1,
        )
        for row, high in zip(rows, sizes, strict=True)
    ]
    return xp.concatenate(whole, axis=-2)
