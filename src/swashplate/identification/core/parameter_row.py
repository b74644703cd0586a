"""The row of numbers that an estimator moves: every entry with its name, scale, bounds and prior."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array


@dataclass(frozen=True)
class Entry:
    """One number that an estimator moves.

    Attributes:
        name: what it is called in tables, e.g. "tau_f_upper" or "delay of record 1".
        group: "parameter", "nuisance", "noise" or "initial".
        start: first guess.
        scale: a change of the order that matters.
        lower, upper: bounds.
        mean, sigma: prior (sigma infinite: none).
        logarithmic: True where the row holds the natural logarithm.
        variance: True where that logarithm is of a deviation whose square adds to the measurements' variance.
        kinked: True where the cost bends suddenly, as a delay's does when a held command passes a sample.
    """

    name: str
    group: str
    start: float
    scale: float
    lower: float = -np.inf
    upper: float = np.inf
    mean: float = 0.0
    sigma: float = np.inf
    logarithmic: bool = False
    variance: bool = False
    kinked: bool = False


@dataclass(frozen=True)
class Row:
    """Entries in the order of the row; the row itself holds value / scale.

    Attributes:
        entries: what the row holds.
        prior_correlations: (place, other place, correlation) of priors that were measured together.
    """

    entries: tuple[Entry, ...]
    prior_correlations: tuple[tuple[int, int, float], ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(entry.name for entry in self.entries)

    def __len__(self) -> int:
        return len(self.entries)

    def column(self, field: str) -> Array:
        """A number of every entry; made once, for a search asks thousands of times."""
        if field not in self._columns:
            column = np.array([getattr(entry, field) for entry in self.entries], dtype=np.float64)
            column.flags.writeable = False
            self._columns[field] = column
        return self._columns[field]

    @cached_property
    def _columns(self) -> dict[str, Array]:
        return {}

    @property
    def scale(self) -> Array:
        return self.column("scale")

    def starts(self) -> Array:
        return self.column("start") / self.scale

    def bounds(self) -> tuple[Array, Array]:
        return self.column("lower") / self.scale, self.column("upper") / self.scale

    def numbers(self, row: Array) -> dict[str, float]:
        """What a scaled row holds by name, in units."""
        numbers, logarithmic = row * self.scale, self.column("logarithmic") > 0.0
        numbers = np.where(logarithmic, np.exp(np.where(logarithmic, numbers, 0.0)), numbers)
        return dict(zip(self.names, numbers.tolist(), strict=True))

    def prior(self, row: Array) -> tuple[float, Array, Array]:
        """Half the squared distance from the priors, its gradient and its Hessian (the priors' information)."""
        away = row - self.column("mean") / self.scale
        gradient = self.prior_information @ away
        return 0.5 * float(away @ gradient), gradient, self.prior_information

    @cached_property
    def prior_information(self) -> Array:
        """Inverse of the priors' scaled covariance, shape (p, p); zero where there is no prior."""
        sigma = self.column("sigma") / self.scale
        if not self.prior_correlations:
            return np.diag(sigma**-2.0)
        known = np.flatnonzero(np.isfinite(sigma))
        correlation = np.eye(len(self.entries))
        for first, second, value in self.prior_correlations:
            correlation[first, second] = correlation[second, first] = value
        information = np.zeros_like(correlation)
        weight = 1.0 / sigma[known]
        information[np.ix_(known, known)] = np.linalg.inv(correlation[np.ix_(known, known)]) * np.outer(weight, weight)
        return information

    def places(self, group: str) -> NDArray[np.intp]:
        """Indices of a group's entries."""
        return np.array([i for i, entry in enumerate(self.entries) if entry.group == group], dtype=np.intp)
