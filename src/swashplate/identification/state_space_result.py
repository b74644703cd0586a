"""`StateSpaceFit`: what a fit of a state-space model found, how well it is told, and what was taken out on the way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from swashplate.flights.flight import Array
from swashplate.identification.mode_accuracy import ModeAccuracy
from swashplate.identification.response_cost import ParameterAccuracy, Target, percent
from swashplate.identification.state_space import StateSpaceModel


@dataclass(frozen=True)
class Step:
    """One line of a reduction's history.

    Attributes:
        dropped: parameter that was taken out. reason: why.
        before, after: J_ave. kept: whether the drop stands.
    """

    dropped: str
    reason: str
    before: float
    after: float
    kept: bool


@dataclass(frozen=True)
class StateSpaceFit:
    """A model fitted to responses.

    Attributes:
        model: the identified model. start: what it began from.
        targets: measured responses. costs: J of each.
        parameters: with bounds, fixed and tied ones included.
        free: names in the order of `correlation`.
        correlation: of the free parameters.
        history: half the sum of J after each iteration.
        reduction: what was dropped on the way.
        converged: False where the iterations ran out.
        warnings, problems: what a reader must know; what is wrong.
        left_out: pairs without a coherent band. ceilings: what their responses cannot exceed.
        modes: of the identified model, with what the bounds leave of them.
        seconds: wall time.
        settings: what was asked.
    """

    model: StateSpaceModel
    start: StateSpaceModel
    targets: tuple[Target, ...]
    costs: tuple[float, ...]
    parameters: tuple[ParameterAccuracy, ...]
    free: tuple[str, ...]
    correlation: Array
    history: tuple[float, ...]
    reduction: tuple[Step, ...] = ()
    converged: bool = True
    warnings: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    ceilings: tuple[Target, ...] = ()
    modes: tuple[ModeAccuracy, ...] = ()
    seconds: float = 0.0
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def cost(self) -> float:
        """J_ave."""
        return float(np.mean(self.costs))

    @property
    def nothing_to_drop(self) -> bool:
        """Whether a reduction was asked for, and every parameter was within its targets already."""
        return bool(self.settings.get("reduced")) and not self.reduction

    def __getitem__(self, name: str) -> ParameterAccuracy:
        return next(p for p in self.parameters if p.name == name)

    def as_dict(self) -> dict[str, Any]:
        """Numbers and words as JSON types."""
        return {
            "kind": "state-space-fit",
            "model": self.model.name,
            "J_ave": self.cost,
            "J": {t.name: cost for t, cost in zip(self.targets, self.costs, strict=True)},
            "parameters": [vars(p) for p in self.parameters],
            "free": list(self.free),
            "correlation": self.correlation.tolist(),
            "eigenvalues": [[float(v.real), float(v.imag)] for v in self.model.eigenvalues()],
            "modes": [mode.as_dict() for mode in self.modes],
            "reduction": [vars(step) for step in self.reduction],
            "converged": self.converged,
            "warnings": list(self.warnings),
            "problems": list(self.problems),
            "left_out": list(self.left_out),
            "seconds": self.seconds,
            "settings": dict(self.settings),
        }

    def __repr__(self) -> str:
        lines = [f"{self.model.name}: J_ave = {self.cost:.1f} over {len(self.targets)} responses"]
        lines += [f"  J = {cost:7.1f}  {t.name}" for t, cost in zip(self.targets, self.costs, strict=True)]
        lines.append(f"  {'parameter':<14}{'start':>12}{'value':>12}{'CR %':>8}{'I %':>8}  unit")
        for p in self.parameters:
            moving = not p.fixed and not p.tie
            cells = percent(p.cramer_rao_percent) + percent(p.insensitivity_percent) if moving else " " * 16
            remark = f"  = {p.tie}" if p.tie else "  fixed" if p.fixed else "  at its bound" if p.at_bound else ""
            lines.append(f"  {p.name:<14}{p.start:>12.5g}{p.value:>12.5g}{cells}  {p.unit}{remark}")
        lines += [_mode_words(mode) for mode in self.modes]
        for step in self.reduction:
            verdict = "dropped" if step.kept else "put back"
            lines.append(f"  {verdict} {step.dropped} ({step.reason}): J_ave {step.before:.1f} -> {step.after:.1f}")
        if self.nothing_to_drop:
            lines.append("  nothing to take out: every parameter is within its targets")
        return "\n".join([*lines, *(f"! {text}" for text in (*self.problems, *self.warnings))])


def _mode_words(mode: ModeAccuracy) -> str:
    head = f"  mode {mode.frequency:>9.4g} rad/s, damping {mode.damping:>6.3f}"
    place = "" if mode.inside else "  below the band"
    return f"{head}   CR {percent(mode.frequency_percent, width=6)} %, {mode.damping_bound:.3f}{place}"
