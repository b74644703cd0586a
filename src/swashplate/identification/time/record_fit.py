"""Fits of models to records in time, whatever the model and the gain: `fit(problem, solver)` makes the `Result`.

The problem is a model's likelihood along its records (`vehicle_problem`, `linear_problem`), with a gain by the method's
name (`estimators.GAINS`); the solver is Fisher scoring (`core.scoring`), for the likelihood and then, where a horizon
is asked for, for the errors ahead.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Generic, Protocol, TypeVar

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance
from swashplate.flights.flight import Flight
from swashplate.identification.core import accuracy, stopping
from swashplate.identification.core.likelihood import OwnCovariance
from swashplate.identification.core.low_passed import refuse_lowpassed
from swashplate.identification.core.multi_step import Horizon, told_horizon
from swashplate.identification.core.parameters import Parameterization
from swashplate.identification.core.result import Constant, Estimate, Fitted, Result, correlation_of
from swashplate.identification.core.scoring import Optimum, Solver, minimise
from swashplate.identification.core.sources import scale_words, sources_of
from swashplate.identification.estimators import Data, Question
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.time.estimates import Solved, constants, estimates_of, solved_ahead, solved_at
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.vehicle import Vehicle

VAGUE = 50.0
"""Percent of a value that a standard deviation may have before it is said."""

SOLVER = Solver(iterations=80, tolerance=0.02)
"""Where nothing is said."""

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
class Interpreted(Generic[Model]):
    """What a problem makes of the numbers that a search found.

    Attributes:
        solution: the identified model.
        estimates, constants: of the model and of the records.
        details: what only this method has.
        settings: what was asked.
        problems: what is wrong. notes: what else is to be read beside it. warnings: as of `Result`.
        noise, nuisance: of the stochastic model and the records' mean.
    """

    solution: Model
    estimates: tuple[Estimate, ...]
    constants: tuple[Constant, ...]
    details: Any
    settings: Mapping[str, Any]
    problems: Sequence[str] = ()
    notes: Sequence[str] = ()
    warnings: Sequence[str] = ()
    noise: Noise | None = None
    nuisance: Nuisance | None = None


class FitProblem(Protocol[Model]):
    """What is sought, how it is searched, and what is made of what the search finds."""

    @property
    def method(self) -> str:
        """The estimator's name."""
        ...

    @property
    def start(self) -> Model:
        """The model before the fit."""
        ...

    @property
    def flights(self) -> Sequence[Flight]:
        """The records' source."""
        ...

    def solve(self, solver: Solver, horizon: Horizon | None) -> Solved:
        """The optimum of the likelihood, or of the errors ahead that it leads to."""
        ...

    def interpret(self, solved: Solved) -> Interpreted[Model]:
        """What the optimum says."""
        ...


def fit(problem: FitProblem[Model], solver: Solver, *, horizon: Horizon | None = None) -> Result[Model, Any]:
    """The optimum of a problem as what every identification returns.

    Args:
        problem: what is sought.
        solver: how.
        horizon: of the errors ahead that are minimised after maximum likelihood, None: none.

    Raises:
        IdentificationError: where the model diverges, at the first guess or ahead.
    """
    began = time.perf_counter()
    solved, data = problem.solve(solver, horizon), sources_of(problem.flights)
    interpreted, optimum = problem.interpret(solved), solved.optimum
    prior = solved.row.prior(optimum.row)[2]
    names = tuple(e.name for e in interpreted.estimates if e.free)
    k = len(names)
    covariance = solved.scaled(solved.bound)[:k, :k]
    return Result(
        method=problem.method,
        solution=interpreted.solution,
        start=problem.start,
        estimates=interpreted.estimates,
        names=names,
        covariance=covariance,
        covariance_corrected=solved.scaled(solved.corrected)[:k, :k],
        correlation=correlation_of(covariance),
        details=interpreted.details,
        history=optimum.history,
        converged=optimum.converged,
        problems=(*interpreted.problems, *scale_words(data), *interpreted.notes),
        failed=bool(interpreted.problems),
        warnings=tuple(interpreted.warnings),
        directions=accuracy.blind_directions(
            names, accuracy.marginal_information(optimum.information, prior, solved.places[:k])
        ),
        constants=interpreted.constants,
        noise=interpreted.noise,
        nuisance=interpreted.nuisance,
        comparisons=solved.likelihood.comparisons(solved.full_row),
        data=data,
        settings={**interpreted.settings, **told_horizon(horizon)},
        seconds=time.perf_counter() - began,
        fitted=Fitted(solved.likelihood, solved.full_row) if horizon is None else None,
    )


@dataclass(frozen=True)
class RecordProblem(Generic[Model]):
    """A likelihood whose covariance is the errors' own, and what is made of the numbers that a search finds.

    Attributes:
        likelihood: its first entries are the model's free parameters.
        start: the model before the fit.
        method: its name. flights: the records' source.
        identified: the model of the estimates by name.
        settings: what was asked, for the result.
        table: ties and where priors come from (None: neither).
        warnings_of: what is to be said of the estimates, for the result's warnings.
        begin: scaled row to begin with (None: the entries' starts).
        around: whether entries that want to go too far are held at their reach, see `Solver`.
    """

    likelihood: OwnCovariance
    start: Model
    method: str
    flights: Sequence[Flight]
    identified: Callable[[Mapping[str, Estimate]], Model]
    settings: Mapping[str, Any]
    table: Parameterization | None = None
    warnings_of: Callable[[Sequence[Estimate]], Sequence[str]] = lambda _: ()
    begin: Array | None = None
    around: bool = False

    def solve(self, solver: Solver, horizon: Horizon | None) -> Solved:
        row = self.likelihood.row
        optimum = minimise(self.likelihood, replace(solver, around=self.around), start=self.begin)
        known = np.zeros_like(optimum.information)  # beforehand, of the model's parameters
        of_model = np.ix_(row.places("parameter"), row.places("parameter"))
        known[of_model] = row.prior_information[of_model]
        solved = solved_at(self.likelihood, optimum, known=known)
        return solved if horizon is None else solved_ahead(solved, horizon, solver)

    def interpret(self, solved: Solved) -> Interpreted[Model]:
        estimates, problems = estimates_of(solved, self.start, self.table)
        free = [e for e in estimates if e.free]
        names = [piece.name for piece in self.likelihood.records]
        return Interpreted(
            self.identified({e.name: e for e in estimates}),
            estimates,
            constants(solved, names, ("initial", "nuisance", "noise")),
            TimeDetails(self.likelihood.covariance),
            {**self.settings, "outputs": list(self.likelihood.outputs), "records": names},
            problems,
            warnings=[
                *_fit_warnings(free, solved.optimum),
                *solved.lacking,
                *_colour_words(self.method, solved.colour),
                *self.warnings_of(estimates),
            ],
        )


_WHITE = (0.85, 1.2)
"""Ratios of a parameter's standard deviations, by coloured over by white errors, that a record's chance explains."""


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
    warnings = [] if optimum.converged else [stopping.unfinished()]
    vague = [p.name for p in parameters if not p.sigma_percent <= VAGUE]
    if vague:
        warnings.append(f"standard deviation above {VAGUE:g} %: {', '.join(vague)}; the records hardly tell them.")
    warnings += accuracy.sign_words(parameters)
    stopped = [p.name for p in parameters if p.at_bound]
    if stopped:
        warnings.append(f"ended on a bound: {', '.join(stopped)}.")
    return tuple(warnings)


def check_biases(biases: Sequence[str], outputs: Sequence[str]) -> None:
    """That only outputs have biases."""
    unknown = [name for name in biases if name not in outputs]
    if unknown:
        raise IdentificationError(f"is none of the outputs {', '.join(outputs)}.", channel=", ".join(unknown))


class RecordKind(Protocol[Model]):
    """What fits of one kind of model to records in time differ in.

    Attributes:
        takes: names of the parts of a `Question` that it heeds beside those of every kind.
        solver: how it searches where nothing is said.
    """

    @property
    def takes(self) -> frozenset[str]: ...

    @property
    def solver(self) -> Solver: ...

    def unsuited(self, model: Vehicle | StateSpaceModel) -> str:
        """Why it is none of its models; "" where it is."""
        ...

    def problem(self, model: Model, flights: Sequence[Flight], question: Question, *, method: str) -> FitProblem[Model]:
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
        return self.kind.takes | {"outputs", "iterations", "horizon"}

    def unsuited(self, model: Vehicle | StateSpaceModel, data: Data) -> str:
        return "it fits records in time" if isinstance(data, FrequencyResponse) else self.kind.unsuited(model)

    def estimate(self, model: Model, data: Sequence[Flight], question: Question) -> Result[Model, Any]:
        ahead = None if question.horizon is None else Horizon.of(question.horizon)
        if ahead is not None and self.method == "output-error":
            raise IdentificationError(
                "output error has no filter to predict from: its errors are those of the whole simulation.",
                channel="horizon",
                hint="Choose method filter-error or prediction-error, or leave the horizon away.",
            )
        refuse_lowpassed(data)
        solver = replace(self.kind.solver, progress=question.progress)
        solver = solver if question.iterations is None else replace(solver, iterations=question.iterations)
        return fit(self.kind.problem(model, data, question, method=self.method), solver, horizon=ahead)
