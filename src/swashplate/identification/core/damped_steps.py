"""Steps with Levenberg-Marquardt damping and bounds, from one point of a search to the next.

Levenberg (1944), Marquardt (1963); the information matrix stands for the Hessian (Jategaonkar 2015, sec. 4.6).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.core.parameter_row import Row

HOPELESS = 1e8
"""Damping at which a step is so short that no descent is left."""

NEWTON = 1e-3
"""Damping below which a step goes nearly all the way to the model's optimum."""

_STILL = 1e4
"""Damping at which a kinked entry hardly moves."""

REACH = {"parameter": 0.7, "noise": 0.7, "nuisance": 3.0, "initial": 10.0}
"""In scaled units: no entry of a group moves by more than this in one damped step."""

SEVERAL = 3
"""Small gains in a row that mean that nothing is left: one may only mean a short step."""


@dataclass(frozen=True)
class Point:
    """A row with its cost, gradient and information, the data's and the posterior's."""

    row: Array
    cost: float
    gradient: Array
    information: tuple[Array, Array]


class DampedSteps:
    """Damped steps of a search.

    Args:
        row: the row that is moved.
        cost: of a scaled row, with priors.
        together, around: as `scoring.minimise` has them.
    """

    def __init__(self, row: Row, cost: Callable[[Array], float], *, together: bool, around: bool) -> None:
        self._row, self._cost = row, cost
        self._together, self._around = together, around
        self._damping = self._caution = 1e-2
        self._small = 0

    def onward(self, at: Point) -> tuple[float, Array] | None:
        """The next row with its cost; None where nothing goes down."""
        descent = self._descent(at)
        if descent is None:
            return None
        self._damping, self._caution = max(descent[2] / 10.0, 1e-12), max(descent[3] / 10.0, 1e-12)
        return descent[:2]

    def settled(self, gained: float, tolerance: float) -> bool:
        """Whether the last step gained too little to go on for."""
        self._small = self._small + 1 if gained < tolerance else 0
        return bool(self._small) and (self._damping <= NEWTON or self._small == SEVERAL)

    def _descent(self, at: Point) -> tuple[float, Array, float, float] | None:
        """The next row with its cost, and the damping and caution that led there."""
        row, gradient, information = at.row, at.gradient, at.information
        damping, caution = self._damping, self._caution
        low, high = self._row.bounds()
        kinked = self._row.column("kinked") > 0.0
        reach = np.array([REACH[entry.group] for entry in self._row.entries])
        options = [(damping, caution)]
        while damping < HOPELESS:
            tried = []
            for each, careful in options:
                weights = np.where(kinked, max(each, careful), each)
                step = _step(row, gradient, information[1], weights, low, high)
                step = _within(reach, step, gradient, information[1], together=self._together)
                if self._around:
                    within = np.maximum(low - row, -reach), np.minimum(high - row, reach)
                    step = _held(within, step, gradient, information[1], weights)
                trial = np.clip(row + step, low, high)
                trial_cost = self._cost(trial)
                if np.isfinite(trial_cost) and trial_cost < at.cost:
                    tried.append((trial_cost, trial, each, careful))
            if tried:
                return min(tried, key=lambda one: one[0])
            # Either all went too far, or a kinked entry did, which then stands still while the others go on.
            if len(options) > 1:
                damping, caution = 10.0 * damping, min(100.0 * caution, _STILL)
            options = [(10.0 * damping, caution)]
            if kinked.any() and caution < _STILL:
                options.append((damping, min(100.0 * caution, _STILL)))
            else:
                damping *= 10.0
        return None


def _within(reach: Array, step: Array, gradient: Array, hessian: Array, *, together: bool) -> Array:
    """The step with no entry beyond its reach: cut entry by entry or shortened as a whole, whichever promises more.

    Cutting lets the others go on where one entry runs away, as the logarithm of a noise that is not there; along a
    narrow valley it leads out of the valley, and `together` forbids it.
    """
    shortened = step / max(1.0, float(np.max(np.abs(step) / reach)))
    if together:
        return shortened
    cut = np.clip(step, -reach, reach)
    return min(cut, shortened, key=lambda tried: float(gradient @ tried + 0.5 * tried @ hessian @ tried))


def _held(within: tuple[Array, Array], step: Array, gradient: Array, hessian: Array, damping: Array) -> Array:
    """The damped step with what wants to leave its reach held there and the others solved again, if that promises more.

    One pass after the other as for least squares with bounds (Lawson and Hanson 1974, ch. 23), never letting go.
    """
    low, high = within
    damped = hessian + np.diag(damping * (np.diag(hessian) + 1e-6))
    free, held = np.ones(step.size, dtype=bool), np.zeros(step.size)
    tried = held.copy()
    while free.any():
        tried = held.copy()
        tried[free] = np.linalg.solve(damped[np.ix_(free, free)], -(gradient + hessian @ held)[free])
        away = free & ((tried < low) | (tried > high))
        if not away.any():
            break
        held[away] = np.clip(tried, low, high)[away]
        free &= ~away
        tried = held
    return min(step, tried, key=lambda s: float(gradient @ s + 0.5 * s @ hessian @ s))


def _step(row: Array, gradient: Array, hessian: Array, damping: Array, low: Array, high: Array) -> Array:
    """A damped step that leaves out the entries which a bound stops."""
    free = np.ones(row.size, dtype=bool)
    step = np.zeros(row.size)
    damped = hessian + np.diag(damping * (np.diag(hessian) + 1e-6))
    for _ in range(3):
        step = np.zeros(row.size)
        step[free] = np.linalg.solve(damped[np.ix_(free, free)], -gradient[free])
        stopped = free & (((row <= low + 1e-12) & (step < 0)) | ((row >= high - 1e-12) & (step > 0)))
        if not stopped.any():
            break
        free &= ~stopped
    return step
