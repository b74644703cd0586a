"""The search behind a fit of a state-space model: many starts, and ways out of a bad end."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.errors import IdentificationError
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.scoring import Optimum, minimise
from swashplate.identification.frequency.response_cost import ACCEPTABLE, ResponseCost, Target
from swashplate.models.linear.state_space import StateSpaceModel

SPREAD = 0.3
"""Relative scatter of the starting points."""

SCREENED, STARTED = 48, 4
"""Shaken starts that are priced, and starts that are followed."""

_ROUGH = 25
"""Iterations of each start, before the best is followed to its end."""

RESCUES, RESCUED, _HOPE = 4, 96, 0.99
"""Times that a bad end is shaken hard, points that are tried then, and what has to be left of the cost at most."""

_HARD, _TURNED = 0.4, 0.08
"""Relative scatter of these points, and the share of parameters whose sign is turned."""

FREED, _FEW = 3, 0.25
"""Times that a few badly fitted responses are left out for a while, and the share of all that is a few."""

_ENOUGH = 1e-4
"""Share of the cost that an iteration has to gain for it to go on."""

_UPPER, _POINTS = 3.0, 5
"""Times the lowest frequency from which a fit to the upper ones begins, and how many points a response keeps there."""

_VERY_WRONG = 3e4
"""J that a response counts for at most when starts are compared: 30 dB and half a turn off."""

_WORTH = 1.5
"""Times that J_ave of what was seen may grow, and 1, for ceilings to be kept."""

_UNSEEN = 1e3
"""A parameter that starts at zero and would need more than this to answer alone is scaled by one."""


def pairs_of(model: StateSpaceModel, targets: Sequence[Target]) -> list[tuple[int, int, Array]]:
    """Output, input and frequencies [rad/s] of each target, as the model counts them."""
    return [(model.outputs.index(t.output), model.inputs.index(t.input), t.omega) for t in targets]


def cost_function(model: StateSpaceModel, targets: Sequence[Target], scale: Array) -> ResponseCost:
    """The cost of a model's free parameters, each scaled."""
    pairs, free = pairs_of(model, targets), model.free

    def evaluate(numbers: Array) -> tuple[list[Complex], list[Complex]]:
        responses, slopes = model.sensitivities(free, numbers, pairs)
        with np.errstate(divide="ignore", invalid="ignore"):
            return responses, [slope / h[:, None] for slope, h in zip(slopes, responses, strict=True)]

    entries = tuple(
        Entry(n, "parameter", p.value, float(s), p.lower, p.upper)
        for n, s in zip(free, scale, strict=True)
        for p in (model.parameters[n],)
    )
    return ResponseCost(Row(entries), targets, evaluate)


def _scale(model: StateSpaceModel, targets: Sequence[Target]) -> Array:
    """A change of the order that matters: the value, or what alone would make a response that starts at zero."""
    values = np.array([model.parameters[n].value for n in model.free])
    _, slopes = model.sensitivities(model.free, values + 1e-9 * (values == 0.0), pairs_of(model, targets))
    with np.errstate(divide="ignore"):
        needed = [
            np.median(np.abs(t.measured)[:, None] / np.abs(s), axis=0) for t, s in zip(targets, slopes, strict=True)
        ]
    alone = np.min(needed, axis=0)
    # What hardly shows must not run away on a scale of its own making.
    return np.where(values != 0.0, np.abs(values), np.where(alone < _UNSEEN, alone, 1.0))


def better_start(
    model: StateSpaceModel, others: Mapping[str, StateSpaceModel], targets: Sequence[Target]
) -> tuple[StateSpaceModel, str]:
    """The start that costs least, with its source ("" for the given one); zero responses count as very wrong."""

    def price(one: StateSpaceModel) -> float:
        row = cost_function(one, targets, np.ones(len(model.free)))
        each = row.each(np.array([one.parameters[n].value for n in model.free]))
        return float(sum(min(cost, _VERY_WRONG) if np.isfinite(cost) else _VERY_WRONG for cost in each))

    best, source, least = model, "", price(model)
    for name, other in others.items():
        one = model.with_values({n: other.parameters[n].value for n in model.free})
        if price(one) < least:
            best, source, least = one, name, price(one)
    return best, source


def best_end(
    model: StateSpaceModel,
    targets: Sequence[Target],
    *,
    starts: int,
    iterations: int,
    seed: int,
    progress: Callable[[int, float], None] | None,
) -> tuple[Optimum, ResponseCost]:
    """The best end of several starts: the given one, and the cheapest of many shaken ones followed for a while."""
    cost = cost_function(model, targets, _scale(model, targets))
    first = cost.row.starts()
    low, high = cost.row.bounds()
    candidates = [first]
    if starts > 1:
        random = np.random.default_rng(seed)
        shaken = first * np.exp(SPREAD * random.standard_normal((SCREENED, first.size)))
        shaken = np.where(first == 0.0, SPREAD * random.standard_normal(shaken.shape), shaken)
        shaken = np.clip(shaken, low, high)
        price = np.array([cost.cost(row) for row in shaken])
        candidates += [shaken[k] for k in np.argsort(price)[: starts - 1] if np.isfinite(price[k])]
    elif not np.isfinite(cost.cost(np.clip(first, low, high))):
        # A response that starts at zero has no decibels: give what makes it a small value of its own.
        candidates = [np.where(first == 0.0, 0.1 * SPREAD, first)]
    ends = []
    for row in candidates:
        if np.isfinite(cost.cost(np.clip(row, low, high))):
            rough = iterations if starts == 1 else min(_ROUGH, iterations)
            ends.append(_down(cost, start=row, tolerance=1e-2, iterations=rough, progress=progress))
    if not ends:
        raise IdentificationError(
            f"the start of '{model.name}' gives no finite response.", hint="Check the start values of the model file."
        )
    best = min(ends, key=lambda end: end.cost)
    if starts > 1 and iterations > _ROUGH and _bad(cost, best):
        best = _from_above(model, cost, best, starts=starts, seed=seed)
    for turn in range(RESCUES if starts > 1 and iterations > _ROUGH else 0):
        if not _bad(cost, best):
            break
        before, best = best, _rescued(cost, best, seed=seed + 1 + turn)
        if best.cost > _HOPE * before.cost:
            break
    if iterations > _ROUGH:
        best = _freed(model, cost, best)
    final = _down(
        cost, start=best.row, tolerance=_ENOUGH * max(1.0, best.cost), iterations=iterations, progress=progress
    )
    return replace(final, history=(*best.history, *final.history[1:])), cost


def best_below(
    model: StateSpaceModel,
    targets: Sequence[Target],
    ceilings: Sequence[Target],
    *,
    starts: int,
    iterations: int,
    seed: int,
    progress: Callable[[int, float], None] | None,
) -> tuple[Optimum, ResponseCost, tuple[Target, ...]]:
    """The best end for what was seen, then below the ceilings, with the ceilings that stood.

    A ceiling that is too low (a pair's response at low coherence may be anything) holds a search away from the truth.
    So what was seen is searched first; ceilings that it contradicts are given up.
    """

    def search(wanted: Sequence[Target]) -> tuple[Optimum, ResponseCost]:
        return best_end(model, wanted, starts=starts, iterations=iterations, seed=seed, progress=progress)

    if starts == 1 or not ceilings:
        return *search((*targets, *ceilings)), tuple(ceilings)
    alone, cost = search(targets)
    enough = _WORTH * _seen(cost, alone) + 1.0
    fine = _ENOUGH * max(1.0, alone.cost)
    values, kept = alone.row * cost.row.scale, tuple(ceilings)
    while True:
        cost = cost_function(model, (*targets, *kept), cost.row.scale)
        end = _down(cost, start=values / cost.row.scale, tolerance=fine, iterations=iterations, progress=progress)
        over = _over(cost, end.row)
        if _seen(cost, end) <= enough or not kept:
            break
        over = over or _over(cost, values / cost.row.scale)
        worst = {name for name, j in over.items() if 2.0 * j >= max(over.values())}
        kept = tuple(c for c in kept if c.name not in worst) if worst else ()
    if over and len(kept) == len(ceilings):
        other, priced = search((*targets, *ceilings))
        if _seen(priced, other) <= enough and len(_over(priced, other.row)) < len(over):
            return other, priced, kept
    return replace(end, history=(*alone.history, *end.history[1:])), cost, kept


def _down(cost: ResponseCost, **how: Any) -> Optimum:
    """Downhill from a row; derivatives that hardly show must not shorten the steps of the others."""
    return minimise(cost, around=True, **how)


def _seen(cost: ResponseCost, end: Optimum) -> float:
    """J_ave of the responses that were seen (not of those that may not be exceeded)."""
    return float(np.mean([j for j, t in zip(cost.each(end.row), cost.targets, strict=True) if not t.ceiling]))


def _over(cost: ResponseCost, row: Array) -> dict[str, float]:
    """J of the ceilings that a model stands above, by name."""
    each = zip(cost.each(row), cost.targets, strict=True)
    return {t.name: j for j, t in each if t.ceiling and j > ACCEPTABLE}


def _bad(cost: ResponseCost, best: Optimum) -> bool:
    """Whether the responses that were seen are badly fitted on average."""
    return _seen(cost, best) > ACCEPTABLE


def _from_above(model: StateSpaceModel, cost: ResponseCost, best: Optimum, *, starts: int, seed: int) -> Optimum:
    """A better end than a bad one, from a fit to the upper frequencies: slow responses are the least sure, and can hold
    a search where the fast modes are wrong."""
    least = _UPPER * min(float(t.omega[0]) for t in cost.targets)
    upper = [part for t in cost.targets if (part := t.above(least)).omega.size >= _POINTS]
    if all(t.ceiling for t in upper):
        return best
    end, other = best_end(model, upper, starts=starts, iterations=_ROUGH, seed=seed, progress=None)
    row = end.row * other.row.scale / cost.row.scale
    if not np.isfinite(cost.cost(row)):
        return best
    return min((best, _down(cost, start=row, tolerance=1e-2, iterations=_ROUGH)), key=lambda one: one.cost)


def _freed(model: StateSpaceModel, cost: ResponseCost, best: Optimum) -> Optimum:
    """A better end than one that a few responses hold in a trap (a phase on the wrong side of half a turn): they are
    left out until the others have settled."""
    for _ in range(FREED):
        each = list(zip(cost.each(best.row), cost.targets, strict=True))
        poor = [t for j, t in each if j > ACCEPTABLE and not t.ceiling]
        if not 0 < len(poor) <= _FEW * len(each):
            break
        others = cost_function(model, [t for _, t in each if not any(t is one for one in poor)], cost.row.scale)
        rest = _down(others, start=best.row, tolerance=1.0, iterations=_ROUGH)
        if not np.isfinite(cost.cost(rest.row)):
            break
        end = _down(cost, start=rest.row, tolerance=1.0, iterations=_ROUGH)
        if end.cost > _HOPE * best.cost:
            break
        best = end
    return best


def _rescued(cost: ResponseCost, best: Optimum, *, seed: int) -> Optimum:
    """A better end than a bad one, from points around it that are shaken hard and have some signs turned."""
    random = np.random.default_rng(seed)
    low, high = cost.row.bounds()
    shape = (RESCUED, best.row.size)
    turned = np.where(random.random(shape) < _TURNED, -1.0, 1.0)
    shaken = np.clip(best.row * turned * np.exp(_HARD * random.standard_normal(shape)), low, high)

    def price(row: Array) -> float:
        each = np.nan_to_num(cost.each(row), nan=_VERY_WRONG, posinf=_VERY_WRONG)
        return float(np.sum(np.minimum(each, _VERY_WRONG))) if np.isfinite(cost.cost(row)) else np.inf

    prices = np.array([price(row) for row in shaken])
    hopeful = [shaken[k] for k in np.argsort(prices)[:STARTED] if np.isfinite(prices[k])]
    ends = [_down(cost, start=row, tolerance=1e-2, iterations=_ROUGH) for row in hopeful]
    return min((best, *ends), key=lambda end: end.cost)
