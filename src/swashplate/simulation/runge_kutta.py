"""One step of Runge and Kutta's classical method of order 4, and many of them: what every compiled loop is made of."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from jaxtyping import Float, Int

from swashplate.jax_on_demand import jax, jnp

Rates = Callable[[Any, Any], Any]
"""`f(x, w)`: the rates of a row (or column, or number) under what drives it."""
Driving = Callable[[Any], Any]
"""What drives it at a fraction 0 to 1 of the step."""


def rk4_change(rates: Rates, x: Any, w: Driving, dt: Any, *, looped: bool) -> Any:
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


def rk4_step(rates: Rates, x: Any, w: Driving, dt: Any, *, looped: bool) -> Any:
    """The state one step later.

    Args:
        rates: `f(x, w)`.
        x: the state; an array, or with stages written out anything that can be added and multiplied by a number.
        w: what drives it at a fraction of the step; `lambda _: row` where it is held.
        dt: length of the step [s].
        looped: the four stages in an inner loop. XLA's CPU compiler turns a small loop into one function instead of 75
            separately launched kernels (measured: 2.6 times faster for one CoaX). Written out, a batch is 2.3 times
            faster in float32, and CasADi and NumPy can run it.
    """
    return x + rk4_change(rates, x, w, dt, looped=looped)


def rk4_steps(rates: Rates, x: Any, w: Callable[[Any, Any], Any], dt: Any, count: int | Int[jax.Array, ""]) -> Any:
    """The state `count` steps later, each with its stages in a loop; `w(i, fraction)` drives step i."""
    if isinstance(count, int) and count == 1:
        return rk4_step(rates, x, lambda fraction: w(0.0, fraction), dt, looped=True)

    def step(i: Any, x: Any) -> Any:
        return rk4_step(rates, x, lambda fraction: w(i, fraction), dt, looped=True)

    return jax.lax.fori_loop(0, count, step, x)


def rk4_and_slope(
    rates: Callable[[Any], Any],
    x: Float[jax.Array, " states"],
    dt: Float[jax.Array, ""],
    count: Int[jax.Array, ""],
) -> tuple[Any, Any]:
    """The state `count` steps later, and its rates there: `rates` stands once in the compiled code.

    All stages are in one loop, and the first of the step that is not taken gives the rates.
    """

    def evaluated(i: Int[jax.Array, ""], carry: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
        x, k, total = carry
        stage = i % 4
        inner, last = (stage == 1) | (stage == 2), stage == 3
        fraction = jnp.where(inner, 0.5, jnp.where(stage == 0, 0.0, 1.0))
        k = rates(x + (fraction * dt) * k)
        total = total + (jnp.where(inner, 1.0 / 3.0, 1.0 / 6.0) * dt) * k
        return jnp.where(last, x + total, x), jnp.where(last, 0.0, k), jnp.where(last, 0.0, total)

    x, k, _ = jax.lax.fori_loop(0, 4 * count + 1, evaluated, (x, jnp.zeros_like(x), jnp.zeros_like(x)))
    return x, k
