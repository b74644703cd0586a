"""Steady points of a bench record, straight-line fits to them, and the checks that every steady procedure makes.

Sensor bias and steady drift are unknowns of every fit. What they cannot take up shows in the residuals: ground effect
and recirculation bend them, a warm motor or a drifting sensor spreads repeats, vibration spreads samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from swashplate.errors import BenchError
from swashplate.flights.bench_record import BenchRecord
from swashplate.flights.flight import Array
from swashplate.identification.bench.result import Check

_FEWEST = 20
"""Samples of a point below which its mean and its settling cannot be told."""
_SURE = 1e-4
"""Significance at which a check speaks up."""


@dataclass(frozen=True)
class Points:
    """The steady points of one record, each averaged.

    Attributes:
        where: the record's name.
        time: middle of each point [s], shape (n,).
        mean: average of each channel, shape (n,).
        moving: second half less first half of each point, in standard deviations of that difference, shape (n,);
            empty where the record came averaged.
    """

    where: str
    time: Array
    mean: Mapping[str, Array]
    moving: Mapping[str, Array]

    def __getitem__(self, channel: str) -> Array:
        return self.mean[channel]

    def __len__(self) -> int:
        return int(self.time.size)

    def where_true(self, kept: NDArray[np.bool_]) -> Points:
        """Some of the points."""
        return Points(
            self.where,
            self.time[kept],
            {name: values[kept] for name, values in self.mean.items()},
            {name: values[kept] for name, values in self.moving.items()},
        )


def steady_points(record: BenchRecord, channels: Sequence[str]) -> Points:
    """Averages of a record's steady points.

    Raises:
        BenchError: where a column is missing, there is no point, or one is too short.
    """
    if record.averaged:
        rows = record.channels.get("time", np.arange(float(record["point"].size)))
        return Points(record.name, rows, {name: record[name] for name in channels}, {})
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
    mean, moving = {}, {}
    for name in channels:
        values = record[name]
        parts = np.array(
            [[part.mean() for part in np.array_split(values[a:b], 8)] for a, b in zip(starts, stops, strict=True)]
        )
        mean[name] = np.array([values[a:b].mean() for a, b in zip(starts, stops, strict=True)])
        halves = parts[:, 4:].mean(axis=1) - parts[:, :4].mean(axis=1)
        # Noise of a part by successive differences, which a drift hardly enters (von Neumann et al. 1941).
        noise = np.median(np.mean(np.diff(parts, axis=1) ** 2, axis=1)) / 2.0
        spread = np.sqrt(noise / 2.0 + np.finfo(float).tiny)
        moving[name] = halves / spread
    time = record["time"]
    return Points(record.name, np.array([time[a:b].mean() for a, b in zip(starts, stops, strict=True)]), mean, moving)


@dataclass(frozen=True)
class Line:
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


def fit_line(columns: Sequence[Array], measured: Array, *, where: str, weights: Array | None = None) -> Line:
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
    return Line(values, variance * inverse @ inverse.T, measured - matrix @ values, float(np.sqrt(variance)), n - p)


def nuisance(points: Points) -> list[Array]:
    """Columns of a sensor's bias and steady drift over a record (drift per minute)."""
    return [np.ones(len(points)), (points.time - points.time.mean()) / 60.0]


def stacked(blocks: Sequence[Sequence[Array]]) -> list[Array]:
    """Columns that belong to one record each, padded with zeros for the others."""
    sizes = [len(block[0]) for block in blocks]
    made = []
    for place, block in enumerate(blocks):
        before, after = sum(sizes[:place]), sum(sizes[place + 1 :])
        made += [np.r_[np.zeros(before), column, np.zeros(after)] for column in block]
    return made


def check_settled(points: Points, channel: str) -> Check:
    """Whether a channel still moved while the points were measured."""
    if channel not in points.moving:
        return Check(f"{points.where}: came averaged; whether {channel} was steady at its points cannot be told.")
    late = int(np.sum(np.abs(points.moving[channel]) > stats.norm.isf(_SURE / 2.0 / max(len(points), 1))))
    if not late:
        return Check(f"{points.where}: {channel} was steady at every point.")
    return Check(
        f"{points.where}: {channel} still moved during {late} of {len(points)} points: the rotors had not settled, "
        "the supply sagged, or air came back from walls and floor. Wait longer before each point.",
        good=False,
    )


def check_structure(line: Line, level: Array, *, what: str) -> list[Check]:
    """Repeatability, and whether the residuals bend with the level: the lack-of-fit test (Draper and Smith 1998, 2.1).

    Args:
        line: the fit.
        level: what was set at each point, equal for repeats.
        what: the residuals' channel and unit.
    """
    groups = [line.residuals[np.abs(level - value) < 1e-9] for value in np.unique(np.round(level, 9))]
    repeated = [group for group in groups if group.size > 1]
    freedom = sum(group.size - 1 for group in repeated)
    if freedom < 3:
        return [Check(f"{what}: too few points were repeated to tell how well they repeat.", good=False)]
    pure = sum(float(np.sum((group - group.mean()) ** 2)) for group in repeated)
    spread = float(np.sqrt(pure / freedom))
    checks = [Check(f"{what}: repeats of a point agree to {spread:.2g} (standard deviation, {freedom} pairs).")]
    extra = line.freedom - freedom
    if extra > 0 and pure > 0.0:
        lack = max(float(line.residuals @ line.residuals) - pure, 0.0) / extra
        if stats.f.sf(lack / (pure / freedom), extra, freedom) < _SURE:
            checks.append(
                Check(
                    f"{what}: the residuals have a structure beyond the repeats ({np.sqrt(lack):.2g} against "
                    f"{spread:.2g}): ground effect, air that comes back, or an effect that the formula lacks. "
                    "The bounds allow for its size, not for its sign.",
                    good=False,
                )
            )
        else:
            checks.append(Check(f"{what}: the residuals show no structure beyond the repeats."))
    return checks


def check_drift(value: float, sigma: float, *, span: float, what: str) -> Check:
    """What the sensor drifted over a record; it is taken out of the fit.

    Args:
        value, sigma: per minute.
        span: length of the record [s].
        what: channel and unit.
    """
    sure = abs(value) > 3.0 * sigma
    words = f"drifted by {value:.2g} a minute" if sure else "did not drift noticeably"
    return Check(f"{what} {words} over {span:.0f} s" + ("; the fit takes a steady drift out." if sure else "."))
