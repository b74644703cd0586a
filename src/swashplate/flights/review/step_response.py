"""The step response of a rate loop from an ordinary flight: target and motion, deconvolved.

The motion is the target passed through an impulse response (`impulse_fit`), and gusts. Its sum is the step response.

Its premise is that nothing but the target moves the motion that the target tells of. An attitude loop breaks it: a gust
turns the aircraft, and the target follows. That is seen where the motion comes before its target, and the response is
refused. Where an angle is asked for that moves by itself, it stands for the target (instruments).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.review.impulse_fit import Excerpt, ImpulseFit, jackknife, quantile
from swashplate.flights.review.stretches import Stretch

BEFORE, AFTER = 0.15, 0.85
"""Seconds before and after the target in which the motion is looked for."""
FASTEST = 250.0
"""Hz: the loops of helicopters and multirotors settle in 20 ms at the least."""
_SLOWEST = 20.0
"""Hz: slower, nothing of a rise is seen."""
_WINDOW = 3.0  # s
_LEAST = 6  # windows
_ENOUGH = 200  # windows: ten minutes
_MOVED = np.deg2rad(10.0)  # rad/s: a target that stays below in a window tells nothing there
_EXPLAINED = 0.5  # of the motion's power in the windows, by the target
_EARLY = 0.08  # of the step that stands before its target
_SETTLED = (0.5, 1.5)  # of the target, that a rate loop reaches; PIDtoolbox asks for the same
_WIDE = 0.35  # half of the band, from which on it says nothing
_RESOLVED = 2.0  # samples that the rise takes at least
_STAGE = 0.3  # of the target's power that an angle must explain to stand for it


@dataclass(frozen=True)
class LoopNumber:
    """A number with its standard error."""

    value: float
    error: float

    def __str__(self) -> str:
        return f"{self.value:.3g} ± {self.error:.2g}"


@dataclass(frozen=True)
class StepResponse:
    """What a rate loop makes of a step of its target, of 1.

    Attributes:
        time: [s] from the step, shape (n,); response, low, high: and its 95 % band, shape (n,).
        delay: [s] until half of the final value is reached.
        rise: [s] from 10 to 90 % of it.
        overshoot: highest value above the final one, as a part of it.
        final: mean of the last 0.3 s.
        bandwidth: where the gain has fallen by 3 dB [Hz]; None where the log does not reach it.
        windows: of 3 s, that were used; explained: share of the motion's power that the target tells.
        reference: the channel that stands for the target (two stages), "" where the target itself was used.
    """

    time: Array
    response: Array
    low: Array
    high: Array
    delay: LoopNumber
    rise: LoopNumber
    overshoot: LoopNumber
    final: LoopNumber
    bandwidth: LoopNumber | None
    windows: int
    explained: float
    reference: str = ""

    def __str__(self) -> str:
        ms = [f"{1e3 * each.value:.0f} ± {max(1e3 * each.error, 0.5):.0f} ms" for each in (self.delay, self.rise)]
        over = f"{100.0 * self.overshoot.value:.0f} ± {100.0 * self.overshoot.error:.0f} %"
        wide = f", bandwidth {self.bandwidth} Hz" if self.bandwidth is not None else ""
        return (
            f"delay {ms[0]}, rise {ms[1]}, overshoot {over}, final value {self.final}{wide} "
            f"({self.windows} windows; the target tells {100.0 * self.explained:.0f} % of the motion)"
        )


class StepResponseError(Exception):
    """Why there is none, in words."""


def step_response(pieces: Sequence[Stretch], *, usable: float, reference: str = "") -> StepResponse:
    """The step response of a loop.

    Args:
        pieces: target, motion [rad/s], and where there is one the angle that is asked for, side by side.
        usable: frequency [Hz] up to which target and motion are coherent.
        reference: name of that angle.

    Raises:
        StepResponseError: what the log lacks, in words.
    """
    if not pieces:
        raise StepResponseError("no stretch without a gap is 4 s long")
    fast = [piece for piece in pieces if piece.rate >= _SLOWEST]  # some modes log faster than others
    if not fast:
        slow = f"logged at {max(piece.rate for piece in pieces):.3g} Hz"
        raise StepResponseError(f"{slow}, {_SLOWEST:g} Hz are needed. Log the rate loop faster")
    rate = float(np.median([piece.rate for piece in fast]))
    alike = [piece for piece in fast if abs(piece.rate - rate) < 0.05 * rate]
    windows = _windows(alike, rate)
    if len(windows) < _LEAST:
        raise StepResponseError(
            f"the target did not move: it passes {np.rad2deg(_MOVED):.0f} deg/s in {len(windows)} windows of "
            f"{_WINDOW:g} s, {_LEAST} are needed"
        )
    before, after = round(BEFORE * rate), round(AFTER * rate)
    fit = ImpulseFit(windows, before, after, rate)
    if reference and fit.explained_target >= _STAGE:
        fit = fit.by_instruments()
    early, its_error = fit.early()
    if abs(early) > max(_EARLY, 2.0 * its_error):
        raise StepResponseError(
            f"the motion comes before its target ({100.0 * early:.0f} % of the step): an outer loop answers what "
            "disturbs the aircraft, and nobody moved the target"
        )
    response, *left_out = fit.steps()
    if fit.explained < _EXPLAINED:
        raise StepResponseError(
            f"the target tells {100.0 * max(fit.explained, 0.0):.0f} % of the motion, {100.0 * _EXPLAINED:.0f} % are "
            "needed: gusts or noise move it"
        )
    readings = [_readings(row, rate) for row in (response, *left_out)]
    if not all(np.isfinite(each).all() for each in readings):
        raise StepResponseError("the motion does not reach its target within the time that is looked at")
    best, others = readings[0], np.asarray(readings[1:])
    spread, sigma = jackknife(np.asarray(left_out)), jackknife(others)
    sigma[2] = max(sigma[2], spread[int(np.argmax(response))])  # a flat top is no surer than the curve there
    delay, rise, overshoot, final = (LoopNumber(float(v), float(e)) for v, e in zip(best[:4], sigma[:4], strict=True))
    band = quantile(len(left_out)) * spread
    if not _SETTLED[0] < final.value < _SETTLED[1]:
        raise StepResponseError(f"the motion settles at {final.value:.2g} of its target: no loop holds it there")
    if rise.value * rate < _RESOLVED:
        raise StepResponseError(
            f"logged at {rate:.3g} Hz: the rise takes less than {_RESOLVED:g} samples. Log the rate loop faster"
        )
    if float(band.max()) > _WIDE:
        raise StepResponseError(
            f"its band is ± {float(band.max()):.2g} wide: more of the target's own motion is needed"
        )
    wide = LoopNumber(float(best[4]), float(sigma[4])) if best[4] <= usable else None
    return StepResponse(
        np.arange(after + 1) / rate,
        response,
        response - band,
        response + band,
        delay,
        rise,
        overshoot,
        final,
        wide,
        len(windows),
        fit.explained,
        reference if fit.instruments else "",
    )


def _windows(pieces: Sequence[Stretch], rate: float) -> list[Excerpt]:
    """The windows in which the target moves; where there are many, those in which it moves most."""
    size, before, after = round(_WINDOW * rate), round(BEFORE * rate), round(AFTER * rate)
    excerpts = []
    for piece in pieces:
        x, y = (piece.values[:, k] - piece.values[:, k].mean() for k in (0, 1))
        asked = np.gradient(piece.values[:, 2]) * rate if piece.values.shape[1] > 2 else None
        for a in range(after, len(x) - size - before + 1, size):
            around = slice(a - after, a + size + before)
            if np.max(np.abs(x[a : a + size])) >= _MOVED:
                excerpts.append(Excerpt(x[around], y[a : a + size], None if asked is None else asked[around]))
    if len(excerpts) > _ENOUGH:
        least = np.sort([float(np.std(window.target)) for window in excerpts])[-_ENOUGH]
        excerpts = [window for window in excerpts if float(np.std(window.target)) >= least]
    return excerpts


def _readings(step: Array, rate: float) -> Array:
    """Delay and rise [s], overshoot, final value and bandwidth [Hz] of a step response; NaN for what is not reached."""
    time = np.arange(step.size) / rate
    final = float(np.mean(step[time > time[-1] - 0.3]))
    part = step / final if final > 0.0 else np.full(step.shape, np.nan)

    half = np.flatnonzero(part >= 0.5)
    if not half.size or not np.any(part >= 0.9):
        return np.full(5, np.nan)

    def crossed(level: float, k: int) -> float:
        """Where the level is crossed before sample k [s]."""
        return float(time[k - 1] + (level - part[k - 1]) / (part[k] - part[k - 1]) / rate) if k else 0.0

    first = int(half[0])
    below = np.flatnonzero(part[:first] < 0.1)  # noise may touch it long before
    tenth = crossed(0.1, int(below[-1]) + 1 if below.size else 0)
    most = crossed(0.9, int(np.flatnonzero(part >= 0.9)[0]))
    over = float(np.max(part)) - 1.0
    return np.array([crossed(0.5, first), most - tenth, over, final, _bandwidth(step, final, rate)])


def _bandwidth(step: Array, final: float, rate: float) -> float:
    """Where the gain has fallen by 3 dB [Hz]; half the rate where it never does."""
    frequency = np.geomspace(0.2, 0.45 * rate, 300)
    time = (np.arange(step.size) - 0.5) / rate
    gain = np.abs(np.exp(-2j * np.pi * np.outer(frequency, time)) @ np.diff(step, prepend=0.0)) / final
    level = 10.0 ** (-3.0 / 20.0)
    low = np.flatnonzero(gain < level)
    if not low.size or not low[0]:
        return 0.5 * rate if not low.size else float(frequency[0])
    k = int(low[0])
    return float(np.interp(-level, -gain[[k - 1, k]], frequency[[k - 1, k]]))
