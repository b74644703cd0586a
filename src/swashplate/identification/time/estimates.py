"""What an optimum says: estimates with both bounds, what the flight says without the prior, and each record's own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.filtering.nuisance import PUSHES
from swashplate.identification.core import accuracy
from swashplate.identification.core.likelihood import Likelihood
from swashplate.identification.core.missing_parts import shifts_by
from swashplate.identification.core.multi_step import TWICE, Horizon, MultiStepErrors
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.parameters import Parameterization, bounds_of, parameter_table
from swashplate.identification.core.result import Constant, Estimate
from swashplate.identification.core.scoring import Optimum, Solver, Sought, minimise

if TYPE_CHECKING:
    from swashplate.identification.time.linear_residual import LinearResidual

LAGS = 1.0
"""Seconds of residual correlation that the corrected bound allows for."""

WHITE, COLOURED, BY_OCTAVES = "white errors", "coloured errors", "errors by octaves"
MODEL = "what the model may lack"
"""Kinds of bounds, by what they allow for."""

WIDER = 1.1
"""Times as wide as without, from which a bound is said to hold what the model may lack."""

_UNITS = {"delay": "s", "trim": "1", "lever": "m", "level": "rad", **dict.fromkeys(PUSHES[:3], "m/s^2")}
_UNITS |= dict.fromkeys(PUSHES[3:], "rad/s^2")
"""Units of what belongs to a record, by its name or the first word of that."""


def record_unit(name: str) -> str:
    """Unit of a constant that belongs to a record; "" where it has none."""
    return _UNITS.get(name) or _UNITS.get(name.split("_")[0], "")


class Criterion(Sought, Protocol):
    """What was minimised: a likelihood, or errors some time ahead."""

    def whitened(self, row: Array) -> tuple[list[Array], list[Array], Array]:
        """Per record: whitened errors and their sensitivities, and information that lies elsewhere."""
        ...


@dataclass(frozen=True)
class Solved:
    """An optimum with its covariances.

    Attributes:
        likelihood, criterion, optimum: what was sought, and where the search ended; the criterion is the likelihood, or
            the errors ahead that it leads to.
        prior: the priors' information (p, p).
        bound, corrected: covariances (p, p) of the criterion's scaled row, without and with the errors' colour.
        full_row: the likelihood's row where the search ended.
        numbers: of that, by name, in their units.
        kinds: of the bound of each parameter, see `Estimate`.
        lacking: what is to be said of parts that the model lacks.
        colour: standard deviation of each parameter by the errors' autocorrelation, over that of white errors.
        residual: accelerations that the equations lack, kept or not; None: not asked for.
    """

    likelihood: Likelihood
    criterion: Criterion
    optimum: Optimum
    prior: Array
    bound: Array
    corrected: Array
    full_row: Array
    numbers: Mapping[str, float]
    kinds: tuple[str, ...]
    lacking: tuple[str, ...] = ()
    colour: Array = field(default_factory=lambda: np.ones(1))
    residual: LinearResidual | None = None

    @property
    def row(self) -> Row:
        return self.criterion.row

    @property
    def places(self) -> NDArray[np.intp]:
        return self.row.places("parameter")

    @cached_property
    def left(self) -> Array:
        """Newton's step from where the search ended to the exact optimum, scaled (p,)."""
        gradient = self.criterion.scores(self.optimum.row)[1] + self.row.prior(self.optimum.row)[1]
        return np.asarray(-self.bound @ gradient)

    def scaled(self, covariance: Array) -> Array:
        """A covariance of the parameters in their units."""
        scale = self.row.scale[self.places]
        return np.asarray(covariance[np.ix_(self.places, self.places)] * np.outer(scale, scale))

    def identified(self, table: Parameterization) -> dict[str, float]:
        """Names and values of everything that moved, tied parameters too."""
        return table.identified([self.numbers[name] for name in table.names])


def solved_at(likelihood: Likelihood, optimum: Optimum, *, known: Array | None = None) -> Solved:
    """The covariances at an optimum: plain, and corrected for coloured residuals (Maine and Iliff 1981).

    Args:
        likelihood, optimum: what was sought, and where the search ended.
        known: information (p, p) that alone counts beside the records'; errors then may hold together over half an
            octave (`accuracy.covariance_by_octaves`), and hold what the model may lack (`missing_parts`). None: that of
            all priors, and they do not.
    """
    row = likelihood.row
    prior = row.prior(optimum.row)[2] if known is None else known
    if known is None:
        bound = accuracy.covariance(row, optimum.information, prior)
    else:  # noises that are not there have no information at all: what nothing tells is left out
        bound = np.asarray(np.linalg.pinv(optimum.information + known, hermitian=True), dtype=np.float64)
    white, sensitivities, rest = likelihood.whitened(optimum.row)
    lags = round(LAGS / likelihood.records[0].dt)
    corrected = accuracy.corrected_covariance(bound, rest + prior, white, sensitivities, lags=lags)
    places = row.places("parameter")
    kinds, lacking = (COLOURED,) * len(places), ()
    uncoloured, coloured = (np.diag(c)[places] for c in (bound, corrected))
    colour = np.sqrt(np.divide(coloured, uncoloured, out=np.ones_like(uncoloured), where=uncoloured > 0.0))
    if known is not None:
        by_octaves = accuracy.covariance_by_octaves(bound, rest + prior, white, sensitivities)
        widest = np.argmax([coloured, uncoloured, np.diag(by_octaves)[places]], axis=0)
        kinds = tuple((COLOURED, WHITE, BY_OCTAVES)[i] for i in widest)
        corrected = accuracy.covering(corrected, bound, by_octaves)
        parts = likelihood.missing_parts(optimum.row)
        if parts is not None:
            before = np.diag(corrected)[places]
            shifts = shifts_by(parts, bound, rest + prior, white, sensitivities, lags=lags)
            corrected = accuracy.covering(corrected, shifts.mean_square)
            wider = np.diag(corrected)[places] > WIDER**2 * before
            kinds = tuple(MODEL if more else kind for more, kind in zip(wider, kinds, strict=True))
            lacking = shifts.warnings([row.names[i] for i in places], places, before)
    numbers = row.numbers(likelihood.sized(optimum.row))
    return Solved(
        likelihood, likelihood, optimum, prior, bound, corrected, optimum.row, numbers, kinds, lacking, colour
    )


def solved_ahead(first: Solved, horizon: Horizon, solver: Solver, *, settling: float = 0.0) -> Solved:
    """The optimum of the errors ahead, from that of the likelihood and beside what that knows."""
    likelihood = first.likelihood
    criterion = MultiStepErrors(
        likelihood, first.full_row, likelihood.records, horizon=horizon, settling=settling, known=first.corrected
    )
    optimum = minimise(criterion, solver, start=criterion.start)
    optimum = replace(optimum, converged=optimum.converged and first.optimum.converged)
    prior = criterion.row.prior(optimum.row)[2]
    bound = accuracy.covariance(criterion.row, optimum.information, prior)
    white, sensitivities, rest = criterion.whitened(optimum.row)
    corrected = TWICE * accuracy.corrected_covariance(bound, rest + prior, white, sensitivities, lags=criterion.lags)
    row = criterion.whole_row(optimum.row)
    numbers = likelihood.row.numbers(row)
    kinds = (COLOURED,) * len(criterion.row.places("parameter"))
    return Solved(
        likelihood, criterion, optimum, prior, bound, corrected, row, numbers, kinds, first.lacking, first.colour
    )


def estimates_of(
    solved: Solved, start: Any, table: Parameterization | None = None
) -> tuple[tuple[Estimate, ...], list[str]]:
    """Every free or tied parameter with its bounds, and in words what physics forbids.

    Args:
        solved: where the search ended.
        start: the model before the fit, a vehicle or a state-space model.
        table: with ties and where priors come from (None: neither).
    """
    known = parameter_table(start)
    sources = {} if table is None else {free.name: free.source for free in table.free}
    entries, scales = [solved.row.entries[i] for i in solved.places], solved.row.scale[solved.places]
    sigma, corrected = (np.sqrt(np.maximum(np.diag(solved.scaled(c)), 0.0)) for c in (solved.bound, solved.corrected))
    total = np.diag(solved.optimum.information + solved.prior)[solved.places]
    estimates = []
    for i, entry in enumerate(entries):
        value, spread, held = solved.numbers[entry.name], float(sigma[i]), bool(np.isfinite(entry.sigma))
        exact = value + float(solved.left[solved.places[i]] * scales[i]) if held else value
        alone, apart = _against_prior(entry, exact, spread, float(corrected[i])) if held else (np.nan, np.nan)
        estimates.append(
            Estimate(
                name=entry.name,
                unit=known[entry.name].unit,
                start=known[entry.name].value,
                value=value,
                sigma=spread,
                sigma_corrected=float(corrected[i]),
                insensitivity=float(scales[i] / np.sqrt(total[i])) if total[i] > 0.0 else np.inf,
                prior_mean=entry.mean if held else None,
                prior_sigma=entry.sigma if held else None,
                prior_share=float(min(1.0, (spread / entry.sigma) ** 2)) if held else 0.0,
                at_bound=entry.name in solved.optimum.at_bound,
                prior_source=sources.get(entry.name, "") if held else "",
                alone=alone,
                disagreement=apart,
                bound=solved.kinds[i],
            )
        )
    if table is not None:
        estimates += _tied(solved, start, table)
    problems = [] if np.isfinite(solved.optimum.cost) else ["the cost is not finite"]
    for e, low, high in zip(estimates, *bounds_of(start, [e.name for e in estimates]), strict=True):
        if not (np.isfinite(e.value) and low - 1e-12 <= e.value <= high + 1e-12):
            problems.append(f"{e.name} = {e.value:.4g} is not physical (allowed: {low:g} to {high:g})")
    return tuple(estimates), problems


def _tied(solved: Solved, start: Any, table: Parameterization) -> list[Estimate]:
    card, values, estimates = parameter_table(start), solved.identified(table), []
    numbers = np.array([solved.numbers[name] for name in table.names])
    for name, expression in table.ties:
        gradient = np.array([_slope(table, numbers, name, i) for i in range(len(numbers))])
        sizes = [np.sqrt(max(gradient @ solved.scaled(c) @ gradient, 0.0)) for c in (solved.bound, solved.corrected)]
        entry = card[name]
        sigma, wider = map(float, sizes)
        estimates.append(Estimate(name, entry.unit, entry.value, values[name], sigma, wider, tie=expression.text))
    return estimates


_SEEN = 1.0 - 1e-6
"""Share of the information that is the prior's above which rounding hides what the flight says."""


def _against_prior(free: Entry, value: float, sigma: float, corrected: float) -> tuple[float, float]:
    """What the flight alone says, and how many sigmas that is from the prior (NaN, NaN where it says nothing).

    The prior's information is subtracted again: 1/F = 1/C - 1/P for the variances of flight, both and prior. A sharp
    prior holds the value almost still, so `value` must be the exact optimum. What coloured residuals add to the bound
    is added to the flight's.
    """
    if not sigma**2 < _SEEN * free.sigma**2:
        return float("nan"), float("nan")
    flight = 1.0 / (sigma**-2.0 - free.sigma**-2.0)
    alone = flight * (value / sigma**2 - free.mean / free.sigma**2)
    wider = max(1.0, (corrected / sigma) ** 2)
    return alone, (alone - free.mean) / float(np.sqrt(free.sigma**2 + wider * flight))


def _slope(table: Parameterization, numbers: Array, name: str, place: int) -> float:
    step = np.zeros(numbers.size)
    step[place] = 1e-6 * max(abs(numbers[place]), table.free[place].scale)
    high, low = table.identified(numbers + step)[name], table.identified(numbers - step)[name]
    return float((high - low) / (2.0 * step[place]))


def constants(solved: Solved, names: Sequence[str], groups: Sequence[str]) -> tuple[Constant, ...]:
    """What belongs to records and not to the model: delays, trims, start states, shifts, biases, gusts and gains.

    Args:
        solved: where the search ended. names: of the records, by the number in an entry's name.
        groups: of entries.
    """
    sigma = np.sqrt(np.maximum(np.diag(solved.bound), 0.0)) * solved.row.scale
    listed = []
    for entry, spread in zip(solved.row.entries, sigma.tolist(), strict=True):
        if entry.group in groups:
            name, _, number = entry.name.partition("[")
            value = solved.numbers[entry.name]
            record = names[int(number[:-1])] if number else ""
            spread *= value if entry.logarithmic else 1.0
            listed.append(Constant(record, name, record_unit(name), value, spread))
    return tuple(listed)
