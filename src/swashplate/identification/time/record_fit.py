"""Fits of models to records in time, whatever the model and the gain: `fit(problem, solver)` makes the `Result`.

The problem is a model's likelihood along its records (`vehicle_problem`, `linear_problem`), with a gain by the method's
name (`estimators.GAINS`); the solver is Fisher scoring (`core.scoring`), for the likelihood and then, where a horizon
is asked for, for the errors ahead.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Generic, Protocol, TypeVar

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.flights.flight import Flight
from swashplate.identification.core import accuracy, stopping
from swashplate.identification.core.likelihood import OwnCovariance
from swashplate.identification.core.low_passed import refuse_lowpassed
from swashplate.identification.core.multi_step import TWICE, Horizon, MultiStepErrors, told_horizon
from swashplate.identification.core.parameter_row import Row
from swashplate.identification.core.records import Record
from swashplate.identification.core.result import Constant, Estimate, Fitted, Result, correlation_of
from swashplate.identification.core.scoring import Optimum, Solver, minimise
from swashplate.identification.core.sources import scale_words, sources_of
from swashplate.identification.estimators import Data, Question
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle

VAGUE = 50.0
"""Percent of a value that a standard deviation may have before it is said."""

LAGS = 1.0
"""Seconds of residual correlation that the corrected bound allows for."""

ITERATIONS = 80
"""At most, where nothing is said."""

Model = TypeVar("Model")


@dataclass(frozen=True)
class TimeDetails:
    """What a fit to records in time adds to a result.

    Attributes:
        covariance: of the output errors, or of the innovations (n_outputs, n_outputs).
    """

    kind: ClassVar[str] = "records in time"
    covariance: Array


@dataclass(frozen=True)
class RecordProblem(Generic[Model]):
    """What is sought, and what is made of the numbers that a search finds.

    Attributes:
        likelihood: its first entries are the model's free parameters.
        start: the model before the fit.
        units: of the free parameters.
        identified: the model of the estimates by name.
        settings: what was asked, for the result.
        ties: estimates that follow from the numbers found, by name.
        words: what is to be said of the estimates, for the result's warnings.
        begin: scaled row to begin with (None: the entries' starts).
        around: whether entries that want to go too far are held at their reach, see `Solver`.
    """

    likelihood: OwnCovariance
    start: Model
    units: Sequence[str]
    identified: Callable[[Mapping[str, Estimate]], Model]
    settings: Mapping[str, Any]
    ties: Callable[[Mapping[str, float]], Sequence[Estimate]] = lambda _: ()
    words: Callable[[Sequence[Estimate]], Sequence[str]] = lambda _: ()
    begin: Array | None = None
    around: bool = False


_WHITE = (0.85, 1.2)
"""Ratios of a parameter's standard deviations, by coloured over by white errors, that a record's chance explains."""


@dataclass(frozen=True)
class Solved:
    """Where a likelihood has its optimum, or its errors some time ahead.

    Attributes:
        numbers: of the model, by name.
        optimum: where the search ended.
        plain, corrected: covariances of the moved entries in their units (p, p).
        row: the entries that moved last.
        whole: the likelihood's row where the search ended.
        colour: standard deviation of each parameter by the errors' autocorrelation, over that of white errors.
    """

    numbers: Mapping[str, float]
    optimum: Optimum
    plain: Array
    corrected: Array
    row: Row
    whole: Array
    colour: Array = field(default_factory=lambda: np.ones(1))


def fit(
    problem: RecordProblem[Model],
    solver: Solver,
    *,
    method: str,
    flights: Sequence[Flight],
    horizon: Horizon | None = None,
) -> Result[Model, TimeDetails]:
    """The optimum of a problem as what every identification returns.

    Args:
        problem: what is sought.
        solver: how.
        method: its name. flights: the records' source.
        horizon: of the errors ahead that are minimised after maximum likelihood, None: none.

    Raises:
        IdentificationError: where the model diverges, at the first guess or ahead.
    """
    began = time.perf_counter()
    likelihood, data, k = problem.likelihood, sources_of(flights), len(problem.units)
    solved = _solved(problem, replace(solver, around=problem.around), horizon)
    row, optimum = solved.row, solved.optimum
    spread, wider = (np.sqrt(np.maximum(np.diag(c), 0.0)) for c in (solved.plain, solved.corrected))
    free = tuple(
        Estimate(
            name=entry.name,
            unit=unit,
            start=entry.start,
            value=solved.numbers[entry.name],
            sigma=float(spread[i]),
            sigma_corrected=float(wider[i]),
            insensitivity=float(row.scale[i]) / told if (told := float(np.sqrt(optimum.information[i, i]))) else np.inf,
            prior_mean=entry.mean if np.isfinite(entry.sigma) else None,
            prior_sigma=entry.sigma if np.isfinite(entry.sigma) else None,
            at_bound=entry.name in optimum.at_bound,
        )
        for i, (entry, unit) in enumerate(zip(row.entries, problem.units, strict=False))
    )
    estimates = (*free, *problem.ties(solved.numbers))
    problems = _problems(row, optimum, k)
    covariance = solved.plain[:k, :k]
    marginal = accuracy.marginal_information(optimum.information, row.prior(optimum.row)[2], row.places("parameter"))
    return Result(
        method=method,
        solution=problem.identified({e.name: e for e in estimates}),
        start=problem.start,
        estimates=estimates,
        names=row.names[:k],
        covariance=covariance,
        covariance_corrected=solved.corrected[:k, :k],
        correlation=correlation_of(covariance),
        details=TimeDetails(likelihood.covariance),
        history=optimum.history,
        converged=optimum.converged,
        problems=(*problems, *scale_words(data)),
        failed=bool(problems),
        warnings=(*_fit_warnings(free, optimum), *_colour_words(method, solved.colour), *problem.words(estimates)),
        directions=accuracy.blind_directions(row.names[:k], marginal),
        constants=tuple(_constants(solved, likelihood.records, spread, k)),
        comparisons=likelihood.comparisons(solved.whole),
        data=data,
        settings={
            **problem.settings,
            "outputs": list(likelihood.outputs),
            "records": [piece.name for piece in likelihood.records],
            **told_horizon(horizon),
        },
        seconds=time.perf_counter() - began,
        fitted=Fitted(likelihood, solved.whole) if horizon is None else None,
    )


def _solved(problem: RecordProblem[Any], solver: Solver, horizon: Horizon | None) -> Solved:
    """The optimum of the likelihood, or of the errors ahead that it leads to."""
    likelihood = problem.likelihood
    optimum = minimise(likelihood, solver, start=problem.begin)
    row = likelihood.row
    known = np.zeros_like(optimum.information)  # beforehand, of the model's parameters
    of_model = np.ix_(row.places("parameter"), row.places("parameter"))
    known[of_model] = row.prior_information[of_model]
    plain = np.asarray(np.linalg.pinv(optimum.information + known, hermitian=True), dtype=np.float64)
    lags = round(LAGS / likelihood.records[0].dt)
    white, sensitivities, rest = likelihood.whitened(optimum.row)
    coloured = accuracy.corrected_covariance(plain, rest + known, white, sensitivities, lags=lags)
    own, coloured_own = (np.diag(c)[row.places("parameter")] for c in (plain, coloured))
    colour = np.sqrt(np.divide(coloured_own, own, out=np.ones_like(own), where=own > 0.0))
    by_octaves = accuracy.covariance_by_octaves(plain, rest + known, white, sensitivities)
    corrected = accuracy.covering(coloured, plain, by_octaves)
    if horizon is not None:
        ahead = _solved_ahead(likelihood, optimum, horizon, corrected, replace(solver, around=False))
        return replace(ahead, colour=colour)
    units = np.outer(row.scale, row.scale)
    named = dict(zip(row.names, map(float, _numbers(row, likelihood.sized(optimum.row))), strict=True))
    return Solved(named, optimum, plain * units, corrected * units, row, optimum.row, colour)


def _solved_ahead(likelihood: OwnCovariance, first: Optimum, horizon: Horizon, known: Array, solver: Solver) -> Solved:
    """The optimum of the errors ahead, from that of the likelihood and beside what that knows (p, p)."""
    criterion = MultiStepErrors(likelihood, first.row, likelihood.records, horizon=horizon, known=known)
    optimum = minimise(criterion, solver, start=criterion.start)
    row, prior = criterion.row, criterion.row.prior(optimum.row)[2]
    plain = accuracy.covariance(row, optimum.information, prior)
    white, sensitivities, rest = criterion.whitened(optimum.row)
    corrected = TWICE * accuracy.corrected_covariance(plain, rest + prior, white, sensitivities, lags=criterion.lags)
    units, whole = np.outer(row.scale, row.scale), criterion.whole_row(optimum.row)
    named = dict(zip(likelihood.row.names, map(float, _numbers(likelihood.row, whole)), strict=True))
    return Solved(named, optimum, plain * units, corrected * units, row, whole)


def _numbers(row: Row, scaled: Array) -> Array:
    plain = scaled * row.scale
    logarithmic = row.column("logarithmic") > 0.0
    return np.where(logarithmic, np.exp(np.where(logarithmic, plain, 0.0)), plain)


def _constants(solved: Solved, records: Sequence[Record], spread: Array, first: int) -> list[Constant]:
    """Start states, shifts, biases, gusts and gains by record."""
    made = []
    for i, entry in list(enumerate(solved.row.entries))[first:]:
        name, _, number = entry.name.partition("[")
        value = solved.numbers[entry.name]
        record = records[int(number[:-1])].name if number else ""
        made.append(Constant(record, name, "", value, float(spread[i]) * (value if entry.logarithmic else 1.0)))
    return made


def _problems(row: Row, optimum: Optimum, k: int) -> tuple[str, ...]:
    values = _numbers(row, optimum.row)[:k]
    problems = [] if np.isfinite(optimum.cost) else ["the cost is not finite"]
    for entry, value in zip(row.entries, values, strict=False):
        if not (np.isfinite(value) and entry.lower - 1e-12 <= value <= entry.upper + 1e-12):
            problems.append(f"{entry.name} = {value:.4g} is not physical (allowed: {entry.lower:g} to {entry.upper:g})")
    return tuple(problems)


def _colour_words(method: str, colour: Array) -> tuple[str, ...]:
    """Whether the errors of a filter have the colour that its noise denies them: then its estimates are biased."""
    if method == "output-error" or bool(np.all((_WHITE[0] < colour) & (colour < _WHITE[1]))):
        return ()
    return (
        f"the filter's errors are not white: their autocorrelation makes bounds {colour.min():.2f} to "
        f"{colour.max():.2f} times as wide as white errors would. Gusts that last are such noise, and shift the "
        "estimates of this method. Compare with method output-error, or with filter-error and gusts=lasting.",
    )


def _fit_warnings(parameters: Sequence[Estimate], optimum: Optimum) -> tuple[str, ...]:
    words = [] if optimum.converged else [stopping.unfinished()]
    vague = [p.name for p in parameters if not p.sigma_percent <= VAGUE]
    if vague:
        words.append(f"standard deviation above {VAGUE:g} %: {', '.join(vague)}; the records hardly tell them.")
    words += accuracy.sign_words(parameters)
    stopped = [p.name for p in parameters if p.at_bound]
    if stopped:
        words.append(f"ended on a bound: {', '.join(stopped)}.")
    return tuple(words)


def check_biases(biases: Sequence[str], outputs: Sequence[str]) -> None:
    """That only outputs have biases."""
    unknown = [name for name in biases if name not in outputs]
    if unknown:
        raise IdentificationError(f"is none of the outputs {', '.join(outputs)}.", channel=", ".join(unknown))


class RecordKind(Protocol[Model]):
    """What fits of one kind of model to records in time differ in.

    Attributes:
        takes: names of the parts of a `Question` that it heeds beside those of every kind.
    """

    @property
    def takes(self) -> frozenset[str]: ...

    def unsuited(self, model: Vehicle | StateSpaceModel) -> str:
        """Why it is none of its models; "" where it is."""
        ...

    def problem(
        self, model: Model, flights: Sequence[Flight], question: Question, *, method: str
    ) -> RecordProblem[Model]:
        """The likelihood of the flights' records, by the method's gain."""
        ...


@dataclass(frozen=True)
class RecordEstimator(Generic[Model]):
    """Maximum likelihood of records in time, as an estimator.

    Attributes:
        method: its name, which says where the gain comes from (`estimators.GAINS`).
        kind: of models.
    """

    method: str
    kind: RecordKind[Model]

    @property
    def takes(self) -> frozenset[str]:
        # A horizon is heard by all, so that output error can say why it has none.
        return self.kind.takes | {"outputs", "iterations", "shifts", "biases", "horizon", "progress"}

    def unsuited(self, model: Vehicle | StateSpaceModel, data: Data) -> str:
        return "it fits records in time" if isinstance(data, FrequencyResponse) else self.kind.unsuited(model)

    def estimate(self, model: Model, data: Sequence[Flight], question: Question) -> Result[Model, TimeDetails]:
        ahead = None if question.horizon is None else Horizon.of(question.horizon)
        if ahead is not None and self.method == "output-error":
            raise IdentificationError(
                "output error has no filter to predict from: its errors are those of the whole simulation.",
                channel="horizon",
                hint="Choose method filter-error or prediction-error, or leave the horizon away.",
            )
        refuse_lowpassed(data)
        most = ITERATIONS if question.iterations is None else question.iterations
        return fit(
            self.kind.problem(model, data, question, method=self.method),
            Solver(iterations=most, tolerance=0.02, progress=question.progress),
            method=self.method,
            flights=data,
            horizon=ahead,
        )
