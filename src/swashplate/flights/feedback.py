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

FOLLOWS = 1.35
"""How many times more of a command past motion must leave than later motion, for the motion to follow it."""

NO_NEWS, NEWS, FRESH = 0.20, 0.40, 5e-4
"""Share of a command's news that motion explains: below the first, and if the news is more than rounding and noise (the
third, of the command's variance), something else moves it; an answer has the second.

How these six numbers were found, and how often they are wrong: `docs/decisions/0155-premises-of-gains.md`.
"""

_FLOOR, _DUST = 0.01, 1e-4  # of a command's variance: no log is exact to less (rounding, filters, clocks)
_NOISE = 0.02  # of each channel: the ridge
_STEP = 0.04  # s: averages over it keep the motion that is flown, and little of the sensors' noise
_SPAN = 0.5  # s: of the samples before and after
_LAGS = ((1, 2, 3, 5, 8, 12), (1, 3, 8), (1, 4))  # steps; the fewer, the shorter the record
_FADING = (1.0, 3.0)  # s: fading averages of what lies further back
_SLOW = 0.1  # Hz: what is slower is trim, drift and wind, and left out
_ROWS, _MOST_ROWS = 3.0, 3000  # rows of the regression per column, and enough of them


@dataclass(frozen=True)
class AnswerShares:
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
    def independent(self) -> bool:
        """Whether something else than past motion moves the command."""
        surprising = self.fresh >= FRESH and self.news < NO_NEWS
        return self.known and (self.past < OWN or self.follows or surprising)

    @property
    def answer(self) -> bool:
        """Whether the command is an answer to past motion; neither this nor `independent` where it cannot be told."""
        return self.known and not self.independent and self.past >= ANSWER and self.news >= NEWS


NOTHING = AnswerShares(*[float("nan")] * 4)


def told_by_motion(
    commands: Array, motion: Array, dt: float, *, at_once: Sequence[bool] = (), memory: bool = True
) -> tuple[AnswerShares, ...]:
    """What motion tells of each command.

    Args:
        commands: shape (n, m), evenly sampled. motion: shape (n, k).
        dt: sample time [s].
        at_once: which columns of the motion follow a command at once (forces, accelerations): their sample of the same
            instant counts as later only. None where not given.
        memory: whether averages over seconds and the motion's integral count too, as integral terms remember them, and
            as an attitude is the integral of a rate; else half a second alone.
    """
    table = _Table.of(commands, motion, dt, at_once)
    if table is None:
        return (NOTHING,) * commands.shape[1]
    until_then = ("now", "before", *(("long before", "sum") if memory else ()))
    from_then = ("now", "at once", "after", *(("long after", "sum") if memory else ()))
    past, later = table.left(*until_then), table.left(*from_then)
    shares = []
    for j in range(commands.shape[1]):
        fresh, news = (float(table.left(f"own {j}", *more)[j]) + _DUST for more in ((), until_then))
        share = AnswerShares(1.0 - float(past[j]), 1.0 - float(later[j]), 1.0 - news / fresh, fresh - _DUST)
        shares.append(share if table.moves[j] else NOTHING)
    return tuple(shares)


def share_of(command: Array, causes: Array, dt: float, *, past: bool = True) -> float:
    """Share of a command's variance that other signals explain, as sticks and set-points do; NaN where too short.

    Args:
        command: shape (n,). causes: shape (n, k). dt: sample time [s].
        past: by what they were until then; else by their values of the same instant alone.
    """
    table = _Table.of(command[:, None], causes, dt, ())
    if table is None or not table.moves[0]:
        return float("nan")
    return 1.0 - float(table.left("now", *(("before", "long before") if past else ()))[0])


@dataclass(frozen=True)
class _Table:
    """The columns of the regressions by their products, trends taken out; each command that moves is of variance one.

    Attributes:
        products: of the columns. with_commands: of columns and commands. group: of each column. rows: behind them.
        moves: which commands move.
    """

    products: Array
    with_commands: Array
    group: NDArray[np.str_]
    rows: int
    moves: NDArray[np.bool_]

    @classmethod
    def of(cls, commands: Array, motion: Array, dt: float, at_once: Sequence[bool]) -> _Table | None:
        """None where the record is too short for its channels, or nothing moves."""
        every, m = max(1, round(_STEP / dt)), commands.shape[1]
        n, step = len(commands) // every, every * dt
        slow = np.column_stack([commands, motion])[: n * every].reshape(n, every, -1).mean(axis=1)
        if n < 2:
            return None
        moves = np.ptp(slow, axis=0) > 1e-9 * np.max(np.abs(slow), axis=0)
        if not moves[:m].any() or not moves[m:].any():
            return None
        forces = np.asarray(at_once or np.zeros(motion.shape[1]), dtype=bool)[moves[m:]]
        u, y = _normal(slow[:, :m]), _normal(slow[:, m:][:, moves[m:]])
        trends = int(2.0 * _SLOW * n * step) + 2
        for given in _LAGS:
            lags = [lag for lag in given if lag <= 2 or lag * step <= _SPAN]
            most, columns = max(lags), trends + y.shape[1] * (2 + len(lags) + len(_FADING))
            if n - 2 * most >= _ROWS * columns:
                break
        else:
            return None
        # Neighbouring rows hardly differ: a long record needs no more of them than its columns ask for.
        at = np.arange(most, n - most, max(1, (n - 2 * most) // max(_MOST_ROWS, int(_ROWS * columns))))
        keep = np.exp(-step / np.array(_FADING))

        def near(sign: int) -> Array:
            return np.hstack([y[at + sign * lag] for lag in lags])

        def far(sign: int) -> Array:
            return np.hstack([_fading(y[::-sign], k)[::-sign][at] for k in keep])

        parts = {
            "now": y[at][:, ~forces],
            "at once": y[at][:, forces],
            "before": near(-1),
            "after": near(1),
            "long before": far(-1),
            "long after": far(1),
            "sum": _normal(np.cumsum(y, axis=0))[at],
            **{f"own {j}": np.stack([u[at - lag, j] for lag in lags], axis=1) for j in range(m)},
        }
        trend, _ = np.linalg.qr(np.cos(np.pi * np.outer((at + 0.5) / n, np.arange(trends))))
        table = np.hstack([*parts.values(), u[at]])
        table = (table - trend @ (trend.T @ table)) / np.sqrt(len(at))
        size = np.linalg.norm(table[:, -m:], axis=0)
        table[:, -m:] /= np.maximum(size, 1e-12)
        group = np.repeat(list(parts), [part.shape[1] for part in parts.values()])
        products = table.T @ table
        return cls(products[:-m, :-m], products[:-m, -m:], group, len(at) - trends, moves[:m] & (size > 1e-12))

    def left(self, *groups: str) -> Array:
        """Share of each command's variance that some groups of columns leave, per degree of freedom, shape (m,)."""
        used = np.isin(self.group, groups)
        products, wanted = self.products[np.ix_(used, used)], self.with_commands[used]
        ridge = np.where(np.char.startswith(self.group[used], "own"), 1e-8, _NOISE**2)
        inverse = np.linalg.inv(products + np.diag(ridge))
        weights = inverse @ wanted
        freedom = float(ridge.size - np.diag(inverse) @ ridge)
        rest = 1.0 - 2.0 * np.sum(weights * wanted, axis=0) + np.sum(weights * (products @ weights), axis=0)
        return np.asarray(np.maximum(rest, 0.0) * self.rows / max(self.rows - freedom, 1.0))


def _normal(values: Array) -> Array:
    """Columns about their means, of unit size."""
    centred = values - values.mean(axis=0)
    return np.asarray(centred / np.maximum(centred.std(axis=0), 1e-300))


def _fading(values: Array, keep: float) -> Array:
    """Averages of what came before, of which a row is worth `keep` of the one after it."""
    fading, state = np.empty_like(values), np.zeros(values.shape[1])
    for i, row in enumerate(values):
        fading[i] = state = keep * state + (1.0 - keep) * row
    return fading
