"""What one step from a fit says of the parts of the physics that it has and of those that it lacks.

Nothing is fitted again. Where the numbers of a part are free their covariance says how far they are from none of it
(Wald 1943); for one that is held out the slope of the likelihood by its numbers says it (Rao 1948). Both allow for
coloured residuals, which exaggerate what a flight says (Rotnitzky and Jewell 1990; Satorra and Bentler 1994), and for
bounds (`effect_test`).

A test of one part of the physics: the chance of what a flight says for it where the part is not there.

Twice the gain in log-likelihood is chi-squared under the smaller model (Wilks 1938), except where a value that stands
for "not there" is a bound, so that chance can only push one way (Chernoff 1954; Self and Liang 1987).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from swashplate.arrays import Array
from swashplate.identification.core import accuracy
from swashplate.identification.core.parameters import bounds_of
from swashplate.identification.core.result import Result
from swashplate.identification.time.estimates import LAGS
from swashplate.models.traits import PhysicalEffect

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
        shifts: other free numbers, by how many of their own standard deviations the effect moves them, largest first.
        refused: why nothing can be said, "" where something can.
    """

    effect: PhysicalEffect
    asked: bool
    gain: float = float("nan")
    chance: float = float("nan")
    adjusted: float = float("nan")
    values: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    shifts: Mapping[str, float] = field(default_factory=dict)
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

    chance = float(chdtrc(free, max(statistic, 0.0)))
    if not bounded:
        return chance
    less = float(chdtrc(free - 1, max(statistic, 0.0))) if free > 1 else float(statistic <= 0.0)
    return 0.5 * (less + chance)


def holm(tests: Sequence[EffectTest]) -> tuple[EffectTest, ...]:
    """The tests with their chances adjusted for how many were made (Holm 1979)."""
    judged = sorted((i for i, one in enumerate(tests) if not one.refused), key=lambda i: tests[i].chance)
    adjusted, worst = list(tests), 0.0
    for rank, i in enumerate(judged):
        worst = min(1.0, max(worst, (len(judged) - rank) * tests[i].chance))
        adjusted[i] = replace(tests[i], adjusted=worst)
    return tuple(adjusted)


_SINGULAR = 1e14
"""Condition of a block of information beyond which the flights cannot tell its numbers apart."""


def one_step_effects(
    fit: Result[object, object], effects: Sequence[PhysicalEffect] | None = None
) -> tuple[EffectTest, ...]:
    """A test of every effect that a vehicle's model names, by one step; empty where nothing can be said.

    Args:
        fit: of a vehicle, as its estimator returned it. What it has is judged always. What it lacks is judged where its
            likelihood is still there and frees more numbers without being compiled anew (`widened`).
        effects: to judge; the model's own where None.
    """
    if fit.failed or not fit.converged:
        return ()
    if effects is None:
        effects = fit.model.traits.effects(fit.model.card)
    inside = [effect for effect in effects if all(name in fit.names for name in effect.without)]
    tests = [_without(fit, effect) for effect in inside]
    likelihood = fit.fitted.likelihood if fit.fitted is not None else None
    if hasattr(likelihood, "widened"):
        values = fit.model.card.values()
        tied = {estimate.name for estimate in fit.estimates if estimate.tie}
        outside = [
            effect
            for effect in effects
            if not any(name in fit.names or name in tied for name in effect.without)
            and all(values[name] == value for name, value in effect.without.items())
        ]
        tests += _with(fit, outside)
    return holm(tests)


def in_words(tests: Sequence[EffectTest]) -> str:
    """One line: what the flights ask for, and what freeing it would move; "" for no tests."""
    answered = [test for test in tests if not test.refused]
    if not answered:
        return ""
    parts = []
    for test in answered:
        if test.verdict == "needed":
            far = f"{np.sqrt(2.0 * test.gain):.0f} sigma"
            shifts = [f"{name} by {by:+.0f} sigma" for name, by in test.shifts.items() if abs(by) > MOVED]
            word, numbers = "needs" if test.asked else "lacks", ", ".join(test.effect.without)
            parts.append(
                f"{word} {test.effect.name} ({far}; freeing {numbers} moves {', '.join(shifts) or 'nothing else'})"
            )
    idle = [test.effect.name for test in answered if test.verdict != "needed"]
    line = "; ".join(parts) or "asks for no part of the physics"
    rest = f"; not asked for: {', '.join(idle)}" if idle else ""
    return f"{line}{rest}. By one step from this fit."


def not_judged(fit: Result[object, object], effects: Sequence[PhysicalEffect] | None = None) -> str:
    """What `one_step_effects` says nothing of, in a sentence: parts that the fit leaves out, where its likelihood
    cannot free them without being compiled anew; "" where there are none."""
    if fit.fitted is not None and hasattr(fit.fitted.likelihood, "widened"):
        return ""
    if effects is None:
        effects = fit.model.traits.effects(fit.model.card)
    held = [effect.name for effect in effects if not any(name in fit.names for name in effect.without)]
    if not held:
        return ""
    return f"Held and not judged here: {', '.join(held)} (only a filter-error fit judges them)."


@dataclass(frozen=True)
class _Split:
    """Information on tested numbers and on the others, at an optimum of the others."""

    tested: Array
    others: Array
    between: Array

    @property
    def alone(self) -> Array:
        """Of the tested numbers with the others free."""
        return np.asarray(self.tested - self.between @ np.linalg.solve(self.others, self.between.T))


def _without(fit: Result[object, object], effect: PhysicalEffect) -> EffectTest:
    """An effect that is free: how far its numbers are from none, and how the others stand without it."""
    names = list(effect.without)
    at = [fit.names.index(name) for name in names]
    rest = [i for i in range(len(fit.names)) if i not in at]
    wide = fit.covariance_corrected if np.all(np.isfinite(fit.covariance_corrected)) else fit.covariance
    block, across = wide[np.ix_(at, at)], wide[np.ix_(rest, at)]
    if any(fit[name].at_bound for name in names) or np.linalg.cond(block) > _SINGULAR:
        return EffectTest(effect, True, refused="it stands on a bound, or the flights do not tell it.")
    away = np.array([fit[name].value - effect.without[name] for name in names])
    pull = np.linalg.solve(block, away)
    held = np.sqrt(np.maximum(np.diag(wide)[rest] - np.einsum("ij,ij->i", across @ np.linalg.inv(block), across), 0.0))
    by = across @ pull
    shifts = {fit.names[i]: float(m / s) for i, m, s in zip(rest, by, held, strict=True) if s > 0.0}
    return _test(fit, effect, True, float(away @ pull), {n: (fit[n].value, fit[n].best_sigma) for n in names}, shifts)


def _with(fit: Result[object, object], effects: Sequence[PhysicalEffect]) -> list[EffectTest]:
    """Effects that are held out: the slope of the likelihood where they are not, all in one evaluation."""
    if not effects or fit.fitted is None:
        return []
    added = [name for effect in effects for name in effect.without]
    likelihood = fit.fitted.likelihood.widened(added)
    places = {name: i for i, name in enumerate(fit.fitted.likelihood.row.names)}
    row = np.array(
        [
            fit.fitted.row[places[entry.name]] if entry.name in places else entry.start / entry.scale
            for entry in likelihood.row.entries
        ]
    )
    likelihood.refresh(row)
    _, slope, information = likelihood.scores(row)
    _, by_prior, prior = likelihood.row.prior(row)
    slope, hessian = slope + by_prior, information + prior
    bound = accuracy.covariance(likelihood.row, information, prior)
    white, sensitivities, elsewhere = likelihood.whitened(row)
    lags = round(LAGS / likelihood.records[0].dt)
    corrected = accuracy.corrected_covariance(bound, elsewhere + prior, white, sensitivities, lags=lags)
    names, scale = list(likelihood.row.names), likelihood.row.scale
    stopped = {name for name in fit.names if fit[name].at_bound}
    free = [i for i, name in enumerate(names) if name not in added and name not in stopped]
    tests = []
    for effect in effects:
        at = [names.index(name) for name in effect.without]
        split = _Split(hessian[np.ix_(at, at)], hessian[np.ix_(free, free)], hessian[np.ix_(at, free)])
        if not np.all(np.diag(split.tested) > 0.0) or np.linalg.cond(split.alone) > _SINGULAR:
            tests.append(EffectTest(effect, False, refused="no flight moves it by itself."))
            continue
        left = slope[at] - split.between @ np.linalg.solve(split.others, slope[free])
        step = -np.linalg.solve(split.alone, left)
        inside = np.ix_(at, at)
        colour = max(1.0, float(np.trace(np.linalg.solve(bound[inside], corrected[inside]))) / len(at))
        others = -np.linalg.solve(split.others, split.between.T @ step)
        sigmas = {name: fit[name].best_sigma for name in fit.names}
        shifts = {
            names[i]: float(by * scale[i] / sigmas[names[i]])
            for i, by in zip(free, others, strict=True)
            if sigmas.get(names[i], 0.0) > 0.0
        }
        spread = np.sqrt(colour * np.diag(np.linalg.inv(split.alone))) * scale[at]
        values = {
            name: (effect.without[name] + float(s * scale[i]), float(sigma))
            for name, i, s, sigma in zip(effect.without, at, step, spread, strict=True)
        }
        tests.append(_test(fit, effect, False, float(-left @ step) / colour, values, shifts))
    return tests


def _test(
    fit: Result[object, object],
    effect: PhysicalEffect,
    asked: bool,
    statistic: float,
    values: dict[str, tuple[float, float]],
    shifts: dict[str, float],
) -> EffectTest:
    """The chance of a statistic where the effect is not there; a step beyond a bound is none."""
    names = list(values)
    low, high = bounds_of(fit.model, names)
    without = np.array([effect.without[name] for name in names])
    bounded = int(np.count_nonzero((without <= low) | (without >= high)))
    outside = [n for n, lo, hi in zip(names, low, high, strict=True) if not lo <= values[n][0] <= hi]
    if outside and not asked and len(names) == 1:
        statistic = 0.0
    chance = chance_of(statistic, len(names), bounded)
    return EffectTest(
        effect,
        asked,
        gain=0.5 * statistic,
        chance=chance,
        adjusted=chance,
        values=values,
        shifts=dict(sorted(shifts.items(), key=lambda one: -abs(one[1]))),
    )
