"""`Result`: what any identification found, how sure it is, what it could not see, and models that fit as well."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.parameters import bounds_of
from swashplate.identification.core.posterior_draws import Posterior, normal_within
from swashplate.identification.core.records import Compared, Comparison
from swashplate.identification.core.sources import DataSource
from swashplate.models.vehicle import Vehicle
from swashplate.public import resolve
from swashplate.shown import Shown

APART = 3.0
"""Sigmas beyond which a prior and a flight disagree."""

NAN = float("nan")

Model = TypeVar("Model", covariant=True)
Details = TypeVar("Details", covariant=True)


@dataclass(frozen=True)
class Estimate:
    """One number of a model, estimated or not.

    Attributes:
        name, unit: as in the model.
        start: the model's value before the fit.
        value: the estimate.
        sigma: standard deviation: the Cramér-Rao bound sqrt(inv(H)_ii) of a likelihood, prior included; of a fit to
            responses what their errors make of it [same unit].
        sigma_corrected: the bound corrected for coloured residuals (Morelli and Klein 1997), NaN where the method has
            none.
        insensitivity: 1/sqrt(H_ii), were all others known [same unit].
        prior_mean, prior_sigma: the prior, None where the data alone decided.
        prior_share: part of the information that came from the prior, 0 (data alone) to 1 (prior alone).
        at_bound: True where the fit ended on a bound of physics.
        tie: the expression that ties it to others ("" where it was free).
        fixed: True where it did not move.
        prior_source: where the prior comes from ("" where there is none).
        alone: what the flight alone would have said, NaN where it says nothing.
        disagreement: flight alone less prior, in standard deviations of that difference (NaN: none).
        bound: what the standard deviation to use allows for, in words: "white errors", "coloured errors", "errors by
            octaves", or "what the model may lack"; "" where the method has one kind only.
    """

    name: str
    unit: str
    start: float
    value: float
    sigma: float = NAN
    sigma_corrected: float = NAN
    insensitivity: float = NAN
    prior_mean: float | None = None
    prior_sigma: float | None = None
    prior_share: float = 0.0
    at_bound: bool = False
    tie: str = ""
    fixed: bool = False
    prior_source: str = ""
    alone: float = NAN
    disagreement: float = NAN
    bound: str = ""

    @property
    def free(self) -> bool:
        return not self.fixed and not self.tie

    @property
    def best_sigma(self) -> float:
        """The corrected bound where there is one, otherwise the plain one."""
        return self.sigma_corrected if np.isfinite(self.sigma_corrected) else self.sigma

    @property
    def sigma_percent(self) -> float:
        return 100.0 * self.best_sigma / abs(self.value) if self.value else float("inf")

    @property
    def insensitivity_percent(self) -> float:
        return 100.0 * self.insensitivity / abs(self.value) if self.value else float("inf")


@dataclass(frozen=True)
class Constant:
    """A number of the records and not of the model: a delay [s], a trim [1], a start state, a noise, a filter's gain.

    `record` is "" where all records share it.
    """

    record: str
    name: str
    unit: str
    value: float
    sigma: float


@dataclass(frozen=True)
class Direction:
    """A combination of parameters that the data hardly see.

    Attributes:
        weights: by parameter, in units of its scale, of length one.
        sigma: uncertainty along it, in the same units (1 means: of the order of the parameters' scales).
        words: the same in words.
    """

    weights: Mapping[str, float]
    sigma: float
    words: str


class Drawable(Protocol):
    """What a model must be for other numbers of it to be drawn."""

    def with_values(self, values: Mapping[str, float]) -> Any: ...


@dataclass(frozen=True)
class Fitted:
    """What was minimised and where the search ended: likelihood and scaled row, as long as the program runs."""

    likelihood: Any
    row: Array


@dataclass(frozen=True, repr=False)
class Result(Shown, Generic[Model, Details]):
    """What an identification found.

    Attributes:
        method: name of the estimator.
        solution: what was identified: a vehicle, matrices of named expressions, or transfer functions; `model` is a
            vehicle always. start: the same before the fit.
        estimates: the model's numbers, free ones in the order of `names`, then (or among them) tied and fixed ones.
        names: free parameters in the order of the matrices below.
        covariance, covariance_corrected: of the free parameters in their units (p, p); the second allows for coloured
            residuals and is NaN where the method has none.
        correlation: of the free parameters (p, p).
        history: cost after each iteration.
        converged: False where the iterations ran out or were stopped.
        problems: what is wrong with the fit, in words; a fit with values that physics forbids is a failed fit.
        failed: True where the numbers must not be used.
        warnings: what a reader must know.
        directions: what the data hardly see, worst first.
        constants: what belongs to the records and not to the model.
        noise, nuisance: of the stochastic model and the records' mean, what a prediction on another flight uses; None
            where the method has none.
        comparisons: data against model, per record or per response.
        data: what it was fitted to: names, SHA-256 and what was done to it.
        settings: what was asked.
        details: what only this method has.
        posterior: draws of what the fit does not know (`swashplate.posterior`); None: normal ones, when asked for.
        validation: how it predicts the flights that were held out; None where there were none. A file of its own.
        truth: numbers of the aircraft that was simulated, where they are known; empty where one flew.
        seconds: wall time; it is no part of the document.
        fitted: the likelihood and its optimum, for a posterior; None where the method has none, or for a file's result.
    """

    method: str
    solution: Model
    start: Model
    estimates: tuple[Estimate, ...]
    names: tuple[str, ...]
    covariance: Array
    covariance_corrected: Array
    correlation: Array
    details: Details
    history: tuple[float, ...] = ()
    converged: bool = True
    problems: tuple[str, ...] = ()
    failed: bool = False
    warnings: tuple[str, ...] = ()
    directions: tuple[Direction, ...] = ()
    constants: tuple[Constant, ...] = ()
    noise: Noise | None = None
    nuisance: Nuisance | None = None
    comparisons: tuple[Compared, ...] = ()
    data: tuple[DataSource, ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)
    posterior: Posterior | None = None
    validation: Any = field(default=None, repr=False, compare=False)
    truth: Mapping[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    fitted: Fitted | None = field(default=None, repr=False, compare=False)

    @property
    def beside_truth(self) -> str:
        """How many free parameters lie within two corrected sigmas of the truth, in words; "" where none is known."""
        known = [e for e in map(self.__getitem__, self.names) if e.name in self.truth and e.best_sigma > 0.0]
        near = [e for e in known if abs(e.value - self.truth[e.name]) <= 2.0 * e.best_sigma]
        text = f"{len(near)} of {len(known)} parameters lie within two sigmas of the simulated aircraft's."
        return text if known else ""

    @cached_property
    def _by_name(self) -> dict[str, Estimate]:
        return {estimate.name: estimate for estimate in self.estimates}

    def __getitem__(self, name: str) -> Estimate:
        """The estimate of that name.

        Raises:
            KeyError: where there is none.
        """
        return self._by_name[name]

    @property
    def sources(self) -> tuple[str, ...]:
        """Names of the data."""
        return tuple(source.name for source in self.data)

    @property
    def in_time(self) -> tuple[Comparison, ...]:
        """Records beside the model, for a fit to records; empty for others."""
        return tuple(c for c in self.comparisons if isinstance(c, Comparison))

    @property
    def targets(self) -> tuple[Any, ...]:
        """The responses of a fit to frequency responses; empty for others."""
        return tuple(target for c in self.comparisons if (target := getattr(c, "target", None)) is not None)

    @property
    def costs(self) -> tuple[float, ...]:
        """J of each response, for a fit to frequency responses; empty for others."""
        return tuple(cost for c in self.comparisons if (cost := getattr(c, "cost", None)) is not None)

    @property
    def cost(self) -> float:
        """Mean J of a fit to frequency responses; the last cost of others."""
        if self.costs:
            return float(np.mean(self.costs))
        return self.history[-1] if self.history else NAN

    @property
    def name(self) -> str:
        """The model's name."""
        return str(getattr(self.solution, "name", "transfer functions"))

    @cached_property
    def model(self) -> Vehicle:
        """The identified vehicle, as `swashplate.vehicle` loads it from its file: it trims, flies and is controlled.

        Raises:
            IdentificationError: transfer functions with more zeros than poles, which cannot be flown.
        """
        vehicle: Vehicle = resolve("vehicle_of_result")(self)
        return vehicle

    # ---- models that the data cannot tell apart ----------------------------------------------------------------
    def draw_values(self, count: int, *, seed: int, corrected: bool = True, within: Any = None) -> dict[str, Array]:
        """Parameters of models that the data cannot tell from the identified one, shape (count,) each.

        From the posterior where there is one by NUTS; otherwise normal about the estimates, from their covariance. A
        draw outside a bound of physics is drawn again. Ties are kept where they equate two parameters.

        Args:
            count: how many. seed: of the draws.
            corrected: True takes the covariance that is corrected for coloured residuals, where the method has one.
            within: a model whose bounds hold (None: the identified one).

        Raises:
            IdentificationError: for a fit that has failed, that knows no spread, or whose spread lies mostly outside
                the bounds of physics; or for a posterior that did not converge.
        """
        where = f"the fit of {self.name}"
        if self.failed:
            raise IdentificationError("has failed: nothing can be drawn from it.", where=where, hint="Fit it again.")
        covariance = self.covariance_corrected if corrected else self.covariance
        if not np.all(np.isfinite(covariance)):
            covariance = self.covariance
        vague = [n for n, v in zip(self.names, np.diag(covariance), strict=True) if not 0.0 < v < np.inf]
        if vague or not self.names or not np.all(np.isfinite(covariance)):
            problem = "has no standard deviation." if vague else "knows no spread: nothing was free."
            raise IdentificationError(problem, where=where, channel=", ".join(vague) or None)
        low, high = bounds_of(self.solution if within is None else within, self.names)
        if self.posterior is not None and self.posterior.method != "laplace":
            both = (self.covariance, self.covariance_corrected) if corrected else None
            rows = self.posterior.drawn(low, high, count=count, seed=seed, covariances=both, where=self.name)
        else:
            mean = np.array([self[name].value for name in self.names])
            rows = normal_within(mean, covariance, low, high, count=count, seed=seed, where=where)
        drawn = {name: rows[:, i] for i, name in enumerate(self.names)}
        return drawn | {e.name: drawn[e.tie] for e in self.estimates if e.tie in drawn}

    def validate(self, flights: Any, **how: Any) -> Any:
        """How its model predicts flights that it has not seen: see `swashplate.validate`."""
        return resolve("validate")(self, flights, **how)

    def draw(self, count: int, *, seed: int) -> tuple[Any, ...]:
        """Vehicles that the data cannot tell from the identified one (see `draw_values`, which it takes).

        Raises:
            IdentificationError: as `draw_values`; or for a model whose numbers cannot be changed.
        """
        if not hasattr(self.solution, "with_values"):
            raise IdentificationError("numbers of it cannot be drawn.", where=self.name)
        model: Drawable = self.model
        drawn = self.draw_values(count, seed=seed)
        return tuple(model.with_values({name: float(v[k]) for name, v in drawn.items()}) for k in range(count))

    # ---- files -------------------------------------------------------------------------------------------------
    def to_document(self, *, comparisons: bool = True) -> dict[str, Any]:
        """All of it as JSON types, but for the wall time; `from_document` is the way back.

        Args:
            comparisons: False leaves the time histories and responses out, which are most of it.
        """
        document: dict[str, Any] = resolve("result_to_document")(self, comparisons=comparisons)
        return document

    @staticmethod
    def from_document(document: Mapping[str, Any], *, where: str = "", equations: Any = None) -> Result[object, object]:
        """The result of a document (see `swashplate.load`, whose errors it raises)."""
        result: Result[object, object] = resolve("result_from_document")(document, where=where, equations=equations)
        return result

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the document as a file that `swashplate.load` reads."""
        written: Path = resolve("save_result")(self, path)
        return written

    # ---- words -------------------------------------------------------------------------------------------------
    @property
    def state(self) -> str:
        return "FAILED" if self.failed else "converged" if self.converged else "not converged"

    def __repr__(self) -> str:
        responses = f", J_ave = {self.cost:.1f} over {len(self.costs)} responses" if self.costs else ""
        lines = [f"{self.name} by {self.method}: {self.state}{responses}"]
        lines += [f"  {text}" for text in self.settings.get("set by the choice", ())]
        lines_of = getattr(self.details, "lines", None)
        lines += lines_of(self) if lines_of is not None else []
        columns = [(head, cells) for head, cells in self.columns() if any(cells)]
        widths = [max(len(cell) for cell in (head, *cells)) for head, cells in columns]
        for row in range(-1, len(self.estimates)):
            cells = []
            for (head, column), width in zip(columns, widths, strict=True):
                cell = head if row < 0 else column[row]
                cells.append(
                    cell.ljust(width) if head in ("parameter", "unit", "bound for", "remarks") else cell.rjust(width)
                )
            lines.append(("  " + "  ".join(cells)).rstrip())
        return "\n".join([*lines, *(f"! {text}" for text in (*self.problems, *self.warnings))])

    def columns(self) -> list[tuple[str, list[str]]]:
        """Headings and cells of the table of estimates."""
        every = self.estimates
        sigma = {e.name: e.best_sigma for e in every}
        return [
            ("parameter", [e.name for e in every]),
            ("start", [f"{e.start:.5g}" for e in every]),
            ("value", [f"{e.value:.5g}" for e in every]),
            ("sigma", [_number(sigma[e.name]) if not e.fixed else "" for e in every]),
            ("sigma %", [_percent(sigma[e.name], e.value) if e.free else "" for e in every]),
            ("I %", [percent(e.insensitivity_percent).strip() if np.isfinite(e.insensitivity) else "" for e in every]),
            ("unit", [e.unit for e in every]),
            ("bound for", [e.bound for e in every]),
            ("remarks", [remark(e) for e in every]),
        ]


def remark(e: Estimate) -> str:
    """What a table says beside an estimate."""
    return f"= {e.tie}" if e.tie else "fixed" if e.fixed else "at its bound" if e.at_bound else ""


def percent(value: float, *, width: int = 8) -> str:
    """A figure in percent for a table; what is beyond all use keeps its column."""
    return f"{value:>{width}.1f}" if value < 1e4 else f"{'>9999':>{width}}"


def _percent(sigma: float, value: float) -> str:
    return percent(100.0 * sigma / abs(value)).strip() if value and np.isfinite(sigma) else ""


def _number(value: float) -> str:
    return f"{value:.2g}" if np.isfinite(value) else ""


def correlation_of(covariance: Array) -> Array:
    """Correlation (p, p) of a covariance."""
    d = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    with np.errstate(invalid="ignore"):  # infinite over infinite: parameters that leave no trace
        return np.asarray(covariance / np.outer(d, d))
