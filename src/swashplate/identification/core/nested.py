"""What two nested fits say of the part of the physics that they differ by.

Twice the gain in log-likelihood is chi-squared under the smaller model (Wilks 1938). Two things keep it from that here
and are allowed for: residuals are coloured, so the gain is divided by how much wider the corrected covariance of the
tested numbers is than the plain one (Rotnitzky and Jewell 1990; Satorra and Bentler 1994); and a value that stands for
"not there" may be a bound, so that chance can only push one way (Chernoff 1954; Self and Liang 1987).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from swashplate.identification.core.result import Result, bounds_of
from swashplate.models.choices import PhysicalEffect

LEVEL = 0.01
"""Chance, over all effects together, of calling one needed that is not there."""
MOVED = 3.0
"""Standard deviations by which a number must move to be named."""
_WORSE = -0.5
"""Log-likelihood by which a search with more freedom may end lower and still count as the same optimum."""


@dataclass(frozen=True)
class EffectTest:
    """A model with and without one effect.

    Attributes:
        effect: what differs.
        asked: True where the effect was free in what was asked for, False where it was added for the test.
        gain: log-likelihood that it adds; priors of its own numbers count against it.
        scale: by which coloured residuals exaggerate the gain.
        bounded: tested numbers whose value without the effect is a bound of physics.
        chance: of so large a gain where the effect is not there; `adjusted`: the same for the search among all (Holm).
        values: of the tested numbers, with their standard deviations.
        moved: other free numbers, by how many of their own standard deviations the effect moves them, largest first.
        refused: why nothing can be said, "" where something can.
        remarks: what the test rests on.
    """

    effect: PhysicalEffect
    asked: bool
    gain: float = float("nan")
    scale: float = float("nan")
    bounded: tuple[str, ...] = ()
    chance: float = float("nan")
    adjusted: float = float("nan")
    values: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    moved: Mapping[str, float] = field(default_factory=dict)
    refused: str = ""
    remarks: tuple[str, ...] = ()

    @property
    def verdict(self) -> str:
        """ "needed", "not needed" or "cannot be told"."""
        if self.refused:
            return "cannot be told"
        return "needed" if self.adjusted < LEVEL else "not needed"

    @property
    def words(self) -> str:
        """One line: the verdict, the numbers, and what freeing it moves."""
        if self.refused:
            return f"{self.effect.name}: cannot be told: {self.refused}"
        freed = ", ".join(f"{name} = {value:.4g} ± {sigma:.2g}" for name, (value, sigma) in self.values.items())
        told = f"{self.effect.name}: {self.verdict} (log-likelihood {self.gain:+.1f}, p = {self.adjusted:.1g}): {freed}"
        large = [f"{name} by {sigmas:+.1f} sigma" for name, sigmas in self.moved.items() if abs(sigmas) > MOVED]
        if self.verdict == "needed":
            told += f"; freeing it moves {', '.join(large) or 'no other number by more than 3 sigma'}"
        return "; ".join([told, *self.remarks])

    def to_document(self) -> dict[str, Any]:
        """Numbers and words as JSON types."""
        return {
            "effect": self.effect.name,
            "without": dict(self.effect.without),
            "asked": self.asked,
            "verdict": self.verdict,
            "words": self.words,
            "gain": self.gain,
            "scale": self.scale,
            "bounded": list(self.bounded),
            "chance": self.chance,
            "adjusted": self.adjusted,
            "values": {name: list(pair) for name, pair in self.values.items()},
            "moved": dict(self.moved),
        }


def tested(effect: PhysicalEffect, narrow: Result[Any, Any], wide: Result[Any, Any], *, asked: bool) -> EffectTest:
    """What a fit without an effect and one with it say of it; `adjusted` is the chance of this test alone.

    Args:
        effect: its numbers stand still in `narrow` and are free in `wide`; all else is alike.
        narrow, wide: of the same data by the same method.
        asked: see `EffectTest`.
    """
    names = [name for name in effect.without if name in wide.names]
    unsettled = [word for word, fit in (("without", narrow), ("with", wide)) if fit.failed or not fit.converged]
    gain = narrow.cost - wide.cost
    refused = ""
    if not names:
        refused = f"no flight moves {', '.join(effect.without)} by itself."
    elif unsettled:
        refused = f"the fit {' and the fit '.join(unsettled)} it did not converge."
    elif gain < _WORSE:
        refused = f"the search with it ended {-gain:.1f} lower in log-likelihood than the one without."
    if refused:
        return EffectTest(effect, asked, refused=refused)
    scale = _colour(wide, names)
    low, high = bounds_of(narrow.model, names)
    without = np.array([effect.without[name] for name in names])
    bounded = tuple(n for n, at in zip(names, (without <= low) | (without >= high), strict=True) if at)
    chance = chance_of(2.0 * max(gain, 0.0) / scale, len(names), len(bounded))
    common = [name for name in narrow.names if name in wide.names]
    moved = {n: (wide[n].value - narrow[n].value) / narrow[n].best_sigma for n in common if narrow[n].best_sigma > 0.0}
    return EffectTest(
        effect,
        asked,
        gain=float(gain),
        scale=scale,
        bounded=bounded,
        chance=chance,
        adjusted=chance,
        values={name: (wide[name].value, wide[name].best_sigma) for name in names},
        moved=dict(sorted(moved.items(), key=lambda one: -abs(one[1]))),
        remarks=_remarks(narrow, wide, names),
    )


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


def _colour(fit: Result[Any, Any], names: Sequence[str]) -> float:
    """How much wider coloured residuals make the covariance of some numbers, at least one."""
    places = np.ix_(*2 * [[fit.names.index(name) for name in names]])
    plain, corrected = fit.covariance[places], fit.covariance_corrected[places]
    if not (np.all(np.isfinite(corrected)) and np.linalg.cond(plain) < 1e16):
        return 1.0
    return max(1.0, float(np.trace(np.linalg.solve(plain, corrected))) / len(names))


_HEAVY = 0.5
"""Share of a tested number's information that is the prior's above which it is said."""


def _remarks(narrow: Result[Any, Any], wide: Result[Any, Any], names: Sequence[str]) -> tuple[str, ...]:
    stopped = [n for n in wide.names if n not in names and any(f[n].at_bound for f in (narrow, wide) if n in f.names)]
    heavy = [name for name in names if wide[name].prior_share > _HEAVY]
    told = [f"{', '.join(stopped)} stands on its bound in these fits, and the test holds it there"] if stopped else []
    return (*told, *([f"the prior, more than the flights, says what {', '.join(heavy)} is"] if heavy else []))
