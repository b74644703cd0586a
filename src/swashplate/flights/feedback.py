"""Is a command an answer to the motion? What motion until then and motion from then on tell of it.

A controller computes a command from the motion that it has seen: the motion until then explains the command, and what
follows explains it no better. A command from outside is told by the motion that follows it (Sims 1972: what a signal
does not cause tells nothing of its future; Ljung 1999, ch. 13). Past motion may tell such a command too, as far as it
repeats itself: a slow stick, a sweep. So it is also asked of its news, what a command's own past does not foretell. The
news of a controller's command is news of the motion; the news of a step or a stick is not.

All shares are of least squares with a small ridge: no controller differentiates a log without noise so often that it
inverts the aircraft, which least squares alone does with a simulated flight.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array

OWN, ANSWER = 0.70, 0.85
"""Share that past motion explains: below the first something else moves a command, from the second it may answer."""

FOLLOWS = 1.5
"""How many times more of a command past motion must leave than later motion, for the motion to follow it."""

NO_NEWS, NEWS, FRESH = 0.20, 0.40, 0.01
"""Share of a command's news that motion explains: below the first, and if the news is a hundredth of the command,
something else moves it; an answer has the second.

How these six numbers were found, and how often they are wrong: `docs/decisions/0156-moved-from-outside.md`.
"""

_FLOOR, _DUST = 0.01, 1e-4  # of a command's variance: no log is exact to less (rounding, filters, clocks)
_NOISE = 0.02  # of each channel: the ridge
_STEP = 0.04  # s: averages over it keep the motion that is flown, and little of the sensors' noise
_SPAN = 0.5  # s: of the samples before and after
_LAGS = ((1, 2, 3, 5, 8, 12), (1, 3, 8), (1, 4))  # steps; the fewer, the shorter the record
_FADING = (1.0, 3.0)  # s: fading averages of what lies further back
_SLOW = 0.1  # Hz: what is slower is trim, drift and wind, and left out
_ROWS = 3.0  # rows of the regression per column


@dataclass(frozen=True)
class Told:
    """What motion tells of a command; NaN where nothing can be said (something stands still, the record is short).

    Attributes:
        past: share of the command's variance that the motion until then explains. later: the same of the motion from
            then on; both know that instant.
        fresh: share of it that the command's own past does not foretell, its news. news: share of that which the
            motion until then explains.
    """

    past: float
    later: float
    news: float
    fresh: float

    @property
    def known(self) -> bool:
        """Whether anything can be said."""
        return bool(np.isfinite(self.past))

    @property
    def follows(self) -> bool:
        """Whether the motion follows the command: what comes later tells it much better."""
        return self.known and 1.0 - self.past + _FLOOR >= FOLLOWS * (1.0 - self.later + _FLOOR)

    @property
    def own(self) -> bool:
        """Whether something else than past motion moves the command."""
        surprising = self.fresh >= FRESH and self.news < NO_NEWS
        return self.known and (self.past < OWN or self.follows or surprising)

    @property
    def answer(self) -> bool:
        """Whether the command is an answer to past motion; neither this nor `own` where it cannot be told."""
        return self.known and not self.own and self.past >= ANSWER and self.news >= NEWS


NOTHING = Told(*[float("nan")] * 4)


def told_by_motion(
    command: Array, motion: Array, dt: float, *, at_once: Sequence[bool] = (), memory: bool = True
) -> Told:
    """What motion tells of a command.

    Args:
        command: shape (n,), evenly sampled. motion: shape (n, k).
        dt: sample time [s].
        at_once: which columns of the motion follow a command at once (forces, accelerations): their sample of the same
            instant counts as later only. None where not given.
        memory: whether averages over seconds and the motion's integral count too, as integral terms remember them, and
            as an attitude is the integral of a rate; else half a second alone.
    """
    table = _Table.of(command, motion, dt, at_once)
    if table is None:
        return NOTHING
    until_then = ("now", "before", *(("long before", "sum") if memory else ()))
    from_then = ("now", "at once", "after", *(("long after", "sum") if memory else ()))
    fresh = table.left("own")
    news = (table.left("own", *until_then) + _DUST) / (fresh + _DUST)
    return Told(1.0 - table.left(*until_then), 1.0 - table.left(*from_then), 1.0 - news, fresh)


def share_of(command: Array, causes: Array, dt: float, *, past: bool = True) -> float:
    """Share of a command's variance that other signals explain, as sticks and set-points do; NaN where too short.

    Args:
        command: shape (n,). causes: shape (n, k). dt: sample time [s].
        past: by what they were until then; else by their values of the same instant alone.
    """
    table = _Table.of(command, causes, dt, ())
    return float("nan") if table is None else 1.0 - table.left("now", *(("before", "long before") if past else ()))


@dataclass(frozen=True)
class _Table:
    """The columns of the regressions by their products, trends taken out; the command is of variance one."""

    products: Array
    with_command: Array
    group: NDArray[np.str_]
    rows: int

    @classmethod
    def of(cls, command: Array, motion: Array, dt: float, at_once: Sequence[bool]) -> _Table | None:
        """None where the record is too short for its channels, or nothing moves."""
        from scipy.signal import lfilter

        every = max(1, round(_STEP / dt))
        n, step = (len(command) - 1) // every, every * dt
        whole = np.column_stack([command, motion])[: n * every + 1]
        still = (
            np.ptp(whole, axis=0) <= 1e-9 * np.max(np.abs(whole), axis=0, initial=0.0) if n > 0 else np.ones(2, bool)
        )
        if still[0] or still[1:].all():
            return None
        forces = np.asarray(at_once or np.zeros(motion.shape[1]), dtype=bool)[~still[1:]]
        moved = _normal(whole[:, 1:][:, ~still[1:]])
        u, y, sums = whole[:-1:every, 0], moved[:-1:every], _normal(np.cumsum(moved, axis=0))[:-1:every]
        # Between instants averages: sensors' noise is no motion. They must not hold the instant itself, at which a
        # command that the motion follows has not acted yet.
        after = moved[1:].reshape(n, every, -1).mean(axis=1)
        before = np.concatenate([moved[:1], moved[:-1].reshape(n, every, -1).mean(axis=1)[:-1]])
        trends = int(2.0 * _SLOW * n * step) + 2
        for given in _LAGS:
            lags = [lag for lag in given if lag <= 2 or lag * step <= _SPAN]
            most, columns = max(lags), trends + y.shape[1] * (2 + len(lags) + len(_FADING))
            if n - 2 * most >= _ROWS * columns:
                break
        else:
            return None
        middle, keep = slice(most, n - most), np.exp(-step / np.array(_FADING))

        def near(values: Array, sign: int) -> Array:
            """Of averages on one side of each instant those some steps away; the first is none."""
            away = [sign * (lag - 1) for lag in lags]
            return np.hstack([values[most + by : n - most + by] for by in away])

        def far(values: Array, sign: int) -> Array:
            faded = [lfilter([1.0 - k], [1.0, -k], values[::-sign], axis=0)[::-sign][middle] for k in keep]
            return np.hstack(faded)

        parts = {
            "now": y[middle][:, ~forces],
            "at once": y[middle][:, forces],
            "before": near(before, -1),
            "after": near(after, 1),
            "long before": far(before, -1),
            "long after": far(after, 1),
            "sum": sums[middle],
            "own": np.stack([u[most - lag : n - most - lag] for lag in lags], axis=1),
        }
        trend, _ = np.linalg.qr(np.cos(np.pi * np.outer((np.arange(n)[middle] + 0.5) / n, np.arange(trends))))
        table = np.hstack([*parts.values(), u[middle, None]])
        table = table - trend @ (trend.T @ table)
        size = np.linalg.norm(table[:, -1])
        if not size > 1e-12 * np.linalg.norm(u):
            return None
        own = np.repeat(list(parts), [part.shape[1] for part in parts.values()]) == "own"
        scale = np.where(np.append(own, True), size, np.sqrt(len(table)))
        products = (table / scale).T @ (table / scale)
        group = np.repeat(list(parts), [part.shape[1] for part in parts.values()])
        return cls(products[:-1, :-1], products[:-1, -1], group, len(table) - trends)

    def left(self, *groups: str) -> float:
        """Share of the command's variance that some groups of columns leave, per degree of freedom."""
        used = np.isin(self.group, groups)
        products, wanted = self.products[np.ix_(used, used)], self.with_command[used]
        ridge = np.where(self.group[used] == "own", 1e-8, _NOISE**2)
        values, vectors = np.linalg.eigh(products + np.diag(ridge))
        weights = vectors @ ((vectors.T @ wanted) / values)
        freedom = float(np.sum(np.einsum("ij,ij->j", vectors, products @ vectors) / values))
        rest = 1.0 - 2.0 * float(weights @ wanted) + float(weights @ products @ weights)
        return max(rest, 0.0) * self.rows / max(self.rows - freedom, 1.0)


def _normal(values: Array) -> Array:
    """Columns about their means, of unit size."""
    moved = values - values.mean(axis=0)
    return np.asarray(moved / np.maximum(moved.std(axis=0), 1e-300))
