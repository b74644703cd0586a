"""State-space models fitted to frequency responses: what is fitted, how well it is told, J per response."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.flights.excitation import OUTSIDE
from swashplate.identification.core.result import Estimate, Result
from swashplate.identification.core.sources import DataSource, scale_words
from swashplate.identification.estimators import Data, Question
from swashplate.identification.frequency.fit_accuracy import accuracy_of_fit
from swashplate.identification.frequency.fitted_pairs import PairChoice
from swashplate.identification.frequency.linear_start import from_core, other_starts
from swashplate.identification.frequency.mode_accuracy import mode_accuracy
from swashplate.identification.frequency.response_cost import (
    ACCEPTABLE,
    NOT_FOLLOWED,
    ResponseComparison,
    Target,
    followed,
)
from swashplate.identification.frequency.state_space_result import StateSpaceDetails, StateSpaceFit, fit_warnings
from swashplate.identification.frequency.state_space_search import STARTED, best_below, better_start, pairs_of
from swashplate.identification.frequency.structure_score import misfit_words
from swashplate.identification.responses.frequency_response import LEAST_COHERENCE, TWO_PI, FrequencyResponse
from swashplate.models.linear.linear_vehicle import structure_of
from swashplate.models.linear.model_units import unit_words
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle

FAST_GROWTH = 1.0
"""1/s: a start model with a mode that grows faster is no helicopter, but a wrong sign."""


def fit_state_space(
    model: Vehicle | StateSpaceModel,
    responses: FrequencyResponse,
    *,
    band: tuple[float, float] | None = None,
    bands: Mapping[str, tuple[float, float]] | None = None,
    without: Sequence[str] = (),
    least_coherence: float = LEAST_COHERENCE,
    starts: int = STARTED,
    iterations: int = 100,
    seed: int = 0,
    progress: Callable[[int, float], None] | None = None,
) -> StateSpaceFit:
    """Fit a model's free parameters to every coherent response that the model and the flight share.

    Args:
        model: structure and start values: a vehicle of `swashplate.structure`, or what it is made of.
        responses: from `respond`, with channels named as in the model.
        band: limits [Hz] for all pairs. bands: for some, by "output/input", input or output.
        without: pairs that are not used, by the same names.
        least_coherence: from which a response is used.
        starts: how many of the screened starting points are followed (1: the given start alone).
        iterations: at most this many for the best of them.
        seed: of the starting points.
        progress: called with the iteration and the cost.

    Raises:
        IdentificationError: channels that do not meet, no coherent response, parameters without a trace, a band for
            a pair that is none.
    """
    began = time.perf_counter()
    model = structure_of(model)
    if not model.free:
        raise IdentificationError("every parameter is fixed or tied: there is nothing to fit.", channel=model.name)
    model = model.with_unmoved(unmoved_inputs(responses))
    choice = PairChoice(band, bands or {}, tuple(without), least_coherence)
    targets, ceilings, left_out = choice.targets(model, responses)
    others = {}
    if starts > 1:
        others = other_starts(model, responses, targets, band=band) | from_core(model, responses, band=band)
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
        data=responses.data,
        settings={
            "sources": list(responses.sources),
            "method": responses.method,
            **choice.settings(),
            "starts": starts,
            "seed": seed,
        },
    )


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
    advise: bool = True,
    data: Sequence[DataSource] = (),
    settings: Mapping[str, Any] | None = None,
) -> StateSpaceFit:
    """Fit a model to given targets, below given ceilings, from the given start or a better one (`fit_state_space`).

    Args:
        advise: whether to say which parts a structure that misses the responses may lack.
    """
    began = time.perf_counter() if began is None else began
    warnings, problems = [], _start_problems(model)
    traceless, heard = _traces(model, targets)
    unheard = [t for t, size in zip(targets, heard, strict=True) if size == 0.0]
    if unheard:
        raise IdentificationError(
            f"the structure '{model.name}' answers nothing at all at {', '.join(t.name for t in unheard)}, which the "
            "flight shows.",
            hint="Take a structure that joins them, or leave them out: "
            + " ".join(f"--settings without={t.output}/{t.input}" for t in unheard),
        )
    if traceless:
        warnings.append(f"no fitted response sees {', '.join(traceless)}: held at the start values.")
        model = model.with_values({n: model.parameters[n].value for n in traceless}, free=False)
    if not model.free:
        raise IdentificationError(
            f"no fitted response sees a free parameter of '{model.name}'.",
            hint="Fit other responses or free parameters.",
        )
    start, source = better_start(model, others or {}, (*targets, *ceilings))
    optimum, cost, kept = best_below(
        start, targets, ceilings, starts=starts, iterations=iterations, seed=seed, progress=progress
    )
    numbers = optimum.row * cost.row.scale
    accuracy = accuracy_of_fit(cost, optimum.row)
    sizes = zip(model.free, map(float, accuracy.sigma), map(float, accuracy.insensitivity), strict=True)
    fitted = model.with_values(dict(zip(model.free, map(float, numbers), strict=True))).with_bounds(
        {name: (sigma, alone) for name, sigma, alone in sizes}
    )
    every = cost.each(optimum.row)
    costs = tuple(every[: len(targets)])
    estimates = tuple(
        Estimate(
            name=name,
            unit=p.unit,
            start=model.parameters[name].value,
            value=p.value,
            sigma=p.cramer_rao if p.free else np.nan,
            insensitivity=p.insensitivity if p.free else np.nan,
            tie=p.tie.text if p.tie is not None else "",
            fixed=not p.free and p.tie is None,
            at_bound=name in optimum.at_bound,
        )
        for name, p in fitted.parameters.items()
    )
    warnings += unit_words(model)
    warnings += misfit_words(fitted, targets, advise=advise)
    warnings += fit_warnings(
        targets, costs, estimates, accuracy.correlation, at_bound=optimum.at_bound, converged=optimum.converged
    )
    warnings += accuracy.warnings
    below = {c.name for c, above in zip(kept, every[len(targets) :], strict=True) if above <= ACCEPTABLE}
    over = [c.name for c in ceilings if c.name not in below]
    if over:
        warnings.append(f"the model answers where the flight shows nothing: {', '.join(over)}.")
    answers, _ = cost.evaluate(optimum.row)
    failed = not followed(numbers, costs)
    problems += [NOT_FOLLOWED] if failed else []
    return Result(
        method="frequency responses",
        solution=fitted,
        start=model,
        estimates=estimates,
        names=model.free,
        covariance=accuracy.covariance,
        covariance_corrected=np.full_like(accuracy.covariance, np.nan),
        directions=accuracy.directions,
        failed=failed,
        correlation=accuracy.correlation,
        details=StateSpaceDetails(
            left_out=left_out,
            ceilings=tuple(ceilings),
            modes=mode_accuracy(
                fitted,
                dict(zip(model.free, map(float, accuracy.sigma), strict=True)),
                accuracy.correlation,
                lowest=min(float(t.omega[0]) for t in targets),
            ),
        ),
        history=optimum.history,
        converged=optimum.converged,
        warnings=tuple(warnings),
        problems=(*problems, *scale_words(data)),
        comparisons=tuple(
            ResponseComparison(t, np.asarray(h), j) for t, h, j in zip(targets, answers, costs, strict=False)
        ),
        data=tuple(data),
        settings={**dict(settings or {}), "started_from": source or "given values"},
        seconds=time.perf_counter() - began,
    )


def unmoved_inputs(responses: FrequencyResponse) -> list[str]:
    """Inputs of which the responses say that nothing moved them from outside."""
    excited, channels = responses.settings.get("excitation", {}), responses.settings.get("channels", {})
    kinds = {name: excited.get(name, excited.get(channels.get(name), {})).get("kind") for name in responses.inputs}
    return [name for name, kind in kinds.items() if kind is not None and kind not in OUTSIDE]


def silent(model: StateSpaceModel, targets: Sequence[Target]) -> tuple[tuple[str, str], ...]:
    """Output and input of the responses that are zero whatever the numbers."""
    _, heard = _traces(model, targets)
    return tuple((t.output, t.input) for t, size in zip(targets, heard, strict=True) if size == 0.0)


def _traces(model: StateSpaceModel, targets: Sequence[Target]) -> tuple[tuple[str, ...], Array]:
    """Free parameters without a trace in any fitted response, and how large each response is, at the start and a shaken
    one."""
    random = np.random.default_rng(1)
    traces, heard = np.zeros(len(model.free)), np.zeros(len(targets))
    for shake in (0.0, 0.1):
        values = np.array([model.parameters[n].value for n in model.free])
        values = values * (1.0 + shake * random.standard_normal(values.size)) + (values == 0.0) * shake * 0.1
        answers, slopes = model.sensitivities(model.free, values, pairs_of(model, targets))
        heard += [np.nan_to_num(np.abs(h), nan=1.0).max() for h in answers]
        traces += np.sum([np.nan_to_num(np.abs(s)).max(axis=0) for s in slopes], axis=0)
    return tuple(name for name, trace in zip(model.free, traces, strict=True) if trace < 1e-12), heard


def _start_problems(model: StateSpaceModel) -> list[str]:
    growing = [v for v in model.eigenvalues() if v.real > FAST_GROWTH]
    if not growing:
        return []
    worst = max(growing, key=lambda v: v.real)
    return [
        f"the start model '{model.name}' is unstable: a mode at {worst.real:+.2f}{worst.imag:+.2f}j 1/s doubles every "
        f"{np.log(2) / worst.real:.2f} s, which no helicopter does. Check the signs of the start values."
    ]


def frequencies(targets: Sequence[Target]) -> tuple[float, float]:
    """Lowest and highest fitted frequency [Hz]."""
    return min(t.omega[0] for t in targets) / TWO_PI, max(t.omega[-1] for t in targets) / TWO_PI


@dataclass(frozen=True)
class ResponseEstimator:
    """`fit_state_space` as an estimator."""

    takes: frozenset[str] = frozenset({"iterations"})

    def unsuited(self, model: Vehicle | StateSpaceModel, data: Data) -> str:
        if not isinstance(data, FrequencyResponse):
            return "it fits frequency responses"
        return "" if isinstance(model, StateSpaceModel) else "it fits state-space models"

    def estimate(self, model: StateSpaceModel, data: FrequencyResponse, question: Question) -> StateSpaceFit:
        iterations = 100 if question.iterations is None else question.iterations
        return fit_state_space(model, data, iterations=iterations, progress=question.progress)


FREQUENCY_RESPONSES = ResponseEstimator()
