"""How much power each line of each axis is to have, so that the lines together tell most.

Information is linear in the powers and the logarithm of its determinant is concave, so the best powers are found by
multiplying each by what it tells more than the mean (Titterington 1976; Yu 2010), each axis within what it may have.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array

ROUNDS = 300


def best_powers(
    information: Array,
    owner: NDArray[np.intp],
    allowed: Array,
    known: Array,
    *,
    criterion: str,
    worst: bool,
) -> Array:
    """Mean squares of the lines, (lines,).

    Args:
        information: of each line per unit of power, for each draw of the prior, (draws, lines, q, q), scaled.
        owner: axis of each line (lines,). allowed: power of each axis (axes,).
        known: information beforehand (q, q), scaled.
        criterion: "D" (least volume) or "A" (least sum of variances) of all but the last number, which is a nuisance.
        worst: True for the best in the worst draw, False on average.
    """
    axes = len(allowed)
    count = np.bincount(owner, minlength=axes)
    power = (allowed / np.maximum(count, 1))[owner]
    weights = np.full(len(information), 1.0 / len(information))
    for _ in range(ROUNDS):
        gains, values = [], []
        for lines in information:
            total = known + np.einsum("l,lij->ij", power, lines)
            inverse = np.linalg.pinv(total, hermitian=True)
            kept = inverse[:-1, :-1]
            # By the inverse's block: the parameters alone, the nuisance marginalised.
            if criterion == "A":
                total_variance = np.trace(kept)
                middle = inverse[:, :-1] @ inverse[:-1, :] / total_variance
                values.append(-np.log(total_variance))
            else:
                middle = inverse[:, :-1] @ np.linalg.pinv(kept, hermitian=True) @ inverse[:-1, :]
                values.append(-np.linalg.slogdet(kept)[1])
            gains.append(np.einsum("ij,lij->l", middle, lines))
        if worst:
            weights *= np.exp(-0.3 * (np.array(values) - np.min(values)))
            weights /= weights.sum()
        gain = np.maximum(weights @ np.array(gains), 0.0)
        for axis in range(axes):
            own = owner == axis
            moved = power[own] * np.sqrt(gain[own])  # the square root converges for A too, and hardly slower for D
            total_moved = moved.sum()
            if total_moved > 0.0:
                power[own] = allowed[axis] * moved / total_moved
    return np.asarray(power)
