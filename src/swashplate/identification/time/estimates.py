"""What an optimum says: estimates with both bounds, what the flight says without the prior, and each record's own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.filtering.nuisance import PUSHES
from swashplate.identification.core import accuracy
from swashplate.identification.core.parameters import Free, Parameterization
from swashplate.identification.core.result import Constant, Estimate
from swashplate.identification.core.scoring import Optimum, Sought
from swashplate.models.vehicle import Vehicle

_UNITS = {"delay": "s", "trim": "1", "lever": "m", "level": "rad", **dict.fromkeys(PUSHES[:3], "m/s^2")}
_UNITS |= dict.fromkeys(PUSHES[3:], "rad/s^2")
"""Units of what belongs to a record, by its name or the first word of that."""


def record_unit(name: str) -> str:
    """Unit of a constant that belongs to a record."""
    return _UNITS.get(name) or _UNITS[name.split("_")[0]]


@dataclass(frozen=True)
class Found:
    """An optimum with its covariances and the step that is left to the exact one, scaled.

    Attributes:
        table, criterion, optimum: what was sought, and where the search ended.
        logs: names of the flights that have constants of their own.
        prior: the priors' information (p, p).
        plain, corrected: covariances (p, p) of the row, without and with the colour of the residuals.
        left: Newton's step from where the search ended (p,).
    """

    table: Parameterization
    criterion: Criterion
    logs: tuple[str, ...]
    optimum: Optimum
    prior: Array
    plain: Array
    corrected: Array
    left: Array

    @property
    def places(self) -> NDArray[np.intp]:
        return self.criterion.row.places("parameter")

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle with what the search found."""
        return self.table.vehicle.with_values(self.table.identified(self.numbers[: len(self.table.free)]))

    @property
    def numbers(self) -> Array:
        return np.asarray(self.optimum.row * self.criterion.row.scale)

    def scaled(self, covariance: Array) -> Array:
        """A covariance of the parameters in their units."""
        scale = self.criterion.row.scale[self.places]
        return np.asarray(covariance[np.ix_(self.places, self.places)] * np.outer(scale, scale))


class Criterion(Sought, Protocol):
    """What was minimised: a likelihood, or errors some time ahead."""

    def whitened(self, row: Array) -> tuple[list[Array], list[Array], Array]:
        """Per record: whitened errors and their sensitivities, and information that lies elsewhere."""
        ...


def found_at(
    table: Parameterization, likelihood: Criterion, optimum: Optimum, *, logs: tuple[str, ...], lags: int
) -> Found:
    """The covariances at an optimum: plain, and corrected for coloured residuals (Maine and Iliff 1981).

    Args:
        table, likelihood, optimum: what was sought, and where the search ended.
        logs: names of the flights that have constants of their own.
        lags: how many errors of correlation to allow for.
    """
    prior = likelihood.row.prior(optimum.row)[2]
    plain = accuracy.covariance(likelihood.row, optimum.information, prior)
    white, sensitivities, rest = likelihood.whitened(optimum.row)
    corrected = accuracy.corrected_covariance(plain, rest + prior, white, sensitivities, lags=lags)
    gradient = likelihood.scores(optimum.row)[1] + likelihood.row.prior(optimum.row)[1]
    return Found(table, likelihood, logs, optimum, prior, plain, corrected, -plain @ gradient)


def estimates_of(best: Found, vehicle: Vehicle) -> tuple[tuple[Estimate, ...], list[str]]:
    """Every free or tied parameter with its bounds, and in words what physics forbids."""
    table = best.table
    k = len(table.free)
    values = table.identified(best.numbers[:k])
    card = vehicle.card.parameters
    sigma = np.sqrt(np.maximum(np.diag(best.scaled(best.plain)), 0.0))
    corrected = np.sqrt(np.maximum(np.diag(best.scaled(best.corrected)), 0.0))
    estimates, problems = [], []
    scales = best.criterion.row.scale
    total = np.diag(best.optimum.information + best.prior)[best.places]
    insensitivity = scales[best.places] / np.sqrt(np.maximum(total, 1e-300))
    for i, free in enumerate(table.free):
        exact = values[free.name] + float(best.left[i] * scales[i])
        alone, apart = _against_prior(free, exact, float(sigma[i]), float(corrected[i]))
        estimates.append(
            Estimate(
                name=free.name,
                unit=card[free.name].unit,
                start=card[free.name].value,
                value=values[free.name],
                sigma=float(sigma[i]),
                sigma_corrected=float(corrected[i]),
                insensitivity=float(insensitivity[i]),
                prior_mean=free.mean,
                prior_sigma=free.sigma,
                prior_share=0.0 if free.sigma is None else float(min(1.0, (sigma[i] / free.sigma) ** 2)),
                at_bound=free.name in best.optimum.at_bound,
                prior_source=free.source if free.sigma is not None else "",
                alone=alone,
                disagreement=apart,
            )
        )
    for name, expression in table.ties:
        gradient = np.array([_slope(table, best.numbers[:k], name, i) for i in range(k)])
        sizes = [float(np.sqrt(max(gradient @ best.scaled(c) @ gradient, 0.0))) for c in (best.plain, best.corrected)]
        estimates.append(
            Estimate(
                name=name,
                unit=card[name].unit,
                start=card[name].value,
                value=values[name],
                sigma=sizes[0],
                sigma_corrected=sizes[1],
                tie=expression.text,
            )
        )

    for name, value in values.items():
        low, high = card[name].lower, card[name].upper
        inside = (low is None or value >= low - 1e-12) and (high is None or value <= high + 1e-12)
        if not (np.isfinite(value) and inside):
            problems.append(f"{name} = {value:.4g} is not physical (allowed: {low} to {high})")
    if not np.isfinite(best.optimum.cost):
        problems.append("the cost is not finite")
    return tuple(estimates), problems


_SEEN = 1.0 - 1e-6
"""Share of the information that is the prior's above which rounding hides what the flight says."""


def _against_prior(free: Free, value: float, sigma: float, corrected: float) -> tuple[float, float]:
    """What the flight alone says, and how many sigmas that is from the prior (NaN, NaN where it says nothing).

    The prior's information is subtracted again: 1/F = 1/C - 1/P for the variances of flight, both and prior. A sharp
    prior holds the value almost still, so `value` must be the exact optimum. What coloured residuals add to the bound
    is added to the flight's.
    """
    if free.mean is None or free.sigma is None or not sigma**2 < _SEEN * free.sigma**2:
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


def constants(best: Found) -> tuple[Constant, ...]:
    """Delays, trims and lever arms of every log."""
    row = best.criterion.row
    sigma = np.sqrt(np.maximum(np.diag(best.plain), 0.0)) * row.scale
    estimates = []
    for i in row.places("nuisance"):
        name, _, number = row.names[i].partition("[")
        unit = record_unit(name)
        record = best.logs[int(number[:-1])]
        estimates.append(Constant(record, name, unit, float(best.numbers[i]), float(sigma[i])))
    return tuple(estimates)
