"""What a procedure of the bench gives: numbers with their covariance, what was checked, and what to plot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from swashplate.arrays import Array
from swashplate.bench.record import BenchRecord
from swashplate.identification.core.result import Result
from swashplate.models.vehicle import Vehicle

if TYPE_CHECKING:
    from swashplate.bench.virtual_bench import RecordSchedule


@dataclass(frozen=True)
class BenchCheck:
    """One thing that could spoil a measurement, and what was found of it."""

    text: str
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
class Rows:
    """A table of what was measured, where a number or a curve does not say it all.

    Attributes:
        columns: heads with units.
        rows: cells, in words.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class BenchFinding:
    """A number that is no parameter of the card.

    Attributes:
        name, unit: what it is.
        value: the number.
        sigma: its standard deviation; `evaluate` adds what the held parameters' uncertainty makes of it.
        leans_on: derivatives of `value` by parameters that the procedure holds.
    """

    name: str
    value: float
    sigma: float
    unit: str = "1"
    leans_on: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class BenchResult:
    """What one procedure found.

    Attributes:
        procedure: its name, as in a record's header.
        title: what it measures.
        source: author, year and equation of its formula.
        names: the card's parameters that it estimates.
        values: shape (p,), in the card's units.
        covariance: shape (p, p), of this procedure's own measurements, what it holds taken as exact.
        records: the files it comes from.
        records_of: those of a parameter that comes from some of them only, by its name.
        checks: drift, repeatability, structure of the residuals, and what else it looked at.
        curves: for the report.
        left_out: which points it did not use, and why.
        leans_on: derivatives of `values` by the parameters that it holds, each (p,); `evaluate` propagates their
            uncertainty with them.
        findings: numbers that are no parameters of the card.
        tables: of what was measured.
    """

    procedure: str
    title: str
    source: str
    names: tuple[str, ...]
    values: Array
    covariance: Array
    records: tuple[str, ...]
    checks: tuple[BenchCheck, ...] = ()
    curves: tuple[Curve, ...] = ()
    left_out: tuple[str, ...] = ()
    leans_on: Mapping[str, Array] = field(default_factory=dict)
    findings: tuple[BenchFinding, ...] = ()
    tables: tuple[Rows, ...] = ()
    records_of: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        procedure: Procedure,
        records: Sequence[BenchRecord],
        checks: Sequence[BenchCheck],
        curves: Sequence[Curve],
        *,
        names: Sequence[str] = (),
        values: ArrayLike = (),
        covariance: ArrayLike | None = None,
        **more: Any,
    ) -> BenchResult:
        """A procedure's result from lists.

        Args:
            records, checks, curves: as the attributes.
            names, values: of parameters of the card; none where findings are all that there is.
            covariance: of the values, shape (p, p), or their variances, shape (p,).
            more: of the attributes that have defaults.
        """
        table = np.zeros((len(names),) * 2) if covariance is None else np.asarray(covariance, dtype=np.float64)
        return cls(
            procedure.name,
            procedure.title,
            procedure.source,
            tuple(names),
            np.asarray(values, dtype=np.float64),
            np.diag(table) if table.ndim == 1 else table,
            tuple(record.name for record in records),
            tuple(checks),
            tuple(curves),
            **more,
        )

    @property
    def sigma(self) -> Array:
        return np.sqrt(np.diag(self.covariance))

    def __getitem__(self, name: str) -> tuple[float, float]:
        """Value and standard deviation of a parameter."""
        place = self.names.index(name)
        return float(self.values[place]), float(self.sigma[place])


@dataclass(frozen=True)
class Procedure:
    """One measurement of the bench.

    Attributes:
        name: as in a record's header. title: what it measures. source: author, year and equation of its formula.
        columns: that its records must have.
        estimate: its numbers from records and the card's values.
        schedules: its records by the commands of hover; None where others plan them.
        in_time: whether it needs samples at a fixed rate.
    """

    name: str
    title: str
    source: str
    columns: tuple[str, ...]
    estimate: Callable[[Sequence[BenchRecord], Mapping[str, float]], BenchResult]
    schedules: Callable[[Mapping[str, float]], list[RecordSchedule]] | None = None
    in_time: bool = False


def weigh(values: Sequence[float], sigmas: Sequence[float]) -> tuple[float, float]:
    """Mean of several estimates of one number by their standard deviations, and its variance."""
    weights = np.array(sigmas) ** -2.0
    return float(weights @ values / weights.sum()), float(1.0 / weights.sum())


@dataclass(frozen=True)
class BenchDetails:
    """What the bench adds to a result.

    Attributes:
        results: of each procedure that has records, in the order of `PROCEDURES`.
        kept: parameters that the bench could measure and that no record was there for.
        disagreements: where two procedures measure the same parameter, in words.
    """

    kind: ClassVar[str] = "bench"
    results: tuple[BenchResult, ...]
    kept: tuple[str, ...]
    disagreements: tuple[BenchCheck, ...] = ()


Bench = Result[Vehicle, BenchDetails]
"""What `evaluate` returns: the vehicle with the measured card, and the joint covariance of what was measured.

There are no bounds corrected for coloured errors: averaged points have no order in time, and the procedures take their
scatter from the records themselves. None has failed: what contradicts itself ends in an error instead.
"""
