"""What a search over structures found: every one that was tried, the pick, and why."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from swashplate.identification.core.result import percent
from swashplate.identification.frequency.lacking_parts import parts_in
from swashplate.identification.frequency.state_space_result import StateSpaceFit
from swashplate.identification.frequency.structure_score import hidden, score

_MODES = 5


@dataclass(frozen=True)
class Contender:
    """One structure that was tried.

    Attributes:
        name: of the structure, or its parts. fit: as far as it was followed.
        misfit: `squared_misfit`. abandoned: whether it was dropped after the first look.
        held_out: J_rms on records that no fit has seen; NaN where there are none, or it was not asked.
        failed: the structure that it contains and yet fits worse than; empty where there is none.
    """

    name: str
    fit: StateSpaceFit
    misfit: float
    abandoned: bool = False
    held_out: float = float("nan")
    failed: str = ""

    @property
    def parts(self) -> tuple[str, ...]:
        """What the structure is composed of; those whose states it has where it is not composed."""
        return parts_in(self.fit.solution)

    @property
    def parameters(self) -> int:
        """Numbers that were fitted."""
        return len(self.fit.names)

    @property
    def cost(self) -> float:
        """J_ave."""
        return self.fit.cost

    @property
    def vaguest(self) -> tuple[str, float]:
        """The parameter with the largest standard deviation, and that [%]."""
        moving = [p for p in self.fit.estimates if not p.fixed and not p.tie]
        worst = max(moving, key=lambda p: p.sigma_percent if np.isfinite(p.sigma_percent) else np.inf)
        return worst.name, worst.sigma_percent

    @property
    def modes(self) -> str:
        """The fastest modes inside the band: rad/s, and the damping ratio of pairs."""
        inside = [m for m in self.fit.details.modes if m.inside][:_MODES]
        pairs = [f"{m.frequency:.3g}" + (f" ({m.damping:.2f})" if m.eigenvalue.imag else "") for m in inside]
        return ", ".join(pairs)

    def score(self, spread: float, points: int) -> float:
        """`structure_score.score` of it."""
        return score(self.misfit, self.parameters, hidden=hidden(self.parts), spread=spread, points=points)


@dataclass(frozen=True)
class StructureSearch:
    """Structures that were tried on the same responses.

    Attributes:
        tried: the best first, those that were abandoned last.
        pick: the one that is suggested. reasons: why, in words.
        seconds: what the search took.
    """

    tried: tuple[Contender, ...]
    pick: Contender
    reasons: tuple[str, ...]
    seconds: float = 0.0

    @property
    def judged(self) -> bool:
        """Whether a record that no fit has seen was flown along."""
        return any(np.isfinite(c.held_out) for c in self.tried)

    def rows(self) -> list[tuple[str, ...]]:
        """Cells of the table, the head first."""
        table: list[tuple[str, ...]] = [
            ("structure", "J_ave", "worst J", "parameters", "worst sigma %", "held-out J_rms", "modes [rad/s]")
        ]
        for c in self.tried:
            name, bound = c.vaguest
            vague = "" if c.abandoned else f"{percent(bound).strip()} ({name})"
            seen = f"{c.held_out:.2f}" if np.isfinite(c.held_out) else ""
            modes = "abandoned after the first look" if c.abandoned else c.modes
            modes = f"its fit failed: {c.failed}, which it contains, fits better" if c.failed else modes
            table.append((c.name, f"{c.cost:.1f}", f"{max(c.fit.costs):.0f}", str(c.parameters), vague, seen, modes))
        return table if self.judged else [(*row[:5], *row[6:]) for row in table]

    def as_dict(self) -> dict[str, Any]:
        """All of it as JSON types."""
        return {
            "picked": self.pick.name,
            "reasons": list(self.reasons),
            "seconds": self.seconds,
            "tried": [
                {
                    "structure": c.name,
                    "J_ave": c.cost,
                    "J_worst": max(c.fit.costs),
                    "parameters": c.parameters,
                    "vaguest": c.vaguest[0],
                    "cramer_rao_percent": c.vaguest[1],
                    "held_out_J_rms": c.held_out,
                    "misfit": c.misfit,
                    "abandoned": c.abandoned,
                    "failed": c.failed,
                    "modes": [mode.as_dict() for mode in c.fit.details.modes],
                }
                for c in self.tried
            ],
        }

    def __repr__(self) -> str:
        table = self.rows()
        widths = [max(len(row[k]) for row in table) for k in range(len(table[0]))]
        lines = [f"Structures tried ({len(self.tried)}, {self.seconds:.0f} s):"]
        for n, row in enumerate(table):
            mark = "*" if n and self.tried[n - 1] is self.pick else " "
            cells = [row[0].ljust(widths[0]), *(c.rjust(w) for c, w in zip(row[1:-1], widths[1:-1], strict=True))]
            lines.append(f" {mark}{'  '.join([*cells, row[-1]])}".rstrip())
        return "\n".join([*lines, *self.reasons])
