"""How well a structure answers for its numbers: misfit over the measurement's scatter, and a price for each number."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.frequency.response_cost import Target, log_error
from swashplate.identification.frequency.state_space_search import answers
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.structure_parts import PARTS

FLOOR = 0.03
"""Relative error that every response is granted: 0.26 dB or 1.7 degrees of windows, filters and sampling."""

_LINEAR = 5.0
"""Scatters from which a misfit counts linearly (Huber 1964): a notch is no wrong structure."""

_TOGETHER = 2.0
"""Times that a misfit is counted, because neighbouring lines err together."""


def scatter(target: Target) -> Array:
    """The relative error of a measured response that counts as one, shape (n,)."""
    return np.asarray(np.sqrt((0.0 if target.error is None else target.error) ** 2 + FLOOR**2))


def robust(times: Array) -> Array:
    """Weights of errors that are so many scatters large: one up to `_LINEAR`, beyond it what Huber gives them."""
    return np.asarray(np.minimum(1.0, _LINEAR / np.maximum(times, 1e-300)))


def squared_misfit(model: StateSpaceModel, targets: Sequence[Target]) -> float:
    """Sum over all points of the squared misfit over the measurement's scatter; two degrees of freedom a point."""
    total = 0.0
    for t, h in zip(targets, answers(model, targets), strict=True):
        times = np.abs(log_error(h, t.measured)) / scatter(t)
        if not np.all(np.isfinite(times)):
            return float("inf")
        total += float(np.sum(np.where(times < _LINEAR, times**2, _LINEAR * (2.0 * times - _LINEAR))))
    return total


def spread_of(misfit: float, points: int, parameters: int) -> float:
    """Variance of the scatter over what it should be, as a fit leaves it; never below one.

    Args:
        misfit: of the fit. points: that were fitted. parameters: that were free.
    """
    return max(1.0, misfit / max(2.0 * points - parameters, 1.0))


HIDDEN = 10.0
"""Points that a part with states of its own costs besides its numbers: it can take many shapes, of which the best was
taken, and what is built into an aircraft must not be invented."""


def score(misfit: float, parameters: int, *, hidden: int, spread: float, points: int) -> float:
    """Bayes' information criterion with overdispersion (Schwarz 1978; Burnham and Anderson 2002, sec. 2.5).

    Args:
        misfit: `squared_misfit`. parameters: that were fitted. hidden: parts with states of their own (`hidden`).
        spread: variance of the scatter over what it should be, 1 and more. points: that were fitted.
    """
    return misfit / (_TOGETHER * spread) + parameters * np.log(2.0 * points / _TOGETHER) + HIDDEN * hidden


def hidden(parts: Iterable[str]) -> int:
    """How many of these parts have states that are not the body's."""
    return sum(bool(PARTS[name].states) and not PARTS[name].core for name in parts if name in PARTS)
