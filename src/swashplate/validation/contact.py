"""Was the aircraft touched? Residual accelerations that depend on where it is or where its nose points.

A tether, a cable or a touch pushes in one part of the room or beyond one heading, and gusts do not. What the
observer saw act beside a model's equations is compared inside and outside of every part of the room and of the headings
that lies beyond a limit. Noise has a largest difference too: surrogates of the residual with the same
spectrum and random phases (Theiler et al. 1992) say how large, over all places, headings and axes together.

Nothing is taken out of the data. A mask is proposed; scores are told with and without it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array

CHANCE = 0.01
"""Chance that a record without contact is called touched, over all places, headings and axes."""

LEAST = 0.15
"""Push [m/s^2] below which it is no contact worth a mask: the accuracy of tilt and trim is no better."""

_SURROGATES, _SEED = 499, 7
_STEP = 0.1  # seconds between residuals that are compared
_LEAST_SHARE = 0.05  # of a record that may be inside or outside
_AXES = ("forward", "right", "down")
_FEATURES = (("psi", 8), ("x", 0), ("y", 1), ("z", 2))
_SHORTEST = 10.0  # seconds


@dataclass(frozen=True)
class Contact:
    """A proposed mask: a part of the headings or of the room in which something pushes.

    Attributes:
        record: the record's name. feature: "psi", "x", "y" or "z". above: True for values above the limit, False for
            those below. limit: its value [rad or m].
        axis: "forward", "right" or "down" (body). push: mean residual inside less that outside [m/s^2].
        chance: that noise gives as much anywhere. share: part of the record inside.
        intervals: stamps (start, stop) [s] of the mask.
    """

    record: str
    feature: str
    above: bool
    limit: float
    axis: str
    push: float
    chance: float
    share: float
    intervals: tuple[tuple[float, float], ...]

    @property
    def summary_text(self) -> str:
        unit = "rad" if self.feature == "psi" else "m"
        side = "above" if self.above else "below"
        return (
            f"CONTACT? {self.record}, {self.feature} {side} {self.limit:.2f} {unit} ({100.0 * self.share:.0f} % "
            f"of it): pushed {self.axis} by {self.push:+.2f} m/s^2, chance {self.chance:.3f}. A tether, a cable "
            "or a touch, or equations that are wrong just there. Nothing was left out."
        )

    def touches(self, start: Array, horizon: float) -> NDArray[np.bool_]:
        """Which predictions from starts (s,) [s] meet the mask within the horizon [s]."""
        hit = np.zeros(start.shape, dtype=bool)
        for first, last in self.intervals:
            hit |= (start <= last) & (start + horizon >= first)
        return hit


def contact(name: str, time: Array, states: Array, pushes: Array) -> Contact | None:
    """The part of the headings or the room in which a record is pushed, or None.

    Args:
        name: of the record. time: stamps [s], shape (n,), evenly spaced. states: body states (n, 12), as measured.
        pushes: accelerations of u, v, w beside the equations [m/s^2], shape (n, 3) or more.
    """
    if time[-1] - time[0] < _SHORTEST:
        return None
    dt = float((time[-1] - time[0]) / (time.size - 1))
    kept = np.arange(0, time.size, max(1, round(_STEP / dt)))
    residual, measured = pushes[kept, :3], states
    states = states[kept]
    rng = np.random.default_rng(_SEED)
    scatter = np.maximum(residual.std(axis=0), 1e-12)
    white = (residual - residual.mean(axis=0)) / scatter
    rows = np.concatenate([white.T[None], _surrogates(white, rng)])  # (1 + surrogates, axes, n)
    best, split = np.zeros(len(rows)), None
    for feature, column in _FEATURES:
        values = states[:, column]
        if np.ptp(values) <= 0.0:
            continue
        order = np.argsort(values, kind="stable")
        n = order.size
        sums = np.cumsum(rows[:, :, order], axis=2)[:, :, :-1]
        below = np.arange(1, n)
        allowed = (below >= _LEAST_SHARE * n) & (n - below >= _LEAST_SHARE * n)
        # Rows have mean zero, so the difference of both means over its error is this.
        size = np.abs(sums) / np.sqrt(below * (n - below) / n)
        size = np.where(allowed, size, 0.0).reshape(len(rows), -1)
        top = size.argmax(axis=1)
        if split is None or size[0, top[0]] > best[0]:
            axis, cut = divmod(int(top[0]), n - 1)
            split = (feature, column, axis, 0.5 * float(values[order[cut]] + values[order[cut + 1]]))
        best = np.maximum(best, size[np.arange(len(rows)), top])
    chance = float(np.mean(best[1:] >= best[0]) * _SURROGATES + 1.0) / (_SURROGATES + 1.0)
    if split is None or chance > CHANCE:
        return None
    feature, column, axis, limit = split
    values = states[:, column]
    above = bool(np.mean(values > limit) <= 0.5)  # the smaller part is the odd one
    inside = values > limit if above else values < limit
    push = float(residual[inside, axis].mean() - residual[~inside, axis].mean())
    if abs(push) < LEAST:
        return None
    beyond_limit = measured[:, column] > limit if above else measured[:, column] < limit
    return Contact(
        name, feature, above, limit, _AXES[axis], push, chance, float(inside.mean()), _intervals(time, beyond_limit, dt)
    )


def _surrogates(rows: Array, rng: np.random.Generator) -> Array:
    """Series of the same spectrum with random phases (surrogates, axes, n), the same phases for all axes."""
    n = len(rows)
    lines = np.fft.rfft(rows, axis=0).T
    turn = np.exp(2j * np.pi * rng.random((_SURROGATES, 1, lines.shape[1])))
    return np.asarray(np.fft.irfft(lines * turn, n, axis=2))


def _intervals(time: Array, inside: NDArray[np.bool_], dt: float) -> tuple[tuple[float, float], ...]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], inside.astype(int), [0]])))
    return tuple(
        (float(time[a]), float(time[b - 1]))
        for a, b in zip(edges[::2], edges[1::2], strict=True)
        if (b - a) * dt > 0.05
    )
