"""Guided reduction of a model's structure: what the responses do not tell is taken out, one parameter at a time."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from swashplate.errors import IdentificationError
from swashplate.identification.response_cost import ParameterAccuracy
from swashplate.identification.state_space_fit import fit_targets
from swashplate.identification.state_space_result import StateSpaceFit, Step
from swashplate.identification.state_space_words import CR_TARGET, I_TARGET

GROWTH, LEAST_GROWTH = 0.05, 0.5
"""J_ave may grow by this share, or by this much, for a drop to stand."""

HOPELESS = 100.0
"""Percent of Cramér-Rao bound above which a parameter that cannot be dropped is held at its start, if that does."""


def reduce(fit: StateSpaceFit, *, progress: Callable[[int, float], None] | None = None) -> StateSpaceFit:
    """The fit with what the responses do not tell taken out (Tischler and Remple 2012, ch. 13).

    The most insensitive parameter above 10 % first, then the one with the largest Cramér-Rao bound above 20 %; refit;
    a drop stands if J_ave hardly grows, otherwise the parameter is put back and not tried again.

    A dropped parameter takes the value `dropped` of the model file (zero where nothing is said). One that cannot be
    dropped, but whose bound is above 100 %, stands for a product that alone is seen: it is held at its start value.
    """
    began = time.perf_counter()
    history: list[Step] = list(fit.reduction)
    tried: set[str] = set()
    present = fit
    while True:
        choice = _candidate(present, tried)
        if choice is None:
            break
        name, reason = choice
        tried.add(name)
        ways = [("", present.model.parameters[name].dropped)]
        if present[name].cramer_rao_percent > HOPELESS:
            ways.append((", held at its start", fit[name].start))
        for remark, value in ways:
            new = _without(present, name, value)
            allowed = present.cost + max(LEAST_GROWTH, GROWTH * present.cost)
            after = float("inf") if new is None else new.cost
            kept = new is not None and after <= allowed
            history.append(Step(name, reason + remark, present.cost, after, kept))
            if progress is not None:
                progress(len(history), after)
            if new is not None and kept:
                present = new
                break
    parameters = tuple(replace(p, start=fit[p.name].start) for p in present.parameters)
    return replace(
        present,
        start=fit.start,
        parameters=parameters,
        reduction=tuple(history),
        settings={**present.settings, "reduced": True},
        problems=fit.problems,
        seconds=fit.seconds + time.perf_counter() - began,
    )


def _without(fit: StateSpaceFit, name: str, value: float) -> StateSpaceFit | None:
    """The fit again with one parameter held at a value; None where nothing answers then."""
    model = fit.model.with_values({name: value}, free=False)
    if not model.free:
        return None
    try:
        return fit_targets(
            model, fit.targets, ceilings=fit.ceilings, left_out=fit.left_out, starts=1, settings=fit.settings
        )
    except (IdentificationError, np.linalg.LinAlgError):
        return None


def _candidate(fit: StateSpaceFit, tried: set[str]) -> tuple[str, str] | None:
    moving = [p for p in fit.parameters if not p.fixed and not p.tie and p.name not in tried]

    def insensitivity(p: ParameterAccuracy) -> float:
        return p.insensitivity_percent

    blind = [p for p in moving if p.insensitivity_percent > I_TARGET]
    if blind:
        worst = max(blind, key=insensitivity)
        return worst.name, f"insensitivity {worst.insensitivity_percent:.0f} %"
    vague = [p for p in moving if p.cramer_rao_percent > CR_TARGET]
    if vague:
        worst = max(vague, key=lambda p: p.cramer_rao_percent)
        return worst.name, f"Cramér-Rao bound {worst.cramer_rao_percent:.0f} %"
    return None
