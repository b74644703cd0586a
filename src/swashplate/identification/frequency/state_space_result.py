"""What only a fit of a state-space model to responses has: its modes, what was left out and what was taken out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from swashplate.identification.core.result import Result, percent
from swashplate.identification.frequency.mode_accuracy import ModeAccuracy
from swashplate.identification.frequency.response_cost import Target
from swashplate.models.linear.state_space import StateSpaceModel


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

    def lines(self, result: Result[Any, Any]) -> list[str]:
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
