"""The mean wind of a flight and the scale of its air speed, from air speed beside velocity over ground.

A flight that turns meets the wind from all sides: measured air speed = scale * |velocity - wind| (Klein and Morelli
2006, ch. 10). The wind is horizontal and constant; gusts stay in the residual, and the bounds know that they last.
"""

from __future__ import annotations

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.conditioning.filters import uniform_rate
from swashplate.flights.conditioning.regression import coloured_covariance
from swashplate.flights.flight import Flight

VELOCITY = ("vx", "vy", "vz")
AIR_SPEED = "airspeed"
SLOWEST = 5.0
"""m/s of air speed from which on a pitot tube tells it."""
_RATE, _LASTS = 5.0, 10.0
"""Samples a second that are used, and how long gusts are taken to last at most [s]."""
_LEAST, _STEPS = 100, 50
_APART = 50.0
"""Condition number from which on wind and scale are not told apart: nearly straight flight."""


def mean_wind(flight: Flight) -> tuple[Array, Array]:
    """Wind towards north and east [m/s] and the scale of the air speed, and their covariance, shapes (3,) and (3, 3).

    Args:
        flight: one uniform stream with `airspeed` and `vx`, `vy`, `vz`.

    Raises:
        FlightError: too little fast flight, or too few turns to tell wind and scale apart.
    """
    every = max(1, round(uniform_rate(flight) / _RATE))
    pieces = [np.column_stack([p.values(AIR_SPEED), p.array(VELOCITY)])[::every] for p in flight.split()]
    pieces = [part[part[:, 0] >= SLOWEST] for part in pieces]
    pieces = [part for part in pieces if len(part) > 1]
    if sum(map(len, pieces)) < _LEAST:
        raise FlightError(
            f"less than {_LEAST / _RATE:g} s are faster than {SLOWEST:g} m/s.",
            channel=AIR_SPEED,
            hint="Fly full circles at cruise.",
        )
    estimate = np.array([0.0, 0.0, 1.0])
    for _ in range(_STEPS):
        parts = [_linearised(part, estimate) for part in pieces]
        slopes, left = np.concatenate([s for s, _ in parts]), np.concatenate([r for _, r in parts])
        scaled = slopes / np.maximum(np.sqrt(np.mean(slopes**2, axis=0)), 1e-12)
        if np.linalg.cond(scaled) > _APART:
            raise FlightError(
                "the flight hardly turns: wind and scale of the air speed are not told apart.",
                channel=AIR_SPEED,
                hint="Fly full circles at cruise.",
            )
        step = np.linalg.lstsq(slopes, left, rcond=None)[0]
        estimate = np.asarray(estimate + step, dtype=np.float64)
        if np.max(np.abs(step)) < 1e-9:
            break
    lag, count = round(_LASTS * _RATE), sum(map(len, pieces))
    covariance = coloured_covariance([_linearised(part, estimate) for part in pieces], lag=lag)
    # Short records make these weights too sure: two sigmas become 1.96 + 2.97 lag / n (Kiefer and Vogelsang 2005).
    return estimate, covariance * (1.0 + 2.97 / 1.96 * lag / count) ** 2


def _linearised(part: Array, at: Array) -> tuple[Array, Array]:
    """Derivatives of the air speed by wind and scale (n, 3), and what is left of it (n,)."""
    through = part[:, 1:] - np.array([at[0], at[1], 0.0])
    speed = np.maximum(np.linalg.norm(through, axis=1), 1e-6)
    slopes = np.column_stack([-at[2] * through[:, 0] / speed, -at[2] * through[:, 1] / speed, speed])
    return slopes, part[:, 0] - at[2] * speed
