"""One step of Runge and Kutta's classical method of order 4."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from swashplate.jax_on_demand import jax, jnp

Rates = Callable[[Any, Any], Any]
"""`f(x, w)`: the rates of a row (or column, or number) under what drives it."""
Driving = Callable[[Any], Any]
"""What drives it at a fraction 0 to 1 of the step."""


def rk4_change(rates: Rates, x: Any, w: Driving, dt: Any, *, looped: bool = False) -> Any:
    """How far a step takes `x`; arguments as in `rk4_step`."""

    def stage(fraction: Any, weight: Any, carry: tuple[Any, Any]) -> tuple[Any, Any]:
        k, total = carry
        k = rates(x + (fraction * dt) * k, w(fraction))
        return k, total + (weight * dt) * k

    start = (0.0 * x, 0.0 * x)
    if not looped:
        for fraction, weight in ((0.0, 1.0 / 6.0), (0.5, 1.0 / 3.0), (0.5, 1.0 / 3.0), (1.0, 1.0 / 6.0)):
            start = stage(fraction, weight, start)
        return start[1]

    def numbered(i: Any, carry: tuple[Any, Any]) -> tuple[Any, Any]:
        # No table of the four: a loop that gathers is not compiled as one function.
        inner = (i == 1) | (i == 2)
        fraction = jnp.where(inner, 0.5, jnp.where(i == 0, 0.0, 1.0))
        return stage(fraction, jnp.where(inner, 1.0 / 3.0, 1.0 / 6.0), carry)

    return jax.lax.fori_loop(0, 4, numbered, start)[1]


def rk4_step(rates: Rates, x: Any, w: Driving, dt: Any, *, looped: bool = False) -> Any:
    """The state one step later.

    Args:
        rates: `f(x, w)`.
        x: the state: anything that can be added and multiplied by a number.
        w: what drives it at a fraction of the step; `lambda _: row` where it is held.
        dt: length of the step [s].
        looped: the four stages in an inner loop, for JAX: XLA's CPU compiler turns a small loop into one function.
    """
    return x + rk4_change(rates, x, w, dt, looped=looped)
