"""What only a fit of a state-space model to responses has: its modes, what was left out and what was taken out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.core import stopping
from swashplate.identification.core.accuracy import sign_words
from swashplate.identification.core.result import Estimate, Result, percent
from swashplate.identification.frequency.mode_accuracy import ModeAccuracy
from swashplate.identification.frequency.response_cost import ACCEPTABLE, Target
from swashplate.models.linear.state_space import StateSpaceModel

CR_TARGET, I_TARGET = 20.0, 10.0
"""Percent of the value that a standard deviation and an insensitivity should not exceed (Tischler and Remple 2012, of
the Cramér-Rao bound)."""

ONE = 0.995
"""Correlation of two parameters above which the responses tell one number of the two."""


def fit_warnings(
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


@dataclass(frozen=True)
class ReductionStep:
    """One line of a reduction's history.

    Attributes:
        dropped: parameter that was taken out. reason: why.
        before, after: J_ave. kept: whether the drop stands.
        veto: why it does not, where J_ave is not the reason. modes: what it does to the modes inside the band.
    """

    dropped: str
    reason: str
    before: float
    after: float
    kept: bool
    veto: str = ""
    modes: str = ""


@dataclass(frozen=True)
class StateSpaceDetails:
    """What a fit of a state-space model to responses adds to a result.

    Attributes:
        left_out: pairs without a coherent band. ceilings: what their responses cannot exceed.
        modes: of the identified model, with what the bounds leave of them.
        reduction: what was dropped on the way. reduced: whether a reduction was asked for.
        reduced_modes: what all of it did to the modes inside the band, in words.
    """

    kind: ClassVar[str] = "state-space responses"
    left_out: tuple[str, ...] = ()
    ceilings: tuple[Target, ...] = ()
    modes: tuple[ModeAccuracy, ...] = ()
    reduction: tuple[ReductionStep, ...] = ()
    reduced: bool = False
    reduced_modes: str = ""

    @property
    def nothing_to_drop(self) -> bool:
        """Whether a reduction was asked for, and every parameter was within its targets already."""
        return self.reduced and not self.reduction

    def lines(self, result: Result[object, object]) -> list[str]:
        """What a printed result says of it."""
        lines = [f"  J = {cost:7.1f}  {t.name}" for t, cost in zip(result.targets, result.costs, strict=True)]
        lines += [_mode_words(mode) for mode in self.modes]
        for step in self.reduction:
            verdict = "dropped" if step.kept else "put back"
            lines.append(f"  {verdict} {step.dropped} ({step.reason}): J_ave {step.before:.1f} -> {step.after:.1f}")
            lines += [f"    {text}" for text in (step.veto, step.modes) if text]
        kept = [step.dropped for step in self.reduction if step.kept]
        if kept and self.reduced_modes:
            lines.append(f"  taken out in all: {', '.join(kept)}; {self.reduced_modes}")
        if self.nothing_to_drop:
            lines.append("  nothing to take out: every parameter is within its targets")
        return lines


StateSpaceFit = Result[StateSpaceModel, StateSpaceDetails]
"""What `fit_state_space` returns."""


def _mode_words(mode: ModeAccuracy) -> str:
    head = f"  mode {mode.frequency:>9.4g} rad/s, damping {mode.damping:>6.3f}"
    place = "" if mode.inside else "  below the band"
    return f"{head}   σ {percent(mode.frequency_percent, width=6)} %, {mode.damping_bound:.3f}{place}"
