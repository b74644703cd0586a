"""Fisher scoring with bounds: one solver for every likelihood here.

Delays make valleys: where another delay promises about as much, the search begins again from there.

A command that comes in waves fits nearly as well half a wave too early or too late, and the other parameters settle
around whichever delay the search met first. One cost at each of some delays tells which of them are worth a search.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.identification.core import stopping
from swashplate.identification.core.damped_steps import DampedSteps, Point
from swashplate.identification.core.parameter_row import Row
from swashplate.identification.core.variance_steps import VarianceSteps

_FARTHEST, _STEP, _APART = 3.0, 0.2, 0.6
"""The delays tried, and how far from the one found, in scaled units of 50 ms."""

_PROMISING = 50.0
"""Log-units that another delay may lie above the optimum before anything else has settled around it."""


def minimise_over_valleys(likelihood: Sought, solver: Solver | None = None) -> Optimum:
    """`minimise`, and again from the best other value of every kinked entry where that is promising.

    Returns:
        The lowest optimum; its history is that of the search that led to it, after those that it beat.
    """
    solver = solver or Solver()
    best = minimise(likelihood, solver)
    for place in np.flatnonzero(likelihood.row.column("kinked") > 0.0):
        start = None if stopping.asked() else _elsewhere(likelihood, best, int(place))
        if start is None:
            continue
        other = minimise(likelihood, solver.after(len(best.history)), start=start)
        if other.cost < best.cost:
            best = replace(other, history=best.history + other.history)
    likelihood.refresh(best.row)
    return best


def _elsewhere(likelihood: Sought, best: Optimum, place: int) -> Array | None:
    """The optimum with another value of one entry, None where no other promises anything."""
    low, high = (bound[place] for bound in likelihood.row.bounds())
    values = np.arange(max(low, -_FARTHEST), min(high, _FARTHEST) + 1e-9, _STEP)
    rows = []
    for value in values[np.abs(values - best.row[place]) >= _APART]:
        row = best.row.copy()
        row[place] = value
        rows.append((likelihood.cost(row) + likelihood.row.prior(row)[0], row))
    cost, row = min(rows, key=lambda one: one[0], default=(np.inf, best.row))
    return row if cost < best.cost + _PROMISING else None


Progress = Callable[[int, float], None]
"""Called after each iteration with its number and the cost."""


class Sought(Protocol):
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


class Steps(Protocol):
    """From one point of a search to the next."""

    def onward(self, at: Point) -> tuple[float, Array] | None:
        """The next row with its cost; None where nothing goes down."""
        ...

    def settled(self, gained: float, tolerance: float) -> bool:
        """Whether the last step gained too little to go on for."""
        ...


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


@dataclass(frozen=True)
class Solver:
    """How the row of the highest posterior probability is searched.

    Attributes:
        iterations: at most this many.
        tolerance: a gain in log-likelihood that is too small to go on for.
        together: shorten a step that is too long always as a whole: half the iterations where many short shots make a
            narrow valley, many more where a noise is estimated or a whole record is simulated in one piece.
        around: where entries want to go too far, hold them at their reach and let the others go where that leads: for
            many parameters of which some hardly show, and would shorten every step. Like `together` of damped steps.
        progress: told about every iteration.
    """

    iterations: int = 60
    tolerance: float = 0.05
    together: bool = False
    around: bool = False
    progress: Progress | None = None

    def after(self, done: int) -> Solver:
        """The same, which counts its iterations on from so many."""
        report = self.progress
        return replace(self, progress=report and (lambda iteration, cost: report(done + iteration, cost)))

    def steps(self, row: Row, cost: Callable[[Array], float]) -> Steps:
        """How far each step goes: `variance_steps` where variances are among the entries, else `damped_steps`."""
        if any(entry.variance for entry in row.entries):
            return VarianceSteps(row, cost)
        return DampedSteps(row, cost, together=self.together, around=self.around)


def minimise(likelihood: Sought, solver: Solver | None = None, *, start: Array | None = None) -> Optimum:
    """The row of the highest posterior probability.

    Args:
        likelihood: what to minimise, with the row's priors added.
        solver: how; None: as usual.
        start: scaled first guess (None: the entries' starts).

    Raises:
        IdentificationError: where the first guess already diverges.
    """
    solver = solver or Solver()
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
    history, converged = [at.cost], False

    def cost(tried: Array) -> float:
        return likelihood.cost(tried) + row_of.prior(tried)[0]

    steps = solver.steps(row_of, cost)
    for iteration in range(solver.iterations):
        if stopping.asked():
            break
        try:
            onward = steps.onward(at)
            if onward is None:
                converged = True  # no direction goes down any more
                break
            gained = at.cost - onward[0]
            at = _point(likelihood, onward[1])
            history.append(at.cost)
            stopping.counted()
            if solver.progress is not None:
                solver.progress(iteration + 1, at.cost)
        except stopping.INTERRUPTS as interrupt:
            stopping.keep(interrupt)
            likelihood.refresh(at.row)
            break
        if steps.settled(gained, solver.tolerance):
            converged = True
            break
    touching = (at.row <= low + 1e-9) | (at.row >= high - 1e-9)
    at_bound = tuple(name for name, touch in zip(row_of.names, touching, strict=True) if touch)
    return Optimum(at.row, at.cost, tuple(history), at.information[0], converged, at_bound)


def _point(likelihood: Sought, row: Array) -> Point:
    likelihood.refresh(row)
    return Point(row, *_posterior(likelihood, row))


def _posterior(likelihood: Sought, row: Array) -> tuple[float, Array, tuple[Array, Array]]:
    cost, gradient, information = likelihood.scores(row)
    prior_cost, prior_gradient, prior_information = likelihood.row.prior(row)
    return cost + prior_cost, gradient + prior_gradient, (information, information + prior_information)
