"""One step of Runge and Kutta's classical method of order 4."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Rates = Callable[[Any, Any], Any]
"""`f(x, w)`: the rates of a row (or column, or number) under what drives it."""
Driving = Callable[[Any], Any]
"""What drives it at a fraction 0 to 1 of the step."""


def rk4_change(rates: Rates, x: Any, w: Driving, dt: Any) -> Any:
    """How far a step takes `x`; arguments as in `rk4_step`."""
    k, total = 0.0 * x, 0.0 * x
    for fraction, weight in ((0.0, 1.0 / 6.0), (0.5, 1.0 / 3.0), (0.5, 1.0 / 3.0), (1.0, 1.0 / 6.0)):
        k = rates(x + (fraction * dt) * k, w(fraction))
        total = total + (weight * dt) * k
    return total


def rk4_step(rates: Rates, x: Any, w: Driving, dt: Any) -> Any:
    """The state one step later.

    Args:
        rates: `f(x, w)`.
        x: the state: anything that can be added and multiplied by a number.
        w: what drives it at a fraction of the step; `lambda _: row` where it is held.
        dt: length of the step [s].
    """
    return x + rk4_change(rates, x, w, dt)
