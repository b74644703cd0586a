"""What a predictor without physics reaches: ridge regression on past motion, past inputs and the inputs to come.

It is no rival but a ceiling: what it can say of a flight, some model can. It is given what a model's prediction is
given, the motion up to the start and the inputs up to the target, and nothing else. Two tests guard it:

* the regressors are made again from a record whose motion after a start and whose inputs after the target are spoilt;
  they must be the same to the last bit;
* the inputs after the target are added. What an aircraft did cannot come from them, so if they help, they tell the
  motion backwards, as a controller's answers do, and the inputs before the target do so too. Such a ceiling is refused,
  and that of the place or angle which integrates it.

The same regression without any input after the start cannot leak: it is what the past alone predicts.

The strength of the ridge is the one that predicts best (Hoerl and Kennard 1970), by channel: a ceiling may come out a
little too high, and is never low for a badly chosen number.

For models that are flown along a record's inputs (`ceiling_along`) it is told by the inputs up to each instant, by the
same regression and under the same guards.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.validation.block_bootstrap import BLOCK

MEMORY = 0.8
"""Seconds of past motion and inputs that are looked at; no regression row starts before."""

AFTER = 0.4
"""Seconds of inputs after the target that must not help."""

NO_INPUTS = -1.0
"""In place of those seconds: no inputs after the start at all."""

LEAK = 10.0
"""Percent of the error that they may seem to take away by chance."""

_PLACES, _SPEEDS = [0, 1, 2, 6, 7, 8], [3, 4, 5, 9, 10, 11]
"""Places and angles among the states, and what they are the integrals of: inputs that tell a speed backwards tell its
integral too, and those after the target, where the integral is over, do not show it."""

_ROWS = 0.05  # seconds between rows that are learnt from
_SETTLED = 0.5  # seconds beside a block that are kept out of its regression, beyond the horizon
_WINDOWS = (0.12, 0.3)  # seconds of past samples that tell where the body is and how it moves
_BACK = (0.1, 0.2, 0.4, MEMORY)
_EDGES = (0.0, 0.05, 0.1, 0.2, 0.4, MEMORY)
_STEPS_AHEAD, _STEPS_AFTER = 8, 4
_STRENGTHS = np.geomspace(0.1, 1e6, 15)
_FEWEST = 1.0  # rows of a regression per number that it finds


@dataclass(frozen=True)
class FilteredMotion:
    """One record as the regression sees it.

    Attributes:
        time: stamps [s], shape (n,), evenly spaced.
        inputs: commands (n, m).
        pose: the measured x, y, z [m] and phi, theta, psi [rad], shape (n, 6).
        truth: body states (n, 12) that predictions are held against, x, y, z, u, v, w, phi, theta, psi, p, q, r.
        starts: sample indices (s,) at which predictions are scored.
    """

    time: Array
    inputs: Array
    pose: Array
    truth: Array
    starts: NDArray[np.intp]

    @property
    def dt(self) -> float:
        return float((self.time[-1] - self.time[0]) / (self.time.size - 1))


Regressors = Callable[[FilteredMotion, NDArray[np.intp], int, float], Array]
"""(record, starts, samples ahead, seconds of inputs after the target or `NO_INPUTS`) to rows (s, columns)."""


@dataclass(frozen=True)
class Ceiling:
    """What the regression reached at one horizon.

    Attributes:
        how: "the flights of the fit" or "blocked cross-validation".
        squares: squared errors at each record's starts (s, 12), by record. past: the same without the inputs after the
            start.
        leak: share of the error [%] that inputs after the target take away, by state (12,).
        refused: why there is no ceiling at all; empty where there is one.
    """

    how: str
    squares: tuple[Array, ...] = ()
    past: tuple[Array, ...] = ()
    leak: Array | None = None
    refused: str = ""


TRAINED, CROSSED = "the flights of the fit", "blocked cross-validation"


def past_and_inputs(record: FilteredMotion, starts: NDArray[np.intp], ahead: int, after: float) -> Array:
    """Past motion in heading axes at several times, and averages of the inputs past and to come.

    Inputs count from their average over the second before the start, which stands beside them: a trim is no motion.
    """
    dt, n = record.dt, record.time.size
    short, long = (_known(record, seconds)[0] for seconds in _WINDOWS)
    columns = [short[starts], long[starts], record.pose[starts, 2:3]]
    columns += [short[np.maximum(starts - round(back / dt), 0)] for back in _BACK]
    total = np.concatenate([np.zeros((1, record.inputs.shape[1])), np.cumsum(record.inputs, axis=0)])

    def mean(first: NDArray[np.intp], last: NDArray[np.intp]) -> Array:
        low = np.clip(first, 0, n - 1)
        high = np.clip(last, low + 1, n)
        return np.asarray((total[high] - total[low]) / (high - low)[:, None])

    usual = mean(starts - round(1.0 / dt), starts + 1)
    columns.append(usual)
    back = np.round(np.array(_EDGES) / dt).astype(int)
    columns += [mean(starts - b, starts - a) - usual for a, b in pairwise(back)]
    if after < 0.0:
        return np.column_stack(columns)
    reach = np.unique(np.round(np.linspace(0, ahead, _STEPS_AHEAD + 1)).astype(int))
    if after:
        beyond = ahead + np.round(np.linspace(0.0, after / dt, _STEPS_AFTER + 1)).astype(int)
        reach = np.unique(np.concatenate([reach, beyond]))
    columns += [mean(starts + a, starts + b) - usual for a, b in pairwise(reach)]
    return np.column_stack(columns)


def ceiling(
    records: Sequence[FilteredMotion],
    horizon: float,
    *,
    training: Sequence[FilteredMotion] = (),
    regressors: Regressors = past_and_inputs,
) -> Ceiling:
    """What the regression reaches `horizon` seconds ahead.

    Args:
        records: what is predicted.
        horizon: seconds ahead.
        training: records to learn from; blocks of the predicted ones, each from all others, where there are none.
        regressors: what it may look at.
    """
    how = TRAINED if training else CROSSED
    ahead = round(horizon / records[0].dt)
    if any(_sees_the_future(record, ahead, regressors) for record in records):
        return Ceiling(how, refused="its regressors see the motion after the start")
    predicted, more, past = (
        _predicted(records, training, ahead, after, regressors) for after in (0.0, AFTER, NO_INPUTS)
    )
    if predicted is None or more is None or past is None:
        return Ceiling(how, refused="the flights are too short for it")
    before, after = (np.sqrt(np.mean(np.concatenate(each), axis=0)) for each in (predicted, more))
    leak = np.asarray(100.0 * (1.0 - after / np.maximum(before, 1e-300)))
    leak[_PLACES] = np.maximum(leak[_PLACES], leak[_SPEEDS])
    return Ceiling(how, tuple(predicted), tuple(past), leak)


def _known(record: FilteredMotion, seconds: float) -> tuple[Array, Array]:
    """Speeds, lean and turn rates (n, 8) in heading axes, and the pose (n, 6), from the samples up to each one.

    The end of a parabola through the last `seconds`, least squares.
    """
    length = max(5, round(seconds / record.dt) + 1)
    weights = np.linalg.pinv(np.vander(np.arange(1 - length, 1) * record.dt, 3, increasing=True))[:2]
    padded = np.concatenate([np.repeat(record.pose[:1], length - 1, axis=0), record.pose])
    value, slope = np.einsum(
        "ck,njk->cnj", weights, np.lib.stride_tricks.sliding_window_view(padded, length, axis=0), optimize=True
    )
    forward, right = _turned(slope[:, 0], slope[:, 1], value[:, 5])
    return np.column_stack([forward, right, slope[:, 2], value[:, 3:5], slope[:, 3:]]), value


def _turned(x: Array, y: Array, heading: Array) -> tuple[Array, Array]:
    c, s = np.cos(heading), np.sin(heading)
    return c * x + s * y, c * y - s * x


def _now(record: FilteredMotion) -> tuple[Array, Array]:
    """The states (n, 12) as far as they are known without later samples, and the heading (n,)."""
    motion, pose = _known(record, _WINDOWS[0])
    return np.column_stack([pose[:, :3], motion[:, :3], pose[:, 3:], motion[:, 5:]]), pose[:, 5]


def _in_heading(change: Array, heading: Array) -> Array:
    """Changes of state (s, 12) with the place turned into the heading at the start (or out of it, by the minus)."""
    turned = change.copy()
    turned[:, 0], turned[:, 1] = _turned(change[:, 0], change[:, 1], heading)
    return turned


def _sees_the_future(record: FilteredMotion, ahead: int, regressors: Regressors) -> bool:
    """Whether rows up to a start change with the motion after it, or with the inputs after its target."""
    if not record.starts.size:
        return False
    last = int(record.starts[record.starts.size // 2])
    before = record.starts[record.starts <= last]
    rng = np.random.default_rng(0)
    pose, truth, inputs = record.pose.copy(), record.truth.copy(), record.inputs.copy()
    for rows, first in ((pose, last + 1), (truth, last + 1), (inputs, last + ahead)):
        rows[first:] += 1.0 + rng.standard_normal(rows[first:].shape)
    spoilt = FilteredMotion(record.time, inputs, pose, truth, record.starts)
    return not np.array_equal(regressors(record, before, ahead, 0.0), regressors(spoilt, before, ahead, 0.0))


def _rows(record: FilteredMotion, ahead: int) -> NDArray[np.intp]:
    last = record.time.size - ahead - round(_WINDOWS[0] / record.dt)
    return np.arange(round(MEMORY / record.dt), max(last, 0), max(1, round(_ROWS / record.dt)), dtype=np.intp)


def _predicted(
    records: Sequence[FilteredMotion],
    training: Sequence[FilteredMotion],
    ahead: int,
    after: float,
    regressors: Regressors,
) -> list[Array] | None:
    """Squared errors at the starts of each record (s, 12), of the strength that is best for each state."""
    learnt = [_table(r, _rows(r, ahead), ahead, after, regressors) for r in (training or records)]
    asked = [_table(r, r.starts, ahead, after, regressors) for r in records]
    errors = [np.full((_STRENGTHS.size, *wanted.shape), np.nan) for _, wanted in asked]
    if training:
        X, Y = (np.concatenate(part) for part in zip(*learnt, strict=True))
        if len(X) < _FEWEST * X.shape[1]:
            return None
        for (rows, wanted), error in zip(asked, errors, strict=True):
            error[:] = ridge(X, Y, rows) - wanted
    else:
        times = [r.time[_rows(r, ahead)] for r in records]
        for place, record in enumerate(records):
            at = record.time[record.starts]
            aside = ahead * record.dt + _SETTLED
            for first in np.arange(at[0], at[-1] + 1e-9, BLOCK) if at.size else ():
                inside = (at >= first - 1e-9) & (at < first + BLOCK - 1e-9)
                free = [
                    (t < first - aside) | (t > first + BLOCK + aside) if i == place else np.ones(t.size, dtype=bool)
                    for i, t in enumerate(times)
                ]
                X, Y = (np.concatenate([p[k][f] for p, f in zip(learnt, free, strict=True)]) for k in (0, 1))
                if len(X) < _FEWEST * X.shape[1]:
                    return None
                rows, wanted = asked[place]
                errors[place][:, inside] = ridge(X, Y, rows[inside]) - wanted[inside]
    squares = [_out_of_heading(e, r) ** 2 for e, r in zip(errors, records, strict=True)]
    return best_of_strengths(squares)


def best_of_strengths(squares: Sequence[Array]) -> list[Array]:
    """Squared errors (s, k) by record of the strength that is best for each column, from (strengths, s, k)."""
    best = np.argmin(np.concatenate(squares, axis=1).mean(axis=1), axis=0)
    return [np.take_along_axis(s, best[None, None, :], axis=0)[0] for s in squares]


def _table(
    record: FilteredMotion, rows: NDArray[np.intp], ahead: int, after: float, regressors: Regressors
) -> tuple[Array, Array]:
    now, heading = _now(record)
    change = _in_heading(record.truth[rows + ahead] - now[rows], heading[rows])
    return regressors(record, rows, ahead, after), change


def _out_of_heading(errors: Array, record: FilteredMotion) -> Array:
    heading = _now(record)[1][record.starts]
    return np.stack([_in_heading(rows, -heading) for rows in errors])


def ridge(X: Array, Y: Array, asked: Array) -> Array:
    """Predictions (strengths, s, k) of ridge regressions by standardised columns; their means are free."""
    mean, size, level = X.mean(axis=0), X.std(axis=0), Y.mean(axis=0)
    size = np.where(size > 1e-12, size, np.inf)
    Z = (X - mean) / size
    stretch, turn = np.linalg.eigh(Z.T @ Z)
    rows, answer = (asked - mean) / size @ turn, turn.T @ (Z.T @ (Y - level))
    kept = 1.0 / (np.maximum(stretch, 0.0) + _STRENGTHS[:, None])
    return np.asarray(np.stack([(rows * k) @ answer for k in kept]) + level)


FORGOTTEN = 10.0
"""Seconds after which the slowest average of the inputs has faded."""

_FIRST = 3.0  # seconds of inputs that are looked at one by one, ever more coarsely
_ASIDE = 1.5  # seconds beside a block that are kept out of its regression: gusts last about as long

Bank = Callable[[Array, float, float], Array]
"""(inputs (n, m), step [s], seconds of inputs after each instant) to rows (n, columns)."""


def inputs_so_far(inputs: Array, dt: float, after: float) -> Array:
    """Averages of past inputs over steps that grow with age, and averages that fade ever more slowly."""
    from scipy.signal import lfilter  # half a second to import, and reports import this module

    n = len(inputs)
    total = np.concatenate([np.zeros((1, inputs.shape[1])), np.cumsum(inputs, axis=0)])
    at = np.arange(n)

    def mean(first: int, last: int) -> Array:
        """Of the inputs from `first` to `last` (not included) samples after each instant; the ends are held."""
        low = np.clip(at + first, 0, n - 1)
        high = np.clip(at + last, low + 1, n)
        return np.asarray((total[high] - total[low]) / (high - low)[:, None])

    ages = np.unique(np.concatenate([np.arange(4), np.round(np.geomspace(4, max(_FIRST / dt, 5.0), 12))]).astype(int))
    columns = [mean(-b + 1, -a + 1) for a, b in pairwise(ages)]
    for time in np.geomspace(2.0 * dt, FORGOTTEN, 8):
        keep = float(np.exp(-dt / time))
        columns.append(np.asarray(lfilter([1.0 - keep], [1.0, -keep], inputs - inputs[0], axis=0)))
    if after:
        reach = np.unique(np.round(np.linspace(0.0, after / dt, _STEPS_AFTER + 1)).astype(int))
        columns += [mean(a + 1, b + 1) for a, b in pairwise(reach)]
    return np.hstack(columns)


def ceiling_along(
    times: Sequence[Array], inputs: Sequence[Array], outputs: Sequence[Array], *, bank: Bank = inputs_so_far
) -> Ceiling:
    """What the inputs tell of each stretch, with a straight line solved for in it as a model's constants are.

    Args:
        times: stamps [s] of each stretch (n,), evenly spaced. inputs: (n, m). outputs: (n, k).
        bank: what the regression may look at.
    """
    steps = [float((t[-1] - t[0]) / (t.size - 1)) for t in times]
    if any(_sees_ahead(u, dt, bank) for u, dt in zip(inputs, steps, strict=True)):
        return Ceiling(CROSSED, refused="its regressors see the motion after the start")
    explained, more = (_explained(times, inputs, outputs, steps, after, bank) for after in (0.0, AFTER))
    if explained is None or more is None:
        return Ceiling(CROSSED, refused="the flights are too short for it")
    before, after = (np.sqrt(np.mean(np.concatenate(each), axis=0)) for each in (explained, more))
    return Ceiling(CROSSED, tuple(explained), (), np.asarray(100.0 * (1.0 - after / np.maximum(before, 1e-300))))


def _sees_ahead(inputs: Array, dt: float, bank: Bank) -> bool:
    last = len(inputs) // 2
    spoilt = inputs.copy()
    spoilt[last + 1 :] += 1.0 + np.random.default_rng(0).standard_normal(spoilt[last + 1 :].shape)
    return not np.array_equal(bank(inputs, dt, 0.0)[: last + 1], bank(spoilt, dt, 0.0)[: last + 1])


def _straightened(values: Array) -> Array:
    """Without the mean and the straight line of each column."""
    line = np.linspace(-1.0, 1.0, len(values))[:, None]
    level = values - values.mean(axis=0)
    return np.asarray(level - line * (line.T @ level) / np.sum(line**2))


def _explained(
    times: Sequence[Array],
    inputs: Sequence[Array],
    outputs: Sequence[Array],
    steps: Sequence[float],
    after: float,
    bank: Bank,
) -> list[Array] | None:
    rows = [_straightened(bank(u, dt, after)) for u, dt in zip(inputs, steps, strict=True)]
    wanted = [_straightened(y) for y in outputs]
    thin = [np.arange(0, t.size, max(1, round(_ROWS / dt))) for t, dt in zip(times, steps, strict=True)]
    predicted: list[list[Array]] = [[] for _ in times]
    for place, t in enumerate(times):
        for first in np.arange(t[0], t[-1] + 1e-9, BLOCK):
            inside = (t >= first - 1e-9) & (t < first + BLOCK - 1e-9)
            if not inside.any():
                continue
            free = [
                k[(s[k] < first - _ASIDE) | (s[k] > first + BLOCK + _ASIDE)] if i == place else k
                for i, (s, k) in enumerate(zip(times, thin, strict=True))
            ]
            X, Y = (np.concatenate([p[f] for p, f in zip(each, free, strict=True)]) for each in (rows, wanted))
            if len(X) < X.shape[1]:
                return None
            predicted[place].append(ridge(X, Y, rows[place][inside]))
    errors = [
        np.stack([_straightened(one - y) for one in np.concatenate(parts, axis=1)])
        for parts, y in zip(predicted, wanted, strict=True)
    ]
    return best_of_strengths([e**2 for e in errors])
