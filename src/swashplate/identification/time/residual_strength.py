"""How much of a residual is kept: as much as blocks of the flights that are left out speak for.

Coefficients are held towards zero by a ridge (Hoerl and Kennard 1970). Its strength is the one that gains most on
blocks that were not learnt from, and nothing is kept where that gain may be chance (Student's t, 97.5 %). Nothing else
is looked at. Physics may stand before the coefficients in a row: it moves with and without them, with its own priors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError

STRENGTHS = np.geomspace(1e5, 1e-3, 33)
"""Of the ridge, from strong to weak."""

BLOCK = 6.0
"""Seconds of a block that is left out, at least."""

FEWEST = 4
"""Blocks below which nothing can be left out to choose by."""

_SURE = 0.975
"""Quantile of Student's t that the gain on blocks left out must exceed, in standard errors: a few blocks tell these
badly."""

_FLOOR = 1e-9
"""Of each parameter's information, what is added to it: blocks may leave out the one that tells a combination."""


def enough_blocks(count: int, where: str, *, after: float = 0.0) -> None:
    """Refuses records that make too few blocks.

    Raises:
        IdentificationError: for fewer than `FEWEST`.
    """
    if count < FEWEST:
        later = f" after their first {after:g} s, which tell a flight's constants" if after else ""
        raise IdentificationError(
            f"the flights make {count} blocks of {BLOCK:g} s{later}, a residual needs {FEWEST}: without blocks to "
            "leave out, nothing says how much of it is chance.",
            where=where,
            channel="residual",
            hint="Give longer flights, or leave --residual away.",
        )


class Physics(NamedTuple):
    """Priors of the parameters that stand before the coefficients: their pull where these stand, and information."""

    pull: Array
    information: Array


ALONE = Physics(np.zeros(0), np.zeros((0, 0)))
"""No physics moves."""


@dataclass(frozen=True)
class LeftOutBlock:
    """A block's cost by physics and scaled coefficients, to second order about some.

    Attributes:
        start: cost without a residual.
        at: where it is told (k,). cost, gradient, information: there.
    """

    start: float
    at: Array
    cost: float
    gradient: Array
    information: Array

    def gain(self, coefficients: Array) -> float:
        """Log-likelihood that they gain."""
        away = coefficients - self.at
        return self.start - self.cost - float(self.gradient @ away + 0.5 * away @ self.information @ away)


def shrunk(told: Sequence[LeftOutBlock], strength: float, physics: Physics = ALONE) -> tuple[Array, Array]:
    """Physics and scaled coefficients (k,) and their covariance (k, k) from some blocks; infinite: physics alone."""
    information = sum((block.information for block in told), start=np.zeros_like(told[0].information))
    slope = sum((block.gradient - block.information @ block.at for block in told), start=np.zeros(len(information)))
    k, n = len(information), len(physics.pull)
    slope[:n] += physics.pull
    held = np.diag(np.concatenate([_FLOOR * np.diag(information)[:n], np.full(k - n, strength)]))
    held[:n, :n] += physics.information
    free = k if np.isfinite(strength) else n
    coefficients, covariance = np.zeros(k), np.zeros((k, k))
    covariance[:free, :free] = np.linalg.inv(information[:free, :free] + held[:free, :free])
    coefficients[:free] = -covariance[:free, :free] @ slope[:free]
    return coefficients, covariance


def chosen_strength(told: Sequence[LeftOutBlock], physics: Physics = ALONE) -> tuple[float, float, float]:
    """Strength by blocks left out, what they gain, and its standard error; infinite where that is nothing."""
    from scipy.stats import t as student

    def gains(strength: float) -> Array:
        learnt = [shrunk([*told[:i], *told[i + 1 :]], strength, physics)[0] for i in range(len(told))]
        return np.array([block.gain(coefficients) for block, coefficients in zip(told, learnt, strict=True)])

    alone = gains(np.inf) if len(physics.pull) else np.zeros(len(told))
    gained = np.array([gains(strength) - alone for strength in STRENGTHS])
    total, error = gained.sum(axis=1), np.std(gained, axis=1, ddof=1) * np.sqrt(len(told))
    best = int(np.argmax(total))
    if total[best] <= student.ppf(_SURE, len(told) - 1) * error[best]:
        return np.inf, float(total[best]), float(error[best])
    return float(STRENGTHS[best]), float(total[best]), float(error[best])
