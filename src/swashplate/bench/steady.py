"""Steady points of a bench record and straight-line fits to them.

Sensor bias and steady drift are unknowns of every fit; what else can spoil a point is looked for in `checks`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.bench.record import BenchRecord
from swashplate.errors import BenchError

_FEWEST = 20
"""Samples of a point below which its mean and its settling cannot be told."""


@dataclass(frozen=True)
class SteadyPoints:
    """The steady points of one record, each averaged.

    Attributes:
        where: the record's name.
        time: middle of each point [s], shape (n,).
        mean: average of each channel, shape (n,).
        moving: second half less first half of each point, in standard deviations of that difference, shape (n,);
            empty where the record came averaged.
        scatter: standard deviation of a channel's samples within each point, shape (n,); empty likewise.
        hold, rate: length of the points [s] and samples per second, 0 likewise.
    """

    where: str
    time: Array
    mean: Mapping[str, Array]
    moving: Mapping[str, Array]
    scatter: Mapping[str, Array] = field(default_factory=dict)
    hold: float = 0.0
    rate: float = 0.0

    def __getitem__(self, channel: str) -> Array:
        return self.mean[channel]

    def __len__(self) -> int:
        return int(self.time.size)

    def where_true(self, kept: NDArray[np.bool_]) -> SteadyPoints:
        """Some of the points."""
        mean, moving, scatter = (
            {name: values[kept] for name, values in of.items()} for of in (self.mean, self.moving, self.scatter)
        )
        return replace(self, time=self.time[kept], mean=mean, moving=moving, scatter=scatter)


def steady_points(record: BenchRecord, channels: Sequence[str]) -> SteadyPoints:
    """Averages of a record's steady points.

    Raises:
        BenchError: where a column is missing, there is no point, or one is too short.
    """
    if record.averaged:
        rows = record.channels.get("time", np.arange(float(record["point"].size)))
        return SteadyPoints(record.name, rows, {name: record[name] for name in channels}, {})
    number = np.round(record["point"]).astype(int)
    edges = np.flatnonzero(np.diff(number, prepend=number[0] - 1))
    starts = edges[number[edges] > 0]
    if not starts.size:
        raise BenchError(
            "no sample belongs to a measuring point.",
            where=record.name,
            channel="point",
            hint="Number the points from 1; 0 means on the way.",
        )
    stops = np.r_[edges, number.size][np.searchsorted(edges, starts) + 1]
    short = np.flatnonzero(stops - starts < _FEWEST)
    if short.size:
        raise BenchError(
            f"point {number[starts[short[0]]]} has {stops[short[0]] - starts[short[0]]} samples, "
            f"expected at least {_FEWEST}.",
            where=record.name,
            channel="point",
            hint="Hold each point longer.",
        )
    mean, moving, scatter = {}, {}, {}
    for name in channels:
        values = record[name]
        parts = np.array(
            [[part.mean() for part in np.array_split(values[a:b], 8)] for a, b in zip(starts, stops, strict=True)]
        )
        mean[name] = np.array([values[a:b].mean() for a, b in zip(starts, stops, strict=True)])
        scatter[name] = np.array([values[a:b].std() for a, b in zip(starts, stops, strict=True)])
        halves = parts[:, 4:].mean(axis=1) - parts[:, :4].mean(axis=1)
        # Noise of a part by successive differences, which a drift hardly enters (von Neumann et al. 1941).
        noise = np.median(np.mean(np.diff(parts, axis=1) ** 2, axis=1)) / 2.0
        spread = np.sqrt(noise / 2.0 + np.finfo(float).tiny)
        moving[name] = halves / spread
    time = record["time"]
    middle = np.array([time[a:b].mean() for a, b in zip(starts, stops, strict=True)])
    hold = float(np.median(stops - starts)) * record.dt
    return SteadyPoints(record.name, middle, mean, moving, scatter, hold, 1.0 / record.dt)


@dataclass(frozen=True)
class SteadyLine:
    """A linear least-squares fit.

    Attributes:
        values, covariance: shape (p,) and (p, p); the noise is that of the residuals.
        residuals: shape (n,).
        spread: standard deviation of the residuals.
        freedom: degrees of freedom.
    """

    values: Array
    covariance: Array
    residuals: Array
    spread: float
    freedom: int


def fit_line(columns: Sequence[Array], measured: Array, *, where: str, weights: Array | None = None) -> SteadyLine:
    """`measured` as a sum of columns with unknown factors (weights: one over the standard deviation of each).

    Raises:
        BenchError: too few points, or columns that the points cannot tell apart.
    """
    matrix = np.column_stack(columns)
    n, p = matrix.shape
    if n < p + 2:
        raise BenchError(
            f"has {n} points for {p} unknowns, expected at least {p + 2}.",
            where=where,
            hint="Measure more points; `swash bench plan` says which.",
        )
    weighted = matrix if weights is None else matrix * weights[:, None]
    target = measured if weights is None else measured * weights
    scale = np.linalg.norm(weighted, axis=0)
    if not np.all(scale > 0.0) or np.linalg.cond(weighted / scale) > 1e10:
        raise BenchError(
            "its points do not tell the unknowns apart: something that has to be varied stood still.",
            where=where,
            hint="`swash bench plan` says what to vary.",
        )
    q, r = np.linalg.qr(weighted / scale)
    inverse = np.linalg.inv(r) / scale[:, None]
    values = inverse @ (q.T @ target)
    left = target - weighted @ values
    variance = float(left @ left) / (n - p)
    return SteadyLine(
        values, variance * inverse @ inverse.T, measured - matrix @ values, float(np.sqrt(variance)), n - p
    )


def nuisance(points: SteadyPoints) -> list[Array]:
    """Columns of a sensor's bias and steady drift over a record (drift per minute)."""
    return [np.ones(len(points)), (points.time - points.time.mean()) / 60.0]


def stacked(blocks: Sequence[Sequence[Array]]) -> list[Array]:
    """Columns that belong to one record each, padded with zeros for the others."""
    sizes = [len(block[0]) for block in blocks]
    columns = []
    for place, block in enumerate(blocks):
        before, after = sum(sizes[:place]), sum(sizes[place + 1 :])
        columns += [np.r_[np.zeros(before), column, np.zeros(after)] for column in block]
    return columns
