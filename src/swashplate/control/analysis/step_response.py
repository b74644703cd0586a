"""Numbers read off a step: rise, overshoot, settling, attitude quickness, and what other axes do meanwhile."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array

_SETTLED = 0.05
"""Share of the step within which a response has settled."""
_TAIL = 0.1
"""Last share of the record whose mean is the final value where none is wanted."""


@dataclass(frozen=True)
class StepMetrics:
    """Times after the step [s]; NaN where the record does not show one.

    Attributes:
        rise: from 10 to 90 % of the step.
        overshoot: beyond the final value, as a share of the step.
        settling: from when on it stays within 5 % of the step.
        peak: largest change from the start [unit of the response].
        quickness: largest rate over largest change [1/s]; of an attitude ADS-33E's attitude quickness.
        error: last value less the wanted one, as a share of the step.
    """

    rise: float
    overshoot: float
    settling: float
    peak: float
    quickness: float
    error: float


def step_metrics(time: Array, values: Array, *, wanted: float | None = None, rates: Array | None = None) -> StepMetrics:
    """Metrics of a response that begins with the step.

    Args:
        time: from the step on [s], shape (n,).
        values: of the response, shape (n,); the first one is its rest.
        wanted: the change that was asked for; without it the last tenth of the record says where the response ends, and
            one that ends below a third of its peak (a command that an outer loop takes back) has no rise or settling.
        rates: measured derivative; differences of the values where not given.
    """
    moved = np.asarray(values, dtype=np.float64) - values[0]
    t = np.asarray(time, dtype=np.float64) - time[0]
    largest = float(np.max(np.abs(moved)))
    derivative = np.gradient(moved, t) if rates is None else np.asarray(rates, dtype=np.float64)
    quickness = float(np.max(np.abs(derivative))) / largest if largest > 0.0 else float("nan")
    nothing = float("nan")
    final = wanted if wanted is not None else float(np.mean(moved[-max(1, int(_TAIL * moved.size)) :]))
    if largest == 0.0 or final == 0.0 or (wanted is None and abs(final) < largest / 3.0):
        return StepMetrics(nothing, nothing, nothing, largest, quickness, nothing)
    share = moved / final
    low, high = (_first(t, share, level) for level in (0.1, 0.9))
    outside = np.flatnonzero(np.abs(share - 1.0) > _SETTLED)
    settled = 0.0 if not outside.size else nothing if outside[-1] == t.size - 1 else float(t[outside[-1] + 1])
    return StepMetrics(
        rise=high - low,
        overshoot=max(float(np.max(share)) - 1.0, 0.0),
        settling=settled,
        peak=largest,
        quickness=quickness,
        error=float(share[-1] - 1.0),
    )


def _first(t: Array, share: Array, level: float) -> float:
    """When the response first reaches a share of the step, straight between samples."""
    above = np.flatnonzero(share >= level)
    if not above.size:
        return float("nan")
    k = int(above[0])
    if k == 0:
        return float(t[0])
    part = (level - share[k - 1]) / (share[k] - share[k - 1])
    return float(t[k - 1] + part * (t[k] - t[k - 1]))


def cross_ratio(on_axis: Array, off_axis: Array) -> float:
    """Largest change of the off-axis response over that of the on-axis one."""
    on, off = (float(np.max(np.abs(values - values[0]))) for values in (on_axis, off_axis))
    return off / on if on > 0.0 else float("nan")
