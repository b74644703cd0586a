"""The paper's own way: Nelder and Mead's simplex on the squared simulation error (Fankhauser et al., sec. IV-B)."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import minimize

from swashplate.arrays import Array
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

    def cost(moved: Array) -> float:
        full = start.copy()
        full[places] = np.clip(moved, low[places], high[places])
        value = likelihood.cost(full) + row.prior(full)[0]
        return value if np.isfinite(value) else 1e12

    def told(moved: Any) -> None:
        history.append(cost(np.asarray(moved)))
        if progress is not None:
            progress(len(history), history[-1])

    limit = _EVALUATIONS_PER_PARAMETER * places.size
    options = {"maxfev": limit, "xatol": 1e-3, "fatol": 1e-2}
    answer = minimize(cost, start[places], method="Nelder-Mead", callback=told, options=options)
    best = start.copy()
    best[places] = np.clip(answer.x, low[places], high[places])
    touching = (best <= low + 1e-9) | (best >= high - 1e-9)
    return Optimum(
        row=best,
        cost=float(answer.fun),
        history=tuple(history),
        information=likelihood.scores(best)[2],
        converged=bool(answer.success),
        at_bound=tuple(name for name, touch in zip(row.names, touching, strict=True) if touch),
    )
