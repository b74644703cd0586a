"""How the clock of a log of Betaflight's SITL runs, from a stick that was sent and that it logged.

Its `micros64`, by which loops run and logs are stamped, and its `millis64`, whose pace the physics takes over, add up
time each by itself (sitl.c). They differed by 1.6 to 3.0 %, and a response is at another frequency by as much.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from swashplate.arrays import Array
from swashplate.errors import FlightError

_MOST, _STEP = 0.08, 0.002
"""Of the physics' second, by which one of the log may differ, and how finely that is looked for."""
_RATE = 50.0
"""Hz at which they are compared."""
_LIKE = 0.9
"""Correlation of the logged stick with what was sent from which on they are the same."""


class LogClock(NamedTuple):
    """When something began, on the log's clock [s], and seconds of the physics in one of the log."""

    start: float
    ratio: float


def log_clock(
    time: Array, stick: Array, sent: Callable[[Array], Array], seconds: float, about: float, *, channel: str
) -> LogClock:
    """Find what was sent in a logged stick.

    Args:
        time, stick: as logged, shape (n,).
        sent: the stick that was sent against the physics' time since it began, which is looked at for `seconds` [s].
        about: when it began if the log's clock were right [s].
        channel: of the log, for errors.

    Raises:
        FlightError: where the stick is not what was sent.
    """
    at = np.arange(time[0], time[-1], 1.0 / _RATE)
    logged = np.interp(at, time, stick)
    best = (0.0, about, 1.0)
    for ratio in np.arange(1.0 - _MOST, 1.0 + _MOST, _STEP):
        form = sent(np.arange(0.0, seconds, ratio / _RATE))
        if form.size >= logged.size:
            continue
        energy = np.convolve(logged**2, np.ones(form.size), "valid")
        like = np.abs(np.correlate(logged, form, "valid")) / np.sqrt(np.maximum(energy, 1e-12) * (form @ form))
        start = at[: like.size]
        like[np.abs(start - about) > 1.0 + _MOST * abs(about - time[0])] = 0.0
        k = int(np.argmax(like))
        best = max(best, (float(like[k]), float(start[k]), float(ratio)))
    size = float(np.std(logged))

    def missed(guess: Array) -> Array:
        return np.asarray(guess[2] * sent((at[near] - guess[0]) * guess[1]) - logged[near])

    near = (at > best[1]) & (at < best[1] + seconds / best[2])
    sign = np.sign(float(sent((at[near] - best[1]) * best[2]) @ logged[near])) or 1.0
    fitted = least_squares(missed, [best[1], best[2], sign * size], x_scale=[0.01, 1e-3, size or 1.0])
    start, ratio, _ = fitted.x
    form = sent((at[near] - start) * ratio)
    like = (
        abs(float(np.corrcoef(form, logged[near])[0, 1])) if np.ptp(form) > 0.0 and np.ptp(logged[near]) > 0.0 else 0.0
    )
    if like < _LIKE:
        raise FlightError(
            f"is not the stick that was sent (correlation {like:.2f}, expected {_LIKE:g}).", channel=channel
        )
    return LogClock(float(start), float(ratio))
