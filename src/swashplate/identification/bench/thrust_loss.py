"""What a coaxial pair loses in thrust against two single propellers.

    loss = 1 - T_pair(P) / (2 T_single(P / 2))

at the same electrical power P, by interpolation of log T over log P: the same pulse width is not the same speed once
two motors share a stream (the loss at equal pulse width is given beside it). One stream tube for both would lose
1 - 2^(-1/3) = 0.21 (momentum theory; Leishman 2006, sec. 2.15). Uncertainty is the scatter between runs (mounting,
battery, air), not that of samples within one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.errors import BenchError
from swashplate.flights.bench_tables import RigRun
from swashplate.flights.flight import Array

_LEAST_SHARE = 0.2
"""Levels with less than this share of the largest thrust are left out: it is mostly friction and electronics."""


@dataclass(frozen=True)
class ThrustLoss:
    """The loss of a pair.

    Attributes:
        pwm: levels that pairs and singles have in common [us], shape (n,).
        at_pwm: loss at the same pulse width.
        at_power: loss at the same power (NaN where the singles do not reach it).
        sigma: of `at_power`, by the scatter between runs.
        mean, mean_sigma: of `at_power` over the levels; runs are what is independent, not levels.
    """

    pwm: Array
    at_pwm: Array
    at_power: Array
    sigma: Array
    mean: float
    mean_sigma: float


def thrust_loss(pairs: Sequence[RigRun], singles: Sequence[RigRun]) -> ThrustLoss:
    """The loss from repeated runs of a pair and of its single propeller.

    Raises:
        BenchError: fewer than two runs of either (no uncertainty then), a single among the pairs or the other way
            round, or no level in common.
    """
    if min(len(pairs), len(singles)) < 2:
        raise BenchError(
            f"{len(pairs)} runs of the pair and {len(singles)} of the single propeller, expected two or more of each.",
            hint="Repeat the run: how well runs repeat is the uncertainty.",
        )
    wrong = [run.name for run in pairs if not run.coaxial] + [run.name for run in singles if run.coaxial]
    if wrong:
        raise BenchError("turns the wrong number of propellers.", where=wrong[0], hint="Exchange pairs and singles.")
    levels = sorted(set.intersection(*({float(p) for p in run.pwm} for run in (*pairs, *singles))))
    if not levels:
        raise BenchError("pairs and singles have no pulse width in common.", hint="Measure both at the same steps.")
    pair, single = (
        np.stack([_by_level(runs, levels, what) for what in ("thrust", "power")], axis=1) for runs in (pairs, singles)
    )
    kept = single[:, 0].mean(axis=0) > _LEAST_SHARE * single[:, 0].max()
    pair, single = pair[..., kept], single[..., kept]
    at_power = _at_power(pair.mean(axis=0), single.mean(axis=0))
    by_pair = np.array([_at_power(run, single.mean(axis=0)) for run in pair])
    by_single = np.array([_at_power(pair.mean(axis=0), run) for run in single])
    inside = np.isfinite(by_pair).all(axis=0) & np.isfinite(by_single).all(axis=0)
    if not inside.any():
        raise BenchError("pairs and singles have no power in common.", hint="Run the singles to full power.")
    at_power = np.where(inside, at_power, np.nan)
    return ThrustLoss(
        np.array(levels)[kept],
        1.0 - pair[:, 0].mean(axis=0) / (2.0 * single[:, 0].mean(axis=0)),
        at_power,
        np.sqrt(_of_mean(by_pair) + _of_mean(by_single)),
        float(at_power[inside].mean()),
        float(np.sqrt(sum(_of_mean(rows[:, inside].mean(axis=1)) for rows in (by_pair, by_single)))),
    )


def _by_level(runs: Sequence[RigRun], levels: Sequence[float], what: str) -> Array:
    """Means by run and level, shape (runs, levels)."""
    return np.array([[getattr(run, what)[run.pwm == level].mean() for level in levels] for run in runs])


def _at_power(pair: Array, single: Array) -> Array:
    """Loss at the pair's powers; both are rows of thrust and power, shape (2, levels)."""
    half = np.log(pair[1] / 2.0)
    alone = np.exp(np.interp(half, np.log(single[1]), np.log(single[0]), left=np.nan, right=np.nan))
    return np.asarray(1.0 - pair[0] / (2.0 * alone))


def _of_mean(rows: Array) -> Array:
    """Variance of the mean over runs."""
    return np.asarray(np.var(rows, axis=0, ddof=1) / len(rows))
