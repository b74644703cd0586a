"""Delays make valleys: where another delay promises about as much, the search begins again from there.

A command that comes in waves fits nearly as well half a wave too early or too late, and the other parameters settle
around whichever delay the search met first. One cost at each of some delays tells which of them are worth a search.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.core import stopping
from swashplate.identification.core.scoring import Likelihood, Optimum, Solver, minimise

_FARTHEST, _STEP, _APART = 3.0, 0.2, 0.6
"""The delays tried, and how far from the one found, in scaled units of 50 ms."""

_PROMISING = 50.0
"""Log-units that another delay may lie above the optimum before anything else has settled around it."""


def minimise_over_valleys(likelihood: Likelihood, solver: Solver | None = None) -> Optimum:
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


def _elsewhere(likelihood: Likelihood, best: Optimum, place: int) -> Array | None:
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
