"""Swashplates: how servos move collective and cyclic, and back.

A servo's travel is -1 to 1. Every type is a matrix of one row a servo with its shares of collective, roll and pitch;
the vehicle gets the least-squares inverse. Shares follow ArduPilot's numbering of servos (H_SW_TYPE in its parameter
reference): left, right, elevator; roll right and nose up positive.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import LinkError

_HALF = 2.0**-0.5
_FIXED = {
    "H1": ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)),
    "H3-140": ((1.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 0.0, -1.0)),
    "H4-90": ((1.0, 1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 0.0, -1.0), (1.0, 0.0, 1.0)),
    "H4-45": ((1.0, _HALF, _HALF), (1.0, -_HALF, _HALF), (1.0, _HALF, -_HALF), (1.0, -_HALF, -_HALF)),
}
_H3_120 = (-60.0, 60.0, 180.0)
TYPES = ("H1", "H3", "H3-120", "H3-140", "H4-90", "H4-45", "custom")


def shares(
    kind: str,
    *,
    angles: Sequence[float] | None = None,
    phase: float = 0.0,
    matrix: Sequence[Sequence[float]] | None = None,
    where: str,
) -> Array:
    """Shares of collective, roll and pitch in each servo, shape (n_servos, 3).

    Args:
        kind: one of `TYPES`.
        angles: of the servos from the nose, clockwise from above [deg], for "H3".
        phase: by which the swashplate is turned against the servos [deg], for "H3" and "H3-120".
        matrix: the shares themselves, for "custom".
        where: the file, for messages.

    Raises:
        LinkError: for an unknown type, or shares that do not tell the three apart.
    """
    if kind in _FIXED:
        rows = np.array(_FIXED[kind])
    elif kind in ("H3", "H3-120"):
        placed = np.radians(np.array(_H3_120 if kind == "H3-120" else angles or ()) - phase)
        if placed.size < 3:
            raise LinkError("needs the angles of three servos or more.", where=where, channel="swashplate.angles")
        rows = np.column_stack([np.ones(placed.size), -np.sin(placed), np.cos(placed)])
    elif kind == "custom":
        rows = np.array(matrix if matrix is not None else [], dtype=np.float64)
        if rows.ndim != 2 or rows.shape[1] != 3:
            raise LinkError(
                "expected one row [collective, roll, pitch] for each servo.", where=where, channel="swashplate.matrix"
            )
    else:
        raise LinkError(f"is '{kind}', expected one of {', '.join(TYPES)}.", where=where, channel="swashplate.type")
    if not np.isfinite(rows).all() or np.linalg.matrix_rank(rows, tol=1e-6) < 3:
        raise LinkError("the servos do not tell collective, roll and pitch apart.", where=where, channel="swashplate")
    return rows


def unmixed(rows: Array) -> Array:
    """The inverse of `shares`: collective, roll and pitch from the servos, shape (3, n_servos)."""
    return np.asarray(np.linalg.pinv(rows), dtype=np.float64)
