"""The search behind a fit of a state-space model: several starts, each led to where logarithms can go down from."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.errors import IdentificationError
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.scoring import Optimum, Progress, Solver, minimise
from swashplate.identification.frequency.response_cost import (
    ACCEPTABLE,
    Answer,
    RelativeCost,
    ResponseCost,
    Target,
)
from swashplate.models.linear.state_space import StateSpaceModel

SPREAD = 0.3
"""Relative scatter of the starting points."""

SCREENED, STARTED = 48, 4
"""Shaken starts that are priced, and starts that are followed."""

_ROUGH = 25
"""Iterations of each start, before the best is followed to its end."""

_LED = 20
"""Iterations by relative errors, from a start that is far off."""

_ENOUGH = 1e-4
"""Share of the cost that an iteration has to gain for it to go on."""

_VERY_WRONG = 3e4
"""J that a response counts for at most when starts are compared: 30 dB and half a turn off."""

_WORTH = 1.5
"""Times that J_ave of what was seen may grow, and 1, for ceilings to be kept."""

_UNSEEN = 1e3
"""A parameter that starts at zero and would need more than this to answer alone is scaled by one."""


def pairs_of(model: StateSpaceModel, targets: Sequence[Target]) -> list[tuple[int, int, Array]]:
    """Output, input and frequencies [rad/s] of each target, as the model counts them."""
    return [(model.outputs.index(t.output), model.inputs.index(t.input), t.omega) for t in targets]


def answers(model: StateSpaceModel, targets: Sequence[Target]) -> list[Complex]:
    """The model's responses, one for each target at its frequencies (n,); NaN where they are not finite."""
    pairs = pairs_of(model, targets)
    grid, at = np.unique(np.concatenate([omega for *_, omega in pairs]), return_inverse=True)
    places = np.split(at, np.cumsum([omega.size for *_, omega in pairs])[:-1])
    try:
        h = model.response(grid)
    except np.linalg.LinAlgError:
        return [np.full(omega.size, np.nan + 0j) for *_, omega in pairs]
    return [h[place, o, i] for place, (o, i, _) in zip(places, pairs, strict=True)]


def cost_function(model: StateSpaceModel, targets: Sequence[Target], scale: Array) -> ResponseCost:
    """The cost of a model's free parameters, each scaled."""
    pairs, free = pairs_of(model, targets), model.free

    def evaluate(numbers: Array) -> tuple[list[Complex], list[Complex]]:
        responses, slopes = model.sensitivities(free, numbers, pairs)
        with np.errstate(divide="ignore", invalid="ignore"):
            return responses, [slope / h[:, None] for slope, h in zip(slopes, responses, strict=True)]

    return ResponseCost(_row(model, scale), targets, evaluate, _answering(model, targets))


def relative_cost(model: StateSpaceModel, targets: Sequence[Target], row: Row) -> RelativeCost:
    """The same cost by relative errors; no ceilings among the targets."""
    pairs, free = pairs_of(model, targets), model.free

    def evaluate(numbers: Array) -> tuple[list[Complex], list[Complex]]:
        return model.sensitivities(free, numbers, pairs)

    return RelativeCost(row, targets, evaluate, _answering(model, targets))


def _answering(model: StateSpaceModel, targets: Sequence[Target]) -> Answer:
    free = model.free
    return lambda numbers: answers(model.with_values(dict(zip(free, map(float, numbers), strict=True))), targets)


def _row(model: StateSpaceModel, scale: Array) -> Row:
    return Row(
        tuple(
            Entry(n, "parameter", p.value, float(s), p.lower, p.upper)
            for n, s in zip(model.free, scale, strict=True)
            for p in (model.parameters[n],)
        )
    )


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
    best, source, least = model, "", price_of(model, targets)
    for name, other in others.items():
        one = model.with_values({n: other.parameters[n].value for n in model.free})
        cost = price_of(one, targets)
        if cost < least:
            best, source, least = one, name, cost
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
    ends = []
    for row in candidates:
        row = _led(model, cost, np.clip(row, low, high))
        if np.isfinite(cost.cost(row)):
            rough = iterations if starts == 1 else min(_ROUGH, iterations)
            ends.append(_down(cost, start=row, tolerance=1e-2, iterations=rough, progress=progress))
    if not ends:
        raise IdentificationError(
            f"the start of '{model.name}' gives no finite response.", hint="Check the start values of the model file."
        )
    best = min(ends, key=lambda end: end.cost)
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
    enough = _WORTH * _mean_cost_of_responses(cost, alone) + 1.0
    fine = _ENOUGH * max(1.0, alone.cost)
    values, kept = alone.row * cost.row.scale, tuple(ceilings)
    while True:
        cost = cost_function(model, (*targets, *kept), cost.row.scale)
        end = _down(cost, start=values / cost.row.scale, tolerance=fine, iterations=iterations, progress=progress)
        over = _over(cost, end.row)
        if _mean_cost_of_responses(cost, end) <= enough or not kept:
            break
        over = over or _over(cost, values / cost.row.scale)
        worst = {name for name, j in over.items() if 2.0 * j >= max(over.values())}
        kept = tuple(c for c in kept if c.name not in worst) if worst else ()
    if over and len(kept) == len(ceilings):
        other, priced = search((*targets, *ceilings))
        if _mean_cost_of_responses(priced, other) <= enough and len(_over(priced, other.row)) < len(over):
            return other, priced, kept
    return replace(end, history=(*alone.history, *end.history[1:])), cost, kept


def _down(
    cost: ResponseCost, *, start: Array, tolerance: float, iterations: int, progress: Progress | None = None
) -> Optimum:
    """Downhill from a row; derivatives that hardly show must not shorten the steps of the others."""
    solver = Solver(tolerance=tolerance, iterations=iterations, around=True, progress=progress)
    return minimise(cost, solver, start=start)


def _mean_cost_of_responses(cost: ResponseCost, end: Optimum) -> float:
    """J_ave of the responses that were seen (not of those that may not be exceeded)."""
    return float(np.mean([j for j, t in zip(cost.each(end.row), cost.targets, strict=True) if not t.ceiling]))


def _over(cost: ResponseCost, row: Array) -> dict[str, float]:
    """J of the ceilings that a model stands above, by name."""
    each = zip(cost.each(row), cost.targets, strict=True)
    return {t.name: j for j, t in each if t.ceiling and j > ACCEPTABLE}


def led(model: StateSpaceModel, targets: Sequence[Target]) -> StateSpaceModel:
    """The model with numbers from which a descent in logarithms can begin."""
    cost = cost_function(model, targets, _scale(model, targets))
    row = _led(model, cost, cost.row.starts())
    return model.with_values(dict(zip(model.free, map(float, row * cost.row.scale), strict=True)))


def price_of(model: StateSpaceModel, targets: Sequence[Target]) -> float:
    """Sum of J at a model's own numbers, of which no response counts for more than what is very wrong."""
    cost = cost_function(model, targets, np.ones(len(model.free)))
    return _priced(cost, np.array([model.parameters[n].value for n in model.free]))


def _led(model: StateSpaceModel, cost: ResponseCost, row: Array) -> Array:
    """A row from which a descent in logarithms can begin: a start that is far off anywhere moves by relative errors."""
    each = zip(cost.each(row), cost.targets, strict=True)
    if max(j for j, t in each if not t.ceiling) <= ACCEPTABLE:
        return row
    far = relative_cost(model, [t for t in cost.targets if not t.ceiling], cost.row)
    if not np.isfinite(far.cost(row)):
        return row
    near = _down(far, start=row, tolerance=1.0, iterations=_LED).row
    return min((row, near), key=lambda one: _priced(cost, one))


def _priced(cost: ResponseCost, row: Array) -> float:
    """Sum of J, of which no response counts for more than what is very wrong."""
    each = np.nan_to_num(cost.each(row), nan=_VERY_WRONG, posinf=_VERY_WRONG)
    return float(np.sum(np.minimum(each, _VERY_WRONG)))
