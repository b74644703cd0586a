"""What a search over structures found: every one that was tried, the pick, and why."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.identification.core.result import percent
from swashplate.identification.frequency.state_space_result import StateSpaceFit
from swashplate.identification.frequency.structure_score import hidden, misfits, parts_in, score

_ALIKE = 0.02
"""Share of the misfit within which two structures fit alike."""

_NAMED = 6


def reasons(pick: Contender, others: Sequence[Contender], leaner: Mapping[str, Contender]) -> list[str]:
    """The reasons, a line each.

    Args:
        pick: what is suggested. others: what else was tried. leaner: the pick without a part, by that part.
    """
    lines = [
        f"Picked {pick.name}: J_ave {pick.cost:.1f} with {pick.parameters} parameters; what others fit better is not "
        "worth their parameters."
    ]
    for part, one in leaner.items():
        name, before, after = _worst_loss(pick, one)
        lines.append(f"  without '{part}': J_ave {one.cost:.1f}; {name} from {before:.0f} to {after:.0f}.")
    for one in [c for c in others if not leaner and not c.abandoned][:_NAMED]:
        name, before, after = _worst_loss(pick, one)
        lines.append(f"  {one.name}: J_ave {one.cost:.1f}; {name} {after:.0f} instead of {before:.0f}.")
    parts = set(pick.name.split("+"))
    failed = [c for c in (pick, *others) if c.failed]
    vain = [(c, set(c.name.split("+")) - parts) for c in others if parts < set(c.name.split("+")) and not c.failed]
    added = list(dict.fromkeys(name for _, more in vain for name in sorted(more) if len(more) == 1))
    if added:
        lines.append(f"  nothing gained that is worth the parameters: {', '.join(added)}.")
    lines += [
        f"! {c.name}: J_ave {c.cost:.1f} although it contains {c.failed}, which fits better. Its fit failed: that says "
        f"nothing against its parts. Fit it alone (compose:{c.name})."
        for c in failed
    ]
    alike = [
        c.name
        for c in others
        if not c.abandoned and c.parameters <= pick.parameters and abs(c.misfit - pick.misfit) <= _ALIKE * pick.misfit
    ]
    if alike:
        lines.append(f"! these responses cannot tell it from {', '.join(alike[:_NAMED])}: they fit alike.")
    if misfits(pick.fit.solution, pick.fit.targets):
        lines.append("! none of these is all of the aircraft: the pick is the least wrong one, see its warnings.")
    return lines


def _worst_loss(pick: Contender, one: Contender) -> tuple[str, float, float]:
    """The response that loses most, with its J in both."""
    other = dict(zip((t.name for t in one.fit.targets), one.fit.costs, strict=True))
    both = zip(pick.fit.targets, pick.fit.costs, strict=True)
    pairs = [(t.name, cost, other[t.name]) for t, cost in both if t.name in other] or [("nothing shared", 0.0, 0.0)]
    return max(pairs, key=lambda pair: pair[2] - pair[1])


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
            ahead = f"{c.held_out:.2f}" if np.isfinite(c.held_out) else ""
            modes = "abandoned after the first look" if c.abandoned else c.modes
            modes = f"its fit failed: {c.failed}, which it contains, fits better" if c.failed else modes
            table.append((c.name, f"{c.cost:.1f}", f"{max(c.fit.costs):.0f}", str(c.parameters), vague, ahead, modes))
        return table if self.judged else [(*row[:5], *row[6:]) for row in table]

    def to_document(self) -> dict[str, object]:
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
                    "modes": [mode.to_document() for mode in c.fit.details.modes],
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
