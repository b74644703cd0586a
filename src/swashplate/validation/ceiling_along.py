"""The black box for models that are flown along a record's inputs: what the inputs up to each instant tell of it.

As for predictions from many starts (`black_box`), it is a ridge regression by blocked cross-validation, its regressors
must not change with inputs to come, and inputs after the instant must not help.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from swashplate.arrays import Array
from swashplate.validation.black_box import AFTER, CROSSED, Ceiling, best_of_strengths, ridge
from swashplate.validation.block_bootstrap import BLOCK

FORGOTTEN = 10.0
"""Seconds after which the slowest average of the inputs has faded."""

_FIRST = 3.0  # seconds of inputs that are looked at one by one, ever more coarsely
_ROWS = 0.05  # seconds between rows that are learnt from
_ASIDE = 1.5  # seconds beside a block that are kept out of its regression: gusts last about as long
_STEPS_AFTER = 4

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
