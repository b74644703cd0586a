"""Steps of a search in which variances of noise are sought beside parameters.

A row holds the logarithm of a noise, on which its prior lies. The data see its square: what is small next to other
noise changes the cost in proportion to its variance, and a variance on its own is found by one step of scoring in
the variance, whatever the first guess. A quadratic of the logarithm knows neither; its steps go to and fro for as
long as a noise has far to go. So the information is taken in the variances here, and the priors stay as they are.

How far a step may go is a trust region (Conn, Gould and Toint 2000, ch. 6): a cost is ten to twenty times cheaper than
slopes, so a step that pays is tried larger at once. What the information lacks of the Hessian is learnt from the last
gradients by updates of Broyden, Fletcher, Goldfarb and Shanno (Nocedal and Wright 2006, ch. 6).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.core.damped_steps import REACH, SEVERAL, Point
from swashplate.identification.core.parameter_row import Row

_FARTHEST = {"parameter": 6.0, "noise": 6.0, "nuisance": 1.0, "initial": 1.0}
"""How many times its reach an entry of a group may move by in one step."""

_LARGER, _SMALLER = 3.0, 0.3
_LARGEST, _HOPELESS = 6.0, 1e-4
"""Sizes of the region: what a trial multiplies it by, the largest, and one in which no descent is left."""

_GOOD, _BAD = 0.75, 0.25
"""Shares of the promised gain above which the region grows, and below which it shrinks."""

_BORDER = 0.9
"""Share of the region beyond which a step was held back by it."""

_PAIRS, _CURVED = 4, 0.05
"""Steps that are learnt from, and the least share of the known curvature that one may show."""

_EXACT = 1e-6
"""In log-likelihood: a promise that is so little better is not looked for."""

Promise = Callable[[Array], tuple[float, Array, Array]]
"""From a step to the change of the cost that is expected, its gradient and its Hessian."""


class _Trial(NamedTuple):
    cost: float
    row: Array
    step: Array
    promised: float
    size: float
    care: float


class VarianceSteps:
    """Steps of a search of rows with variances.

    Args:
        row: the row that is moved.
        cost: of a scaled row, with priors.
    """

    def __init__(self, row: Row, cost: Callable[[Array], float]) -> None:
        self._row, self._cost = row, cost
        self._bounds = row.bounds()
        self._variance = row.column("variance") > 0.0
        self._kinked = row.column("kinked") > 0.0
        self._reach = np.array([REACH[entry.group] for entry in row.entries])
        self._farthest = self._reach * [_FARTHEST[entry.group] for entry in row.entries]
        self._size = self._care = 1.0  # of the region, and of the kinked entries' share of it
        self._pairs: list[tuple[Array, Array]] = []
        self._last: tuple[Point, _Trial] | None = None
        self._small = 0

    def onward(self, at: Point) -> tuple[float, Array] | None:
        """The next row with its cost; None where nothing goes down."""
        scored = self._scored(at)
        tried = [self._try(at, scored, self._size, self._care)]
        while tried[-1].cost < at.cost and tried[-1].size < _LARGEST and self._held(tried[-1]):
            tried.append(self._try(at, scored, min(_LARGER * tried[-1].size, _LARGEST), self._care))
            if tried[-1].cost >= tried[-2].cost:
                break
        if (learnt := self._learnt(at, scored)) is not None:
            tried.append(self._try(at, learnt, min(1.0, self._size), self._care))
        best, size, care = min(tried, key=_cost_of), self._size, self._care
        while best.cost >= at.cost and size > _HOPELESS:
            # Either all went too far, or a kinked entry did, which then stands nearly still while the others go on.
            smaller = _SMALLER * min(size, float(np.max(np.abs(tried[0].step) / self._reach)))
            tried = [self._try(at, scored, smaller, care)]
            if self._kinked.any() and care > 1e-3:
                tried.append(self._try(at, scored, size, 0.1 * care))
            best, size, care = min(tried, key=_cost_of), smaller, max(_SMALLER * care, 1e-3)
        if best.cost >= at.cost:
            return None
        self._size, self._care = best.size, min(1.0, _LARGER * best.care)
        share = (at.cost - best.cost) / max(-best.promised, 1e-12)
        if share > _GOOD:
            self._size = min(_LARGEST, 2.0 * self._size)
        elif share < _BAD:
            self._size = 0.5 * min(self._size, float(np.max(np.abs(best.step) / self._reach)))
        self._last = at, best
        return best.cost, best.row

    def settled(self, gained: float, tolerance: float) -> bool:
        """Whether the last step gained too little to go on for."""
        assert self._last is not None  # a step was made
        last = self._last[1]
        self._small = self._small + 1 if max(gained, -last.promised) < tolerance else 0
        return bool(self._small) and (not self._held(last) or self._small == SEVERAL)

    def _held(self, trial: _Trial) -> bool:
        """Whether the region held a step back."""
        return bool(np.max(np.abs(trial.step) / self._reach) > _BORDER * trial.size)

    def _try(self, at: Point, promise: Promise, size: float, care: float) -> _Trial:
        """The best promise within a region, and what it costs there."""
        low, high = self._bounds
        region = np.minimum(size * self._reach, self._farthest) * np.where(self._kinked, care, 1.0)
        step, promised = _least(promise, np.maximum(low - at.row, -region), np.minimum(high - at.row, region))
        row = np.clip(at.row + step, low, high)
        cost = self._cost(row)
        return _Trial(cost if np.isfinite(cost) else np.inf, row, step, promised, size, care)

    def _scored(self, at: Point) -> Promise:
        """The information in the variances, by steps of the row: half the relative change of a variance per step."""
        information, prior = at.information[0], at.information[1] - at.information[0]
        by_prior = self._row.prior(at.row)[1]
        pull = at.gradient - by_prior

        def promise(step: Array) -> tuple[float, Array, Array]:
            scaled, slope = step.copy(), np.ones_like(step)
            scaled[self._variance] = 0.5 * np.expm1(2.0 * step[self._variance])
            slope[self._variance] = 1.0 + 2.0 * scaled[self._variance]
            push = slope * (pull + information @ scaled)
            bent = np.where(self._variance, np.maximum(2.0 * push, 0.0), 0.0)
            hessian = information * np.outer(slope, slope) + prior + np.diag(bent)
            change = pull @ scaled + 0.5 * scaled @ information @ scaled + by_prior @ step + 0.5 * step @ prior @ step
            return float(change), push + by_prior + prior @ step, hessian

        return promise

    def _learnt(self, at: Point, scored: Promise) -> Promise | None:
        """A quadratic that gives the last steps' changes of the gradient; None where none was short enough to say."""
        hessian = scored(np.zeros_like(at.row))[2]
        if self._last is not None:
            before, _ = self._last
            step, turned = at.row - before.row, at.gradient - before.gradient
            curved = float(step @ turned) > _CURVED * float(step @ hessian @ step)
            if curved and np.max(np.abs(step) / self._reach) < 1.0:
                self._pairs = [*self._pairs, (step, turned)][-_PAIRS:]
        if not self._pairs:
            return None
        for step, turned in self._pairs:
            known = hessian @ step
            hessian = hessian - np.outer(known, known) / (step @ known) + np.outer(turned, turned) / (step @ turned)

        def promise(step: Array) -> tuple[float, Array, Array]:
            change = hessian @ step
            return float(at.gradient @ step + 0.5 * step @ change), at.gradient + change, hessian

        return promise


def _cost_of(trial: _Trial) -> float:
    return trial.cost


def _least(promise: Promise, low: Array, high: Array) -> tuple[Array, float]:
    """The step between bounds with the best promise, and the promise: Newton's method for those that are free."""
    step = np.zeros_like(low)
    least, gradient, hessian = promise(step)
    for _ in range(40):
        free = ~(((step <= low) & (gradient > 0.0)) | ((step >= high) & (gradient < 0.0)))
        way = np.zeros_like(step)
        try:
            way[free] = np.linalg.solve(hessian[np.ix_(free, free)], -gradient[free])
        except np.linalg.LinAlgError:
            break
        share, promised = 1.0, promise(np.clip(step + way, low, high))
        while not promised[0] < least and share > 1e-6:
            share *= 0.5
            promised = promise(np.clip(step + share * way, low, high))
        if not promised[0] < least:
            break
        gained, step = least - promised[0], np.clip(step + share * way, low, high)
        least, gradient, hessian = promised
        if gained < _EXACT:
            break
    return step, least
