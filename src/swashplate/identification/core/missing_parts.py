"""What a model may lack beside its free numbers: how far that shifts these, and a bound that holds it.

Parts that the model leaves out are set free for one Gauss-Newton step (omitted variables: Greene 2018, sec. 4.3.2). The
numbers keep their values. Their bound becomes that of the larger model, and the square of the step is added, for the
mean square about the numbers as they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.identification.core import accuracy

SEEN = 3.0
"""Standard deviations beyond which the errors show a part."""


@dataclass(frozen=True)
class MissingParts:
    """Parts that a model leaves out, each in units of the size that it may have.

    Attributes:
        names: of the q parts, in words.
        slopes: per record, of the whitened errors by each part (q, n, outputs).
    """

    names: tuple[str, ...]
    slopes: tuple[Array, ...]


@dataclass(frozen=True)
class Shifts:
    """What one step with the missing parts free does.

    Attributes:
        names: of the q parts.
        covariance: of the scaled row with the parts free (p, p), for coloured errors.
        by_part: change of the scaled row by each part (p, q).
        significance: each part in its own standard deviations (q,), without what was assumed of its size.
    """

    names: tuple[str, ...]
    covariance: Array
    by_part: Array
    significance: Array

    @property
    def mean_square(self) -> Array:
        """About the row as it is (p, p)."""
        shift = self.by_part.sum(axis=1)
        return np.asarray(self.covariance + np.outer(shift, shift))

    def warnings(self, names: Sequence[str], places: NDArray[np.intp], variance: Array) -> tuple[str, ...]:
        """Which parts the errors show, where they shift a number by more than its standard deviation.

        Args:
            names, places: of the model's parameters, and where they stand in the row.
            variance: of these without the parts, scaled.
        """
        named = []
        shifts = self.by_part[places] / np.sqrt(np.maximum(variance, 1e-300))[:, None]
        for part, size, by in zip(self.names, self.significance, shifts.T, strict=True):
            far = [f"{name} by {by[i]:+.1f}" for i, name in enumerate(names) if abs(by[i]) > 1.0]
            if abs(size) > SEEN and far:
                named.append(f"{part} ({abs(size):.0f} standard deviations): it would move {', '.join(far)}")
        if not named:
            return ()
        return (
            f"the errors show what the model lacks: {'; '.join(named)} standard deviations. The bounds hold that, the "
            "values do not: give the model that part and fit again.",
        )


def shifts_by(
    parts: MissingParts, bound: Array, rest: Array, white: Sequence[Array], sensitivities: Sequence[Array], *, lags: int
) -> Shifts:
    """One step from an optimum with missing parts free, each about none with the size that it may have.

    Args:
        parts: what is missing.
        bound, rest, white, sensitivities, lags: at the optimum, as of `accuracy.corrected_covariance`.
    """
    p, q = len(bound), len(parts.names)
    every = [np.concatenate(pair) for pair in zip(sensitivities, parts.slopes, strict=True)]
    information, pull = np.zeros((p + q, q)), np.zeros(q)
    for slopes, errors in zip(every, white, strict=True):
        flat = slopes.reshape(p + q, -1)
        information += flat @ flat[p:].T
        pull += flat[p:] @ errors.ravel()
    aside = bound @ information[:p]  # of the row, by each part
    alone = information[p:] - information[:p].T @ aside
    inner = np.asarray(np.linalg.inv(alone + np.eye(q)), dtype=np.float64)
    wide, prior = np.zeros((p + q, p + q)), np.zeros((p + q, p + q))
    wide[:p, :p], wide[:p, p:], wide[p:, p:] = bound + aside @ inner @ aside.T, -aside @ inner, inner
    wide[p:, :p] = wide[:p, p:].T
    prior[:p, :p], prior[p:, p:] = rest, np.eye(q)
    coloured = accuracy.corrected_covariance(wide, prior, white, every, lags=lags)
    covariance = accuracy.covering(coloured, accuracy.covariance_by_octaves(wide, prior, white, every))
    scatter = coloured[p:, p:] - inner @ inner.T  # of the step, without the parts' own assumed size
    sizes = -inner @ pull
    significance = sizes / np.sqrt(np.maximum(np.diag(scatter), 1e-300))
    return Shifts(parts.names, covariance[:p, :p], -aside * sizes, np.asarray(significance))
