"""Whether a fitted structure can be the aircraft's: misfits beyond what the measurement scatters, and where they lie.

J up to 100 counts as acceptable, but a wrong structure often stays below it: its modes are then confidently wrong. The
responses' own random errors tell: what misses them by several times their scatter is no bad luck, but something that
the structure lacks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.frequency.lacking_parts import lacking_words
from swashplate.identification.frequency.response_cost import Target, log_error
from swashplate.identification.frequency.state_space_search import answers
from swashplate.identification.frequency.structure_score import scatter
from swashplate.identification.responses.frequency_response import TWO_PI
from swashplate.models.linear.state_space import StateSpaceModel

MANY = 3.0
"""Times its scatter by which a response has to be missed to count."""

_ONE_END = 0.7
"""Share of the misfit in one half of the band (in log frequency) from which that half is named."""

_KEPT = 0.9
"""Share of a response's points that counts, the worst left out."""

_NAMED = 6


@dataclass(frozen=True)
class Misfit:
    """A response that the model misses.

    Attributes:
        name: of the pair. times: its scatter, by which it is missed (rms, without its worst points).
        omega: frequencies [rad/s]. squared: squared misfit over squared scatter at each.
    """

    name: str
    times: float
    omega: Array
    squared: Array


def misfits(model: StateSpaceModel, targets: Sequence[Target]) -> tuple[Misfit, ...]:
    """What a model misses by more than `MANY` times the measurement's scatter, the worst first.

    Args:
        model: with its numbers. targets: fitted responses; those without known errors are passed over.
    """
    missed = []
    for t, h in zip(targets, answers(model, targets), strict=True):
        if t.error is None:
            continue
        # The random error is that of the modulus; real and imaginary part scatter alike.
        squared = np.abs(log_error(h, t.measured)) ** 2 / (2.0 * scatter(t) ** 2)
        # A tenth of the points may be a notch that windows and model see elsewhere; a wrong structure misses more.
        times = float(np.sqrt(np.mean(np.sort(squared)[: round(_KEPT * squared.size)])))
        if times > MANY:
            missed.append(Misfit(t.name, times, t.omega, squared))
    return tuple(sorted(missed, key=lambda one: -one.times))


def misfit_words(model: StateSpaceModel, targets: Sequence[Target], *, advise: bool = True) -> list[str]:
    """That a structure cannot be the aircraft's, in words: which responses, how far off, at which end of the band.

    Args:
        model: with its numbers. targets: fitted responses. advise: whether to say what it may lack.
    """
    missed = misfits(model, targets)
    if not missed:
        return []
    named = ", ".join(f"{one.name} ({one.times:.0f} times)" for one in missed[:_NAMED])
    named += f" and {len(missed) - _NAMED} more" if len(missed) > _NAMED else ""
    text = (
        f"this structure is not all of the aircraft: {len(missed)} of {len(targets)} responses are missed by more than "
        f"{MANY:g} times their scatter: {named}{_where(missed)}. Do not trust modes or derivatives that rest on them."
    )
    text += lacking_words(model, [one.name for one in missed]) if advise else ""
    speeds = [n for s, n in model.trim.items() if s in ("u", "v", "w")]
    if speeds and all(model.parameters[n].value == 0.0 for n in speeds):
        text += f" If this was not flown in hover, say so: --fix {speeds[0]}=..."
    return [text]


def _where(missed: Sequence[Misfit]) -> str:
    low, high = (end(one.omega[k] for one in missed) for end, k in ((min, 0), (max, -1)))
    middle = float(np.sqrt(low * high))
    total = sum(float(np.sum(one.squared)) for one in missed)
    upper = sum(float(np.sum(one.squared[one.omega > middle])) for one in missed) / total
    if upper > _ONE_END:
        return f", mostly above {middle / TWO_PI:.2g} Hz"
    if upper < 1.0 - _ONE_END:
        return f", mostly below {middle / TWO_PI:.2g} Hz"
    return ", all over the band"
