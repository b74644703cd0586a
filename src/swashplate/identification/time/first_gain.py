"""A first gain for the innovations' form: Fisher scoring of the gain alone, the model held.

With the loop F = Phi - gain C, a change dK of the gain moves the errors e of covariance S by -C F^(d-1) dK e, d
samples later. So the slope of the likelihood is the sum of mu e', with mu = F' mu + C' S^-1 e run backward along the
record, and with white errors the information is W (x) S, where W = F' W F + C' S^-1 C is the loop's observability
Gramian: a discrete Lyapunov equation instead of a simulation for every entry of the gain. A step is
W^-1 (sum mu e') S^-1 / n.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from scipy.linalg import solve_discrete_lyapunov

from swashplate.arrays import Array
from swashplate.filtering.riccati import gain_at, settled_covariance, through
from swashplate.identification.time.linear_simulation import driven

_ITERATIONS, _SMALL = 15, 1.0
_DAMPING, _HOPELESS = 1e-2, 1e3

Run = Callable[[Array], tuple[float, Sequence[Array]]]
"""From a gain (n, m) to the cost, infinite where the filter diverges, and the errors of every record (n_t, m)."""


def kalman_gains(phi: Array, c: Array, gusts: Iterable[Array], sensors: Array) -> list[Array]:
    """Gains from errors to the next states, (n, m), of steady Kalman filters: stable ones to begin with.

    Args:
        phi, c: transition and outputs.
        gusts: covariances of what drives the states within a sample. sensors: of the outputs' noise.
    """
    gains = []
    for gust in gusts:
        try:
            settled = settled_covariance(through(phi, c, gust, sensors))
        except np.linalg.LinAlgError:
            continue  # something that lasts is not seen: no filter of this noise settles
        gains.append(np.asarray(phi @ gain_at(settled, c, sensors)))
    return gains


def first_gain(phi: Array, c: Array, candidates: Sequence[Array], run: Run) -> tuple[float, Array]:
    """The cost and the gain of the cheapest of some candidates, made better while the model is held.

    Args:
        phi, c: transition and outputs. candidates: gains (n, m). run: what a gain costs.
    """
    ran = [(run(gain), gain) for gain in candidates]
    (cheapest, _), gain_of_it = min(ran, key=lambda one: one[0][0])
    stable = [one for one in ran if np.max(np.abs(np.linalg.eigvals(phi - one[1] @ c))) < 1.0]  # others have no Gramian
    if not stable:
        return cheapest, gain_of_it
    (best, errors), gain = min(stable, key=lambda one: one[0][0])
    damping = _DAMPING
    for _ in range(_ITERATIONS):
        loop = phi - gain @ c
        if not np.isfinite(best) or np.max(np.abs(np.linalg.eigvals(loop))) >= 1.0:
            break
        stack = np.concatenate(errors)
        inverse = np.linalg.inv(stack.T @ stack / len(stack))
        gramian = solve_discrete_lyapunov(loop.T, c.T @ inverse @ c)
        slope = np.sum([_backward(part @ inverse @ c, loop).T @ part for part in errors], axis=0) @ inverse / len(stack)
        gained = 0.0
        while damping <= _HOPELESS and gained <= 0.0:
            tried = gain + np.linalg.solve(gramian + damping * np.diag(np.diag(gramian) + 1e-300), slope)
            cost, residuals = run(tried)
            gained = best - cost if np.isfinite(cost) else 0.0
            damping = damping / 10.0 if gained > 0.0 else 10.0 * damping
        if gained <= 0.0:
            break
        best, errors, gain = cost, residuals, tried
        if gained < _SMALL:
            break
    return (best, gain) if best <= cheapest else (cheapest, gain_of_it)


def _backward(pushed: Array, loop: Array) -> Array:
    """mu of the sample after each, (n_t, n), where mu = push + loop' mu of the sample after; none after the last."""
    return np.asarray(driven(np.zeros((1, len(loop))), loop.T, pushed[::-1, None])[0][::-1, 0])
