"""Normal draws within bounds: numbers that data cannot tell from an estimate."""

from __future__ import annotations

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError

_TRIES = 100


def normal_within(
    mean: Array, covariance: Array, low: Array, high: Array, *, count: int, seed: int, where: str
) -> Array:
    """Normal draws, shape (count, n); one outside the bounds is drawn again.

    Args:
        mean, low, high: shape (n,).
        covariance: shape (n, n).
        count, seed: of the draws.
        where: named in the message.

    Raises:
        IdentificationError: where the distribution lies mostly outside the bounds.
    """
    random = np.random.default_rng(seed)
    scale = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    drawn = np.empty((0, len(mean)))
    for _ in range(_TRIES):
        tried = mean + random.standard_normal((count, len(mean))) @ root.T
        drawn = np.concatenate([drawn, tried[np.all((tried >= low) & (tried <= high), axis=1)]])[:count]
        if len(drawn) == count:
            return drawn
    raise IdentificationError(
        f"only {len(drawn)} of {count * _TRIES} draws lie within the bounds of physics.",
        where=where,
        hint="The fit knows too little; fix parameters or add data.",
    )
