"""Why a search over structures picked one: what each part is worth, what was tried in vain, what cannot be told."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from swashplate.identification.frequency.search_result import Contender
from swashplate.identification.frequency.structure_misfit import misfits

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
    own = set(pick.name.split("+"))
    failed = [c for c in (pick, *others) if c.failed]
    vain = [(c, set(c.name.split("+")) - own) for c in others if own < set(c.name.split("+")) and not c.failed]
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
    pairs = [(t.name, own, other[t.name]) for t, own in both if t.name in other] or [("nothing shared", 0.0, 0.0)]
    return max(pairs, key=lambda pair: pair[2] - pair[1])
