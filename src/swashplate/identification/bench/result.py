"""What a procedure of the bench gives: numbers with their covariance, what was checked, and what to plot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from swashplate.flights.flight import Array


@dataclass(frozen=True)
class Check:
    """One thing that could spoil a measurement, and what was found of it."""

    words: str
    good: bool = True


@dataclass(frozen=True)
class Curve:
    """Measured points and the fitted line of one plot.

    Attributes:
        title, x_title, y_title: with units.
        x, y: measured points.
        line_x, line_y: what the fit says.
        out_x, out_y: points that were left out.
        name: what the line is, where a plot has several.
    """

    title: str
    x_title: str
    y_title: str
    x: Array
    y: Array
    line_x: Array
    line_y: Array
    out_x: Array = field(default_factory=lambda: np.zeros(0))
    out_y: Array = field(default_factory=lambda: np.zeros(0))
    name: str = ""


@dataclass(frozen=True)
class BenchResult:
    """What one procedure found.

    Attributes:
        procedure: its name, as in a record's header.
        title: what it measures.
        source: author, year and equation of its formula.
        names: the card's parameters that it estimates.
        values: shape (p,), in the card's units.
        covariance: shape (p, p), of this procedure's own measurements.
        records: the files it comes from.
        checks: drift, repeatability, structure of the residuals, and what else it looked at.
        curves: for the report.
        left_out: which points it did not use, and why.
        leans_on: derivatives of `values` by other parameters that it takes as known, each (p,).
        findings: numbers that are no parameters of the card: (name, value, sigma, unit).
    """

    procedure: str
    title: str
    source: str
    names: tuple[str, ...]
    values: Array
    covariance: Array
    records: tuple[str, ...]
    checks: tuple[Check, ...] = ()
    curves: tuple[Curve, ...] = ()
    left_out: tuple[str, ...] = ()
    leans_on: Mapping[str, Array] = field(default_factory=dict)
    findings: tuple[tuple[str, float, float, str], ...] = ()

    @property
    def sigma(self) -> Array:
        return np.sqrt(np.diag(self.covariance))

    def __getitem__(self, name: str) -> tuple[float, float]:
        """Value and standard deviation of a parameter."""
        place = self.names.index(name)
        return float(self.values[place]), float(self.sigma[place])
