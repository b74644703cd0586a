"""What a coaxial pair loses in thrust against two single propellers.

    loss = 1 - T_pair(P) / (2 T_single(P / 2))

at the same electrical power P, by interpolation of log T over log P: the same pulse width is not the same speed once
two motors share a stream (the loss at equal pulse width is given beside it). One stream tube for both would lose
1 - 2^(-1/3) = 0.21 (momentum theory; Leishman 2006, sec. 2.15). Uncertainty is the scatter between runs (mounting,
battery, air), not that of samples within one.

What spoils it: ground effect and air that comes back (the pair sends down more of it), vibration of a propeller out of
balance, and runs on different days: an empty battery turns slower at the same pulse width.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.bench.record import BenchRecord
from swashplate.bench.result import BenchCheck, BenchFinding, BenchResult, Curve, Rows
from swashplate.errors import BenchError

NAME = "thrust_loss"
TITLE = "Thrust of propellers and what a coaxial pair loses"
SOURCE = "T over P at equal power; momentum theory as Leishman (2006), sec. 2.15"
COLUMNS = ("pwm", "thrust", "power")

_LEAST_SHARE = 0.2
"""Levels with less than this share of the largest thrust are left out: it is mostly friction and electronics."""
_SAME = 1e-6  # s: pulse widths closer than this are one level


@dataclass(frozen=True)
class ThrustLoss:
    """The loss of a pair.

    Attributes:
        pwm: levels that pairs and singles have in common [s], shape (n,).
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


def is_pair(record: BenchRecord) -> bool:
    """Whether two propellers turn.

    Raises:
        BenchError: where the header does not say.
    """
    told = record.header.get("propellers", "")
    if told not in ("1", "2"):
        raise BenchError(
            f"propellers is '{told}', expected 1 or 2.",
            where=record.name,
            channel="propellers",
            hint="Add '# propellers: 2' to the header. In a rig's file a motor turns that draws more than 1 A.",
        )
    return told == "2"


def thrust_loss(pairs: Sequence[BenchRecord], singles: Sequence[BenchRecord]) -> ThrustLoss:
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
    wrong = [run.name for run in pairs if not is_pair(run)] + [run.name for run in singles if is_pair(run)]
    if wrong:
        raise BenchError("turns the wrong number of propellers.", where=wrong[0], hint="Exchange pairs and singles.")
    levels = _levels((*pairs, *singles))
    if not levels.size:
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
        levels[kept],
        1.0 - pair[:, 0].mean(axis=0) / (2.0 * single[:, 0].mean(axis=0)),
        at_power,
        np.sqrt(_of_mean(by_pair) + _of_mean(by_single)),
        float(at_power[inside].mean()),
        float(np.sqrt(sum(_of_mean(rows[:, inside].mean(axis=1)) for rows in (by_pair, by_single)))),
    )


def estimate(records: Sequence[BenchRecord], card: Mapping[str, float]) -> BenchResult:
    """Thrust and power against pulse width of every set-up, and the loss of each pair of equal propellers, as findings.

    Args:
        records: runs; the header names `propellers` (1 or 2), `propeller` and, of a pair, `propeller_lower`.
        card: not used.

    Raises:
        BenchError: as `thrust_loss`, or for a set-up whose runs have no level in common.
    """
    set_ups: dict[tuple[str, str], list[BenchRecord]] = {}
    for record in records:
        upper = record.header.get("propeller", "propeller")
        set_ups.setdefault((upper, record.header.get("propeller_lower", upper) if is_pair(record) else ""), []).append(
            record
        )
    checks, curves, rows, findings = [], [], [], []
    for (upper, lower), runs in set_ups.items():
        name = f"{upper} over {lower}" if lower else f"{upper} alone"
        rows.append(_measured(name, runs))
        curves += _curves(name, runs)
        checks.append(_check_runs(name, runs))
        if not lower:
            continue
        singles = set_ups.get((upper, ""), [])
        if upper != lower or not singles:
            checks.append(
                BenchCheck(f"{name}: no run of the same propellers alone, so what the pair loses is not known.")
            )
            continue
        lost = thrust_loss(runs, singles)
        findings.append(BenchFinding(f"thrust that {name} loses at equal power", lost.mean, lost.mean_sigma))
        rows.append(_lost(name, lost))
        sure = np.isfinite(lost.at_power)
        for words, loss, at in (
            ("equal pulse width", lost.at_pwm, lost.pwm > 0.0),
            ("equal power", lost.at_power, sure),
        ):
            curves.append(
                Curve(f"Thrust that {name} loses", "pulse width [us]", "loss [%]", 1e6 * lost.pwm[at], 1e2 * loss[at],
                      1e6 * lost.pwm[at], 1e2 * loss[at], name=words)
            )  # fmt: skip
    return BenchResult.of_findings(NAME, TITLE, SOURCE, records, checks, curves, findings, tables=rows)


def _measured(name: str, runs: Sequence[BenchRecord]) -> Rows:
    """Thrust and power by level, with the scatter between runs."""
    levels = _levels(runs)
    if not levels.size:
        raise BenchError("has no pulse width in common with the other runs.", where=runs[0].name, hint="Use one set.")
    thrust, power = (_by_level(runs, levels, what) for what in ("thrust", "power"))

    def both(values: Array, i: int) -> tuple[str, str]:
        scatter = f"{values[:, i].std(ddof=1):.2f}" if len(runs) > 1 else "-"
        return f"{values[:, i].mean():.2f}", scatter

    return Rows(
        f"{name}, {len(runs)} runs",
        ("pulse width [us]", "thrust [N]", "between runs", "power [W]", "between runs"),
        tuple((f"{1e6 * level:.0f}", *both(thrust, i), *both(power, i)) for i, level in enumerate(levels)),
    )


def _lost(name: str, lost: ThrustLoss) -> Rows:
    def words(value: float, sigma: float) -> tuple[str, str]:
        return (f"{100 * value:.1f}", f"{100 * sigma:.1f}") if np.isfinite(value) else ("not reached", "-")

    return Rows(
        f"Thrust that {name} loses against two alone",
        ("pulse width [us]", "at equal pulse width [%]", "at equal power [%]", "sigma [%]"),
        tuple(
            (f"{1e6 * level:.0f}", f"{100 * at:.1f}", *words(power, sigma))
            for level, at, power, sigma in zip(lost.pwm, lost.at_pwm, lost.at_power, lost.sigma, strict=True)
        ),
    )


def _curves(name: str, runs: Sequence[BenchRecord]) -> list[Curve]:
    """Samples, and the mean of the runs by level."""
    levels = _levels(runs)
    return [
        Curve(f"{what.capitalize()} of {name}", "pulse width [us]", f"{what} [{unit}]",
              1e6 * np.concatenate([run["pwm"] for run in runs]), np.concatenate([run[what] for run in runs]),
              1e6 * levels, _by_level(runs, levels, what).mean(axis=0), name="mean of the runs")
        for what, unit in (("thrust", "N"), ("power", "W"))
    ]  # fmt: skip


def _check_runs(name: str, runs: Sequence[BenchRecord]) -> BenchCheck:
    """Whether runs repeat: their scatter at the highest level against its thrust."""
    if len(runs) < 2:
        return BenchCheck(f"{name}: one run, so how well it repeats is not known.", good=False)
    top = _by_level(runs, _levels(runs)[-1:], "thrust")[:, 0]
    share = float(top.std(ddof=1) / top.mean())
    words = f"{name}: runs repeat to {100 * share:.1f} % in thrust at the largest pulse width"
    wide = share > 0.05
    return BenchCheck(words + ("; mounting, battery or air changed between them." if wide else "."), good=not wide)


def _levels(runs: Sequence[BenchRecord]) -> Array:
    """Pulse widths that all runs have."""
    common = set.intersection(*({round(p / _SAME) for p in run["pwm"]} for run in runs))
    return np.array(sorted(common), dtype=np.float64) * _SAME


def _by_level(runs: Sequence[BenchRecord], levels: Array, what: str) -> Array:
    """Means by run and level, shape (runs, levels)."""
    return np.array([[run[what][np.abs(run["pwm"] - level) < _SAME].mean() for level in levels] for run in runs])


def _at_power(pair: Array, single: Array) -> Array:
    """Loss at the pair's powers; both are rows of thrust and power, shape (2, levels)."""
    half = np.log(pair[1] / 2.0)
    alone = np.exp(np.interp(half, np.log(single[1]), np.log(single[0]), left=np.nan, right=np.nan))
    return np.asarray(1.0 - pair[0] / (2.0 * alone))


def _of_mean(rows: Array) -> Array:
    """Variance of the mean over runs."""
    return np.asarray(np.var(rows, axis=0, ddof=1) / len(rows))
