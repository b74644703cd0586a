"""Fisher scoring with Levenberg-Marquardt damping and bounds: one optimizer for every likelihood here.

Levenberg (1944), Marquardt (1963); the information matrix stands for the Hessian (Jategaonkar 2015, sec. 4.6).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.identification.core import stopping
from swashplate.identification.core.parameter_row import Row

Progress = Callable[[int, float], None]
"""Called after each iteration with its number and the cost."""


class Likelihood(Protocol):
    """A negative log-likelihood of a row, priors not included."""

    @property
    def row(self) -> Row: ...

    def cost(self, row: Array) -> float:
        """The negative log-likelihood; infinite where the model diverges."""
        ...

    def scores(self, row: Array) -> tuple[float, Array, Array]:
        """Cost, gradient and Fisher information."""
        ...

    def refresh(self, row: Array) -> None:
        """Take an accepted row for the weights that are held during an iteration."""
        ...


@dataclass(frozen=True)
class TracedCost:
    """A likelihood's cost as JAX differentiates and compiles it.

    Attributes:
        function: (plan, data, scaled row) to the cost, priors not included; one object for all rows and data.
        plan: all but numbers, hashable.
        data: arrays by name.
    """

    function: Callable[[Any, Any, Any], Any]
    plan: Any
    data: Any


@dataclass(frozen=True)
class Optimum:
    """Where the scoring ended.

    Attributes:
        row: the scaled row.
        cost: negative log-likelihood with priors.
        history: cost after each iteration.
        information: Fisher information of the data alone, scaled.
        converged: False where the iterations ran out, or a stop ended them (`stopping`).
        at_bound: names of entries that ended on a bound.
    """

    row: Array
    cost: float
    history: tuple[float, ...]
    information: Array
    converged: bool
    at_bound: tuple[str, ...]


_HOPELESS = 1e8
"""Damping at which a step is so short that no descent is left."""

_NEWTON = 1e-3
"""Damping below which a step goes nearly all the way to the model's optimum."""

_STILL = 1e4
"""Damping at which a kinked entry hardly moves."""

_LARGEST_STEP = {"parameter": 0.7, "noise": 0.7, "nuisance": 3.0, "initial": 10.0}
"""In scaled units: no entry of a group moves by more than this in one iteration."""


def minimise(
    likelihood: Likelihood,
    *,
    start: Array | None = None,
    iterations: int = 60,
    tolerance: float = 0.05,
    together: bool = False,
    around: bool = False,
    progress: Progress | None = None,
) -> Optimum:
    """The row of the highest posterior probability.

    Args:
        likelihood: what to minimise, with the row's priors added.
        start: scaled first guess (None: the entries' starts).
        iterations: at most this many.
        tolerance: a gain in log-likelihood that is too small to go on for.
        together: shorten a step that is too long always as a whole: half the iterations where many short shots make a
            narrow valley, many more where a noise is estimated or a whole record is simulated in one piece.
        around: where entries want to go too far, hold them at their reach and let the others go where that leads: for
            many parameters of which some hardly show, and would shorten every step.
        progress: told about every iteration.

    Raises:
        IdentificationError: where the first guess already diverges.
    """
    row_of = likelihood.row
    low, high = row_of.bounds()
    row = np.clip(row_of.starts() if start is None else np.array(start, dtype=np.float64), low, high)
    try:
        at = _point(likelihood, row)
    except stopping.INTERRUPTS as interrupt:  # an earlier search of this fit may have found something
        stopping.keep(interrupt)
        at = _point(likelihood, row)
    if not np.isfinite(at.cost):
        raise IdentificationError(
            "the model diverges from the flight at the first guess.",
            hint="Check units and signs with 'swash inspect', or start from a card that flies.",
        )
    history, damping, caution, converged = [at.cost], 1e-2, 1e-2, False
    small = 0
    for iteration in range(iterations):
        if stopping.asked():
            break
        try:
            found = _descent(likelihood, at, damping, caution, together=together, around=around)
            if found is None:
                converged = True  # no direction goes down any more
                break
            gained = at.cost - found[0]
            damping, caution = max(found[2] / 10.0, 1e-12), max(found[3] / 10.0, 1e-12)
            at = _point(likelihood, found[1])
            history.append(at.cost)
            stopping.counted()
            if progress is not None:
                progress(iteration + 1, at.cost)
        except stopping.INTERRUPTS as interrupt:
            stopping.keep(interrupt)
            likelihood.refresh(at.row)
            break
        # One small gain may only mean a short, damped step; three in a row mean that nothing is left.
        small = small + 1 if gained < tolerance else 0
        if small and (damping <= _NEWTON or small == 3):
            converged = True
            break
    touching = (at.row <= low + 1e-9) | (at.row >= high - 1e-9)
    at_bound = tuple(name for name, touch in zip(row_of.names, touching, strict=True) if touch)
    return Optimum(at.row, at.cost, tuple(history), at.information[0], converged, at_bound)


@dataclass(frozen=True)
class _Point:
    """A row with its cost, gradient and information, the data's and the posterior's."""

    row: Array
    cost: float
    gradient: Array
    information: tuple[Array, Array]


def _point(likelihood: Likelihood, row: Array) -> _Point:
    likelihood.refresh(row)
    return _Point(row, *_posterior(likelihood, row))


def _descent(
    likelihood: Likelihood, at: _Point, damping: float, caution: float, *, together: bool, around: bool
) -> tuple[float, Array, float, float] | None:
    """The next row with its cost, and the damping and caution that led there; None where nothing goes down."""
    row_of, row, gradient, information = likelihood.row, at.row, at.gradient, at.information
    low, high = row_of.bounds()
    kinked = row_of.column("kinked") > 0.0
    reach = np.array([_LARGEST_STEP[entry.group] for entry in row_of.entries])
    options = [(damping, caution)]
    while damping < _HOPELESS:
        tried = []
        for each, careful in options:
            weights = np.where(kinked, max(each, careful), each)
            step = _step(row, gradient, information[1], weights, low, high)
            step = _within(reach, step, gradient, information[1], together=together)
            if around:
                within = np.maximum(low - row, -reach), np.minimum(high - row, reach)
                step = _held(within, step, gradient, information[1], weights)
            trial = np.clip(row + step, low, high)
            trial_cost = likelihood.cost(trial) + row_of.prior(trial)[0]
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


def _posterior(likelihood: Likelihood, row: Array) -> tuple[float, Array, tuple[Array, Array]]:
    cost, gradient, information = likelihood.scores(row)
    prior_cost, prior_gradient, prior_information = likelihood.row.prior(row)
    return cost + prior_cost, gradient + prior_gradient, (information, information + prior_information)


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
