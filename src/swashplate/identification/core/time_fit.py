"""How the likelihood of any model's records in time becomes a `Result`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.identification.core import accuracy, stopping
from swashplate.identification.core.comparison import Comparison
from swashplate.identification.core.multi_step import TWICE, Horizon, MultiStepErrors, told_horizon
from swashplate.identification.core.parameter_row import Row
from swashplate.identification.core.records import Record
from swashplate.identification.core.result import Constant, Estimate, Fitted, Result, correlation_of
from swashplate.identification.core.scoring import Likelihood, Optimum, Progress, minimise
from swashplate.identification.core.sources import DataSource, scale_words
from swashplate.identification.core.time_likelihood import TimeErrors

METHODS = ("output-error", "filter-error", "prediction-error")

VAGUE = 50.0
"""Percent of a value that a standard deviation may have before it is said."""

LAGS = 1.0
"""Seconds of residual correlation that the corrected bound allows for."""

Model = TypeVar("Model")


@dataclass(frozen=True)
class TimeDetails:
    """What a fit to records in time adds to a result.

    Attributes:
        covariance: of the output errors, or of the innovations (n_outputs, n_outputs).
    """

    kind: ClassVar[str] = "records in time"
    covariance: Array


class RecordLikelihood(Likelihood, Protocol):
    """A likelihood of records in time: what the search needs, and what is said of its optimum."""

    @property
    def records(self) -> tuple[Record, ...]: ...

    @property
    def covariance(self) -> Array:
        """Of the output errors, or of the innovations (n_outputs, n_outputs)."""
        ...

    def sized(self, row: Array) -> Array:
        """A scaled row with what the errors' covariance alone tells."""
        ...

    def whitened(self, row: Array) -> tuple[list[Array], list[Array], Array]:
        """Per record whitened errors (n, outputs) and sensitivities (p, n, outputs); and all other information."""
        ...

    def comparisons(self, row: Array) -> tuple[Comparison, ...]:
        """Every record beside what the model predicts."""
        ...


@dataclass(frozen=True)
class Solved:
    """Where a likelihood has its optimum, or its errors some time ahead.

    Attributes:
        numbers: of the model, by name.
        likelihood, optimum: what was minimised, and where the search ended.
        plain, corrected: covariances of the moved entries in their units (p, p).
        row: the entries that moved last.
        whole: the likelihood's row where the search ended.
        horizon: of the errors ahead that were minimised, None for one step.
    """

    numbers: Mapping[str, float]
    likelihood: RecordLikelihood
    optimum: Optimum
    plain: Array
    corrected: Array
    row: Row
    whole: Array
    horizon: Horizon | None = None


def solve(
    likelihood: RecordLikelihood,
    *,
    iterations: int,
    progress: Progress | None,
    start: Array | None = None,
    horizon: Horizon | None = None,
    around: bool = False,
) -> Solved:
    """The optimum of a likelihood whose first entries are the model's parameters.

    Args:
        likelihood: of errors or innovations.
        iterations: at most this many.
        progress: told about every iteration.
        start: scaled row to begin with (None: the entries' starts).
        horizon: of the errors ahead that are minimised afterwards, None: none.
        around: see `minimise`.

    Raises:
        IdentificationError: where the model diverges, at the first guess or ahead.
    """
    optimum = minimise(likelihood, start=start, iterations=iterations, tolerance=0.02, around=around, progress=progress)
    row = likelihood.row
    known = np.zeros_like(optimum.information)  # beforehand, of the model's parameters
    of_model = np.ix_(row.places("parameter"), row.places("parameter"))
    known[of_model] = row.prior_information[of_model]
    plain = np.asarray(np.linalg.pinv(optimum.information + known, hermitian=True), dtype=np.float64)
    lags = round(LAGS / likelihood.records[0].dt)
    white, sensitivities, rest = likelihood.whitened(optimum.row)
    corrected = accuracy.corrected_covariance(plain, rest + known, white, sensitivities, lags=lags)
    if horizon is not None:
        return _solved_ahead(likelihood, optimum, horizon, corrected, iterations=iterations, progress=progress)
    units = np.outer(row.scale, row.scale)
    named = dict(zip(row.names, map(float, _numbers(row, likelihood.sized(optimum.row))), strict=True))
    return Solved(named, likelihood, optimum, plain * units, corrected * units, row, optimum.row)


def _solved_ahead(
    likelihood: RecordLikelihood,
    first: Optimum,
    horizon: Horizon,
    known: Array,
    *,
    iterations: int,
    progress: Progress | None,
) -> Solved:
    """The optimum of the errors ahead, from that of the likelihood and beside what that knows (p, p)."""
    if not isinstance(likelihood, TimeErrors):
        raise IdentificationError("no filter runs ahead of its record with this method.", channel="horizon")
    criterion = MultiStepErrors(likelihood, first.row, likelihood.records, horizon=horizon, known=known)
    optimum = minimise(criterion, start=criterion.start, iterations=iterations, tolerance=0.02, progress=progress)
    row, prior = criterion.row, criterion.row.prior(optimum.row)[2]
    plain = accuracy.covariance(row, optimum.information, prior)
    white, sensitivities, rest = criterion.whitened(optimum.row)
    corrected = TWICE * accuracy.corrected_covariance(plain, rest + prior, white, sensitivities, lags=criterion.lags)
    units, whole = np.outer(row.scale, row.scale), criterion.whole(optimum.row)
    named = dict(zip(likelihood.row.names, map(float, _numbers(likelihood.row, whole)), strict=True))
    return Solved(named, likelihood, optimum, plain * units, corrected * units, row, whole, horizon)


def result_of(
    solved: Solved,
    *,
    model: Callable[[Mapping[str, Estimate]], Model],
    start: Model,
    units: Sequence[str],
    method: str,
    data: Sequence[DataSource],
    settings: Mapping[str, Any],
    seconds: float,
    ties: Sequence[Estimate] = (),
) -> Result[Model, TimeDetails]:
    """A solved likelihood as what every identification returns.

    Args:
        solved: of `solve`.
        model: makes the identified model of the estimates by name.
        start: the model before the fit.
        units: of the free parameters.
        method, data, settings, seconds: see `Result`.
        ties: estimates that follow from the free ones.
    """
    likelihood, optimum = solved.likelihood, solved.optimum
    row, k = solved.row, len(units)
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
        for i, (entry, unit) in enumerate(zip(row.entries, units, strict=False))
    )
    estimates = (*free, *ties)
    problems = _problems(row, optimum, k)
    covariance = solved.plain[:k, :k]
    marginal = accuracy.marginal_information(optimum.information, row.prior(optimum.row)[2], row.places("parameter"))
    return Result(
        method=method,
        solution=model({e.name: e for e in estimates}),
        start=start,
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
        warnings=_words(free, optimum),
        directions=accuracy.blind_directions(row.names[:k], marginal),
        constants=tuple(_constants(solved, likelihood.records, spread, k)),
        comparisons=likelihood.comparisons(solved.whole),
        data=tuple(data),
        settings=dict(settings) | told_horizon(solved.horizon),
        seconds=seconds,
        fitted=Fitted(likelihood, solved.whole) if solved.horizon is None else None,
    )


def check_method(method: str) -> None:
    """That there is such a method."""
    if method not in METHODS:
        raise IdentificationError(f"'{method}' is no method; there are {', '.join(METHODS)}.", channel="method")


def ahead_of(horizon: Sequence[float] | None, method: str) -> Horizon | None:
    """The horizon that was asked for, None where none was.

    Raises:
        IdentificationError: for one that is none, or with output error, whose simulation nothing corrects.
    """
    if horizon is None:
        return None
    if method == "output-error":
        raise IdentificationError(
            "output error has no filter to predict from: its errors are those of the whole simulation.",
            channel="horizon",
            hint="Choose method filter-error or prediction-error, or leave the horizon away.",
        )
    return Horizon.of(horizon)


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


def _words(parameters: Sequence[Estimate], optimum: Optimum) -> tuple[str, ...]:
    words = [] if optimum.converged else [stopping.unfinished()]
    vague = [p.name for p in parameters if not p.sigma_percent <= VAGUE]
    if vague:
        words.append(f"standard deviation above {VAGUE:g} %: {', '.join(vague)}; the records hardly tell them.")
    stopped = [p.name for p in parameters if p.at_bound]
    if stopped:
        words.append(f"ended on a bound: {', '.join(stopped)}.")
    return tuple(words)
