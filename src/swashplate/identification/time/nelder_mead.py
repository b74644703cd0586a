"""The paper's own way: Nelder and Mead's simplex on the squared simulation error (Fankhauser et al., sec. IV-B)."""

from __future__ import annotations

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.core import stopping
from swashplate.identification.core.scoring import Optimum, Progress
from swashplate.identification.time.output_error import OutputError

_EVALUATIONS_PER_PARAMETER = 400


def minimise_squares(likelihood: OutputError, *, progress: Progress | None = None) -> Optimum:
    """Parameters of the least squared error, everything else at its first guess; bounds by reflection at the card's.

    The same simulator and the same weighting as output error, so that the two can be compared: only the way down
    differs. The information matrix is computed once, at the end.
    """
    row = likelihood.row
    start = row.starts()
    likelihood.refresh(start)
    places = row.places("parameter")
    low, high = row.bounds()
    history: list[float] = []
    ends: list[Array] = []

    def cost(moved: Array) -> float:
        full = start.copy()
        full[places] = np.clip(moved, low[places], high[places])
        value = likelihood.cost(full) + row.prior(full)[0]
        return value if np.isfinite(value) else 1e12

    def told(moved: Array) -> None:
        ends.append(np.array(moved, dtype=np.float64))
        history.append(cost(ends[-1]))
        stopping.counted()
        if progress is not None:
            progress(len(history), history[-1])

    from scipy.optimize import minimize  # a tenth of a second, and every fit imports this module

    limit = _EVALUATIONS_PER_PARAMETER * places.size
    options = {"maxfev": limit, "xatol": 1e-3, "fatol": 1e-2}
    last, converged = start[places], False
    try:
        answer = minimize(cost, last, method="Nelder-Mead", callback=told, options=options)
        last, converged = answer.x, bool(answer.success)
    except stopping.INTERRUPTS as interrupt:
        stopping.keep(interrupt)
        last = ends[-1]
    best = start.copy()
    best[places] = np.clip(last, low[places], high[places])
    touching = (best <= low + 1e-9) | (best >= high - 1e-9)
    return Optimum(
        row=best,
        cost=float(cost(best[places])),
        history=tuple(history),
        information=likelihood.scores(best)[2],
        converged=converged,
        at_bound=tuple(name for name, touch in zip(row.names, touching, strict=True) if touch),
    )
