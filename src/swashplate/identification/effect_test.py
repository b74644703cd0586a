"""A test of one part of the physics: the chance of what a flight says for it where the part is not there.

Twice the gain in log-likelihood is chi-squared under the smaller model (Wilks 1938), except where a value that stands
for "not there" is a bound, so that chance can only push one way (Chernoff 1954; Self and Liang 1987).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from swashplate.models.choices import PhysicalEffect

LEVEL = 0.01
"""Chance, over all effects together, of calling one needed that is not there."""
MOVED = 3.0
"""Standard deviations by which a number must move to be named."""


@dataclass(frozen=True)
class EffectTest:
    """A model with and without one effect.

    Attributes:
        effect: what differs.
        asked: True where the effect is free in the fit, False where the fit leaves it out.
        gain: log-likelihood that it adds; priors of its own numbers count against it.
        chance: of so large a gain where the effect is not there; `adjusted`: the same for the search among all (Holm).
        values: of the tested numbers, with their standard deviations.
        moved: other free numbers, by how many of their own standard deviations the effect moves them, largest first.
        refused: why nothing can be said, "" where something can.
    """

    effect: PhysicalEffect
    asked: bool
    gain: float = float("nan")
    chance: float = float("nan")
    adjusted: float = float("nan")
    values: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    moved: Mapping[str, float] = field(default_factory=dict)
    refused: str = ""

    @property
    def verdict(self) -> str:
        """ "needed", "not needed" or "cannot be told"."""
        if self.refused:
            return "cannot be told"
        return "needed" if self.adjusted < LEVEL else "not needed"


def chance_of(statistic: float, free: int, bounded: int) -> float:
    """Probability of a statistic as large where the effect is not there.

    With one number on a bound half of chi-squared of one degree less and half of all degrees (Self and Liang 1987, case
    6); with more on a bound the same is an upper limit (Perlman 1969).
    """
    from scipy.special import chdtrc  # every report imports this module

    whole = float(chdtrc(free, max(statistic, 0.0)))
    if not bounded:
        return whole
    less = float(chdtrc(free - 1, max(statistic, 0.0))) if free > 1 else float(statistic <= 0.0)
    return 0.5 * (less + whole)


def holm(tests: Sequence[EffectTest]) -> tuple[EffectTest, ...]:
    """The tests with their chances adjusted for how many were made (Holm 1979)."""
    judged = sorted((i for i, one in enumerate(tests) if not one.refused), key=lambda i: tests[i].chance)
    made, worst = list(tests), 0.0
    for rank, i in enumerate(judged):
        worst = min(1.0, max(worst, (len(judged) - rank) * tests[i].chance))
        made[i] = replace(tests[i], adjusted=worst)
    return tuple(made)
