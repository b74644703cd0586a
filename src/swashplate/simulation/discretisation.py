"""Continuous linear models from sample to sample: exact, and as series where a derivative or C code is wanted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from swashplate.arrays import Array
from swashplate.physics.backend import Scalar

Rates = Callable[[Scalar, Scalar], Scalar]
"""`f(x, w)`: the rates of a row (or column, or number) under what drives it."""
Driving = Callable[[Scalar], Scalar]
"""What drives it at a fraction 0 to 1 of the step."""


def rk4_change(rates: Rates, x: Scalar, w: Driving, dt: Scalar) -> Scalar:
    """How far a step takes `x`; arguments as in `rk4_step`."""
    k, total = 0.0 * x, 0.0 * x
    for fraction, weight in ((0.0, 1.0 / 6.0), (0.5, 1.0 / 3.0), (0.5, 1.0 / 3.0), (1.0, 1.0 / 6.0)):
        k = rates(x + (fraction * dt) * k, w(fraction))
        total = total + (weight * dt) * k
    return total


def rk4_step(rates: Rates, x: Scalar, w: Driving, dt: Scalar) -> Scalar:
    """The state one step later.

    Args:
        rates: `f(x, w)`.
        x: the state: anything that can be added and multiplied by a number.
        w: what drives it at a fraction of the step; `lambda _: row` where it is held.
        dt: length of the step [s].
    """
    return x + rk4_change(rates, x, w, dt)


_SAMPLE = 1e-6
"""Share of a sample that counts as none."""


def zero_order_hold(A: Array, B: Array, dt: float) -> tuple[Array, Array]:
    """(F, G) of x' = A x + B u under inputs held for `dt` [s]: x+ = F x + G u."""
    n, m = B.shape
    block = np.zeros((n + m, n + m))
    block[:n, :n], block[:n, n:] = A, B
    step = expm(block * dt)  # as `scipy.signal.cont2discrete`, which takes a quarter of a second to import
    return np.asarray(step[:n, :n]), np.asarray(step[:n, n:])


def first_order_hold(A: NDArray[Any], B: NDArray[Any], dt: float) -> tuple[Any, Any, Any]:
    """Exact step for inputs that run straight between samples: x+ = F x + G0 u + G1 (u+ - u) (Van Loan 1978).

    SciPy's `cont2discrete` turns the state into one that is no sample of x; this does not.

    Args:
        A, B: of dx/dt = A x + B u, shapes (..., n, n) and (..., n, m), real or complex.
        dt: step [s].
    """
    n, m = B.shape[-2:]
    block = np.zeros((*B.shape[:-2], n + 2 * m, n + 2 * m), dtype=np.result_type(A, B))
    block[..., :n, :n], block[..., :n, n : n + m] = A, B
    block[..., n : n + m, n + m :] = np.eye(m) / dt
    step = expm(block * dt)
    return step[..., :n, :n], step[..., :n, n : n + m], step[..., :n, n + m :]


def held_series(A: Scalar, dt: Scalar, one: Scalar, *, terms: int = 4) -> tuple[Scalar, Scalar]:
    """(F, H) with F = e^(A dt) = 1 + dt A H, by the series to so many terms; inputs B held for dt act by dt H B.

    To fourth order it is what a Runge-Kutta step makes of a linear system. Only `@`, `*` and `+` are used: it can be
    differentiated, and CasADi can trace it.

    Args:
        A: shape (n, n).
        dt: step [s].
        one: the identity (n, n).
        terms: the order of the series.
    """
    H = one + ((1.0 / terms) * dt) * A
    for order in range(terms - 1, 1, -1):
        H = one + (((1.0 / order) * dt) * A) @ H
    return one + (dt * A) @ H, H


def held_late(A: Array, B: Array, dt: float, delays: Sequence[float]) -> tuple[Array, Array, Array, tuple[int, ...]]:
    """`zero_order_hold` with inputs that act at any time within a sample (Jury 1964, the modified z-transform; exact).

    Args:
        A, B: continuous model.
        dt: sample time [s].
        delays: of each input [s].

    Returns:
        F; what the command of so many whole samples ago does, and what the one before it does until that arrives, both
        (n, m); those numbers of whole samples.
    """
    samples = [int(np.floor(d / dt + _SAMPLE)) for d in delays]
    rest = [d - k * dt if d - k * dt > _SAMPLE * dt else 0.0 for d, k in zip(delays, samples, strict=True)]
    F, G = zero_order_hold(A, B, dt)
    now = G.copy()
    for part in {r for r in rest if r}:
        columns = [j for j, r in enumerate(rest) if r == part]
        now[:, columns] = zero_order_hold(A, B[:, columns], dt - part)[1]
    return F, now, G - now, tuple(samples)


def with_late_inputs(
    F: Array, G: Array, delays: Sequence[int], before: Array | None = None
) -> tuple[Array, Array, tuple[tuple[int, int], ...]]:
    """The sampled model with its inputs so many samples late, as states: of each late input its last commands.

    Args:
        F, G: sampled model.
        delays: in samples.
        before: what the command of one sample earlier still does (see `held_late`), shape of G.

    Returns:
        F and G of the larger model, and for each added state (input, samples ago).
    """
    n, m = G.shape
    if before is not None and np.any(before):
        still = [d + int(bool(np.any(before[:, j]))) for j, d in enumerate(delays)]
        larger, entering, waiting = with_late_inputs(F, G, still)
        for j, d in enumerate(delays):
            if still[j] > d:
                larger[:n, n + waiting.index((j, still[j]))] = before[:, j]
                if d == 0:
                    entering[:n, j] = G[:, j]
                else:
                    larger[:n, n + waiting.index((j, d))] = G[:, j]
        return larger, entering, waiting
    added = [(j, ago) for j, d in enumerate(delays) for ago in range(1, d + 1)]
    size = n + len(added)
    larger, entering = np.zeros((size, size)), np.zeros((size, m))
    larger[:n, :n] = F
    for i, (j, ago) in enumerate(added):
        if ago == delays[j]:
            larger[:n, n + i] = G[:, j]
        if ago == 1:
            entering[n + i, j] = 1.0
        else:
            larger[n + i, n + i - 1] = 1.0
    for j, d in enumerate(delays):
        if d == 0:
            entering[:n, j] = G[:, j]
    return larger, entering, tuple(added)
