"""What a reader of a fitted state-space model must know: which responses it misses, which parameters are not told."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.core import stopping
from swashplate.identification.core.accuracy import sign_words
from swashplate.identification.core.result import Estimate
from swashplate.identification.frequency.response_cost import ACCEPTABLE, Target

CR_TARGET, I_TARGET = 20.0, 10.0
"""Percent of the value that a standard deviation and an insensitivity should not exceed (Tischler and Remple 2012, of
the Cramér-Rao bound)."""

ONE = 0.995
"""Correlation of two parameters above which the responses tell one number of the two."""


def words(
    targets: Sequence[Target],
    costs: Sequence[float],
    parameters: Sequence[Estimate],
    correlation: Array,
    *,
    at_bound: Sequence[str],
    converged: bool,
) -> list[str]:
    """The warnings of a fit.

    Args:
        targets, costs: fitted responses and J of each.
        parameters: all of the model. correlation: of those that moved, in their order.
        at_bound: parameters that ended on a bound. converged: False where the iterations ran out.
    """
    warnings = [] if converged else [stopping.unfinished()]
    poor = [f"{t.name} ({cost:.0f})" for t, cost in zip(targets, costs, strict=True) if cost > ACCEPTABLE]
    if poor:
        warnings.append(f"J above {ACCEPTABLE:g}: {', '.join(poor)}.")
    moving = [p for p in parameters if not p.fixed and not p.tie]
    blind = [p.name for p in moving if p.insensitivity_percent > I_TARGET]
    vague = [p.name for p in moving if p.sigma_percent > CR_TARGET]
    if blind:
        warnings.append(f"insensitivity above {I_TARGET:g} %: {', '.join(blind)}.")
    if vague:
        warnings.append(f"standard deviation above {CR_TARGET:g} %: {', '.join(vague)}.")
    warnings += sign_words(moving)
    pairs = _one_of_two(moving, correlation)
    if pairs:
        warnings.append(
            f"told only together (correlation {ONE:g} or more): {', '.join(pairs)}. Hold one of each (--fix) or tie it."
        )
    if at_bound:
        warnings.append(f"ended on a bound: {', '.join(at_bound)}.")
    return warnings


def _one_of_two(moving: Sequence[Estimate], correlation: Array) -> list[str]:
    """Pairs of which neither is told although each alone would be."""
    lost = [k for k, p in enumerate(moving) if p.sigma_percent > CR_TARGET and p.insensitivity_percent <= I_TARGET]
    return [
        f"{moving[i].name} and {moving[k].name}"
        for n, k in enumerate(lost)
        for i in lost[:n]
        if np.abs(correlation[i, k]) >= ONE
    ]
