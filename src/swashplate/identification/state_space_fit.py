"""State-space models from frequency responses: many starts, exact gradients, accuracy figures, J per response."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from swashplate.errors import IdentificationError
from swashplate.flights.flight import Array
from swashplate.identification.frequency_response import LEAST_COHERENCE, TWO_PI, FrequencyResponse
from swashplate.identification.linear_start import other_starts
from swashplate.identification.response_cost import (
    ACCEPTABLE,
    ParameterAccuracy,
    ResponseCost,
    Target,
    accuracy_of,
    ceiling,
    target,
)
from swashplate.identification.rows import Entry, Row
from swashplate.identification.scoring import Optimum, minimise
from swashplate.identification.spectra import Complex
from swashplate.identification.state_space import StateSpaceModel
from swashplate.identification.state_space_result import StateSpaceFit
from swashplate.identification.state_space_words import words

FAST_GROWTH = 1.0
"""1/s: a start model with a mode that grows faster is no helicopter, but a wrong sign."""

SPREAD = 0.3
"""Relative scatter of the starting points."""

SCREENED, STARTED = 48, 4

_ROUGH = 25
"""Iterations of each start, before the best is followed to its end."""

RESCUES, RESCUED, _HOPE = 4, 96, 0.99
"""Times that a bad end is shaken hard, points that are tried then, and what has to be left of the cost at most."""

_HARD, _TURNED = 0.4, 0.08
"""Relative scatter of these points, and the share of parameters whose sign is turned."""

_ENOUGH = 1e-4
"""Share of the cost that an iteration has to gain for it to go on."""

_UPPER, _POINTS = 3.0, 5
"""Times the lowest frequency from which a fit to the upper ones begins, and how many points a response keeps there."""

_VERY_WRONG = 3e4
"""J that a response counts for at most when starts are compared: 30 dB and half a turn off."""

_UNSEEN = 1e3
"""A parameter that starts at zero and would need more than this to answer alone is scaled by one."""


def fit_state_space(
    model: StateSpaceModel,
    responses: FrequencyResponse,
    *,
    band: tuple[float, float] | None = None,
    bands: Mapping[str, tuple[float, float]] | None = None,
    least_coherence: float = LEAST_COHERENCE,
    starts: int = STARTED,
    iterations: int = 100,
    seed: int = 0,
    progress: Callable[[int, float], None] | None = None,
) -> StateSpaceFit:
    """Fit a model's free parameters to every coherent response that the model and the flight share.

    Args:
        model: structure and start values.
        responses: from `respond`, with channels named as in the model.
        band: limits [Hz] for all pairs. bands: by "output/input" or input.
        least_coherence: from which a response is used.
        starts: how many of the screened starting points are followed (1: the given start alone).
        iterations: at most this many for the best of them.
        seed: of the starting points.
        progress: called with the iteration and the cost.

    Raises:
        IdentificationError: channels that do not meet, no coherent response, parameters without a trace.
    """
    began = time.perf_counter()
    if not model.free:
        raise IdentificationError("every parameter is fixed or tied: there is nothing to fit.", channel=model.name)
    targets, ceilings, left_out = _targets(model, responses, band, bands or {}, least_coherence)
    others = {} if starts == 1 else other_starts(model, responses, targets, band=band)
    return fit_targets(
        model,
        targets,
        others=others,
        ceilings=ceilings,
        left_out=left_out,
        starts=starts,
        iterations=iterations,
        seed=seed,
        progress=progress,
        began=began,
        settings={
            "sources": list(responses.sources),
            "method": responses.method,
            "least_coherence": least_coherence,
            "band_hz": list(band) if band else None,
            "starts": starts,
            "seed": seed,
        },
    )


def _targets(
    model: StateSpaceModel,
    responses: FrequencyResponse,
    band: tuple[float, float] | None,
    bands: Mapping[str, tuple[float, float]],
    least: float,
) -> tuple[list[Target], list[Target], tuple[str, ...]]:
    shared_in = [name for name in model.inputs if name in responses.inputs]
    shared_out = [name for name in model.outputs if name in responses.outputs]
    if not shared_in or not shared_out:
        raise IdentificationError(
            f"the model has inputs {', '.join(model.inputs)} and outputs {', '.join(model.outputs)}; the responses "
            f"have {', '.join(responses.inputs)} and {', '.join(responses.outputs)}: they share nothing to fit.",
            where=f"model '{model.name}'"
            + (f", responses of {', '.join(responses.sources)}" if responses.sources else ""),
            hint="Name the channels as the model does (swash respond --inputs NAME=CHANNEL), or take another model.",
        )
    found, ceilings, missing = [], [], []
    for output in shared_out:
        for name in shared_in:
            own = bands.get(f"{output}/{name}", bands.get(name, band))
            one = target(responses, output, name, band=own, least=least)
            if one is None:
                missing.append(f"{output} / {name}")
                limit = ceiling(responses, output, name, band=own)
                ceilings += [] if limit is None else [limit]
            else:
                found.append(one)
    if not found:
        raise IdentificationError(
            f"no response keeps a coherence of {least:g} over a band: {', '.join(missing)}.",
            hint="Nothing can be fitted; look at the responses and fly a better sweep.",
        )
    return found, ceilings, tuple(missing)


def fit_targets(
    model: StateSpaceModel,
    targets: Sequence[Target],
    *,
    others: Mapping[str, StateSpaceModel] | None = None,
    ceilings: Sequence[Target] = (),
    left_out: tuple[str, ...] = (),
    starts: int = STARTED,
    iterations: int = 100,
    seed: int = 0,
    progress: Callable[[int, float], None] | None = None,
    began: float | None = None,
    settings: Mapping[str, Any] | None = None,
) -> StateSpaceFit:
    """Fit a model to given targets, below given ceilings, from the given start or a better one (`fit_state_space`)."""
    began = time.perf_counter() if began is None else began
    warnings, problems = [], _start_problems(model)
    traceless = _traceless(model, targets)
    if traceless:
        warnings.append(f"no fitted response sees {', '.join(traceless)}: held at the start values.")
        model = model.with_values({n: model.parameters[n].value for n in traceless}, free=False)
    if not model.free:
        raise IdentificationError(
            f"no fitted response sees a free parameter of '{model.name}'.",
            hint="Fit other responses or free parameters.",
        )
    every_target = (*targets, *ceilings)
    start, source = _better(model, others or {}, every_target)
    optimum, cost = _best(start, every_target, starts=starts, iterations=iterations, seed=seed, progress=progress)
    numbers = optimum.row * cost.row.scale
    _, slopes = cost.residuals(optimum.row)
    cramer_rao, insensitivity, correlation = accuracy_of(slopes / cost.row.scale)
    found = model.with_values(dict(zip(model.free, map(float, numbers), strict=True)))
    found = replace(
        found,
        parameters={
            name: replace(
                p,
                cramer_rao=float(cramer_rao[model.free.index(name)]),
                insensitivity=float(insensitivity[model.free.index(name)]),
            )
            if name in model.free
            else p
            for name, p in found.parameters.items()
        },
    )
    every = cost.each(optimum.row)
    costs = tuple(every[: len(targets)])
    parameters = tuple(
        ParameterAccuracy(
            name=name,
            unit=p.unit,
            start=model.parameters[name].value,
            value=p.value,
            cramer_rao=p.cramer_rao,
            insensitivity=p.insensitivity,
            tie=p.tie.text if p.tie is not None else "",
            fixed=not p.free and p.tie is None,
            at_bound=name in optimum.at_bound,
        )
        for name, p in found.parameters.items()
    )
    warnings += words(targets, costs, parameters, correlation, at_bound=optimum.at_bound, converged=optimum.converged)
    over = [c.name for c, above in zip(ceilings, every[len(targets) :], strict=True) if above > ACCEPTABLE]
    if over:
        warnings.append(f"the model answers where the flight shows nothing: {', '.join(over)}.")
    return StateSpaceFit(
        model=found,
        start=model,
        targets=tuple(targets),
        ceilings=tuple(ceilings),
        costs=costs,
        parameters=parameters,
        free=model.free,
        correlation=correlation,
        history=optimum.history,
        converged=optimum.converged,
        warnings=tuple(warnings),
        problems=tuple(problems),
        left_out=left_out,
        seconds=time.perf_counter() - began,
        settings={**dict(settings or {}), "started_from": source or "given values"},
    )


def _better(
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


def _pairs(model: StateSpaceModel, targets: Sequence[Target]) -> list[tuple[int, int, Array]]:
    return [(model.outputs.index(t.output), model.inputs.index(t.input), t.omega) for t in targets]


def cost_function(model: StateSpaceModel, targets: Sequence[Target], scale: Array) -> ResponseCost:
    """The cost of a model's free parameters, each scaled."""
    pairs, free = _pairs(model, targets), model.free

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
    _, slopes = model.sensitivities(model.free, values + 1e-9 * (values == 0.0), _pairs(model, targets))
    with np.errstate(divide="ignore"):
        needed = [
            np.median(np.abs(t.measured)[:, None] / np.abs(s), axis=0) for t, s in zip(targets, slopes, strict=True)
        ]
    alone = np.min(needed, axis=0)
    # What hardly shows must not run away on a scale of its own making.
    return np.where(values != 0.0, np.abs(values), np.where(alone < _UNSEEN, alone, 1.0))


def _traceless(model: StateSpaceModel, targets: Sequence[Target]) -> tuple[str, ...]:
    """Free parameters that leave no trace in any fitted response, at the start and at a shaken one."""
    random = np.random.default_rng(1)
    seen = np.zeros(len(model.free))
    for shake in (0.0, 0.1):
        values = np.array([model.parameters[n].value for n in model.free])
        values = values * (1.0 + shake * random.standard_normal(values.size)) + (values == 0.0) * shake * 0.1
        _, slopes = model.sensitivities(model.free, values, _pairs(model, targets))
        seen += np.sum([np.nan_to_num(np.abs(s)).max(axis=0) for s in slopes], axis=0)
    return tuple(name for name, trace in zip(model.free, seen, strict=True) if trace < 1e-12)


def _start_problems(model: StateSpaceModel) -> list[str]:
    growing = [v for v in model.eigenvalues() if v.real > FAST_GROWTH]
    if not growing:
        return []
    worst = max(growing, key=lambda v: v.real)
    return [
        f"the start model '{model.name}' is unstable: a mode at {worst.real:+.2f}{worst.imag:+.2f}j 1/s doubles every "
        f"{np.log(2) / worst.real:.2f} s, which no helicopter does. Check the signs of the start values."
    ]


def _best(
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
            ends.append(minimise(cost, start=row, tolerance=1e-2, iterations=rough, progress=progress))
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
    final = minimise(
        cost, start=best.row, tolerance=_ENOUGH * max(1.0, best.cost), iterations=iterations, progress=progress
    )
    return replace(final, history=(*best.history, *final.history[1:])), cost


def _bad(cost: ResponseCost, best: Optimum) -> bool:
    """Whether the responses that were seen (not those that may not be exceeded) are badly fitted on average."""
    seen = [j for j, t in zip(cost.each(best.row), cost.targets, strict=True) if not t.ceiling]
    return float(np.mean(seen)) > ACCEPTABLE


def _from_above(model: StateSpaceModel, cost: ResponseCost, best: Optimum, *, starts: int, seed: int) -> Optimum:
    """A better end than a bad one, from a fit to the upper frequencies: slow responses are the least sure, and can hold
    a search where the fast modes are wrong."""
    least = _UPPER * min(float(t.omega[0]) for t in cost.targets)
    upper = [part for t in cost.targets if (part := t.above(least)).omega.size >= _POINTS]
    if all(t.ceiling for t in upper):
        return best
    end, other = _best(model, upper, starts=starts, iterations=_ROUGH, seed=seed, progress=None)
    row = end.row * other.row.scale / cost.row.scale
    if not np.isfinite(cost.cost(row)):
        return best
    return min((best, minimise(cost, start=row, tolerance=1e-2, iterations=_ROUGH)), key=lambda one: one.cost)


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
    ends = [minimise(cost, start=row, tolerance=1e-2, iterations=_ROUGH) for row in hopeful]
    return min((best, *ends), key=lambda end: end.cost)


def frequencies(targets: Sequence[Target]) -> tuple[float, float]:
    """Lowest and highest fitted frequency [Hz]."""
    return min(t.omega[0] for t in targets) / TWO_PI, max(t.omega[-1] for t in targets) / TWO_PI
