"""First-order lags from time histories: one time constant, everything else in the response linear and eliminated.

Variable projection (Golub and Pereyra 1973): for each time constant the linear unknowns follow by least squares, so
that only one number is searched. Bounds allow for coloured residuals (vibration) as those of the flight fits do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter

from swashplate.arrays import Array
from swashplate.bench.result import BenchCheck
from swashplate.errors import BenchError
from swashplate.identification.core import accuracy

_CORRELATED = 0.3
"""Seconds of residual correlation that the bounds allow for."""


def first_order(command: Array, tau: float, dt: float) -> Array:
    """Response of `tau xdot + x = command` to a command held between samples, settled at the start; shape as command.

    Exact for held inputs: x[i+1] = a x[i] + (1 - a) u[i], a = exp(-dt / tau). Works along the first axis.
    """
    a = float(np.exp(-dt / tau))
    return np.asarray(lfilter([0.0, 1.0 - a], [1.0, -a], command - command[:1], axis=0) + command[:1])


@dataclass(frozen=True)
class LagFit:
    """A fitted time constant.

    Attributes:
        tau, sigma: [s], bound corrected for coloured residuals.
        linear: the linear unknowns.
        model, residuals: shape (n,).
    """

    tau: float
    sigma: float
    linear: Array
    model: Array
    residuals: Array


def fit_lag(
    response: Callable[[float], tuple[Array, Sequence[Array]]],
    measured: Array,
    *,
    dt: float,
    bounds: tuple[float, float],
    where: str,
) -> LagFit:
    """The time constant whose response fits best.

    Args:
        response: for a time constant, what has no unknown factor (n,) and the columns that have one.
        measured: shape (n,).
        dt: sample interval [s].
        bounds: what the time constant may be [s].
        where: the record, for errors.

    Raises:
        BenchError: where the best lies on a bound: the record holds no such response.
    """

    def solved(tau: float) -> tuple[Array, Array, Array]:
        known, columns = response(tau)
        matrix = np.column_stack(list(columns))
        # The normal equations: few, well-scaled columns, and a hundred times faster than a decomposition of all rows.
        linear = np.linalg.lstsq(matrix.T @ matrix, matrix.T @ (measured - known), rcond=None)[0]
        return matrix, np.asarray(linear, dtype=np.float64), known + matrix @ linear

    def cost(log_tau: float) -> float:
        left = measured - solved(float(np.exp(log_tau)))[2]
        return float(left @ left)

    low, high = np.log(bounds)
    grid = np.linspace(low, high, 25)
    best = int(np.argmin([cost(x) for x in grid]))
    if best in (0, grid.size - 1):
        raise BenchError(
            f"shows no first-order response with a time constant between {bounds[0]:g} and {bounds[1]:g} s.",
            where=where,
            hint="Does the column follow its command at all? Are the steps long enough, and not too small?",
        )
    minimum = minimize_scalar(cost, bracket=(grid[best - 1], grid[best], grid[best + 1]), options={"xtol": 1e-7})
    tau = float(np.exp(minimum.x))
    matrix, linear, model = solved(tau)
    step = 1e-4 * tau
    slope = (_at(response, tau + step, linear) - _at(response, tau - step, linear)) / (2.0 * step)
    jacobian = np.column_stack([slope, matrix])
    residuals = measured - model
    spread = float(np.sqrt(residuals @ residuals / (measured.size - jacobian.shape[1])))
    scale = np.linalg.norm(jacobian, axis=0) / spread
    sensitivities = (jacobian / (scale * spread)).T[:, :, None]
    information = np.linalg.inv(sensitivities[:, :, 0] @ sensitivities[:, :, 0].T)
    corrected = accuracy.corrected_covariance(
        information,
        np.zeros_like(information),
        [residuals[:, None] / spread],
        [sensitivities],
        lags=round(_CORRELATED / dt),
    )
    return LagFit(tau, float(np.sqrt(corrected[0, 0])) / float(scale[0]), linear, model, residuals)


def _at(response: Callable[[float], tuple[Array, Sequence[Array]]], tau: float, linear: Array) -> Array:
    known, columns = response(tau)
    return np.asarray(known + np.column_stack(list(columns)) @ linear)


def held_levels(command: Array) -> Array:
    """Indicator columns of the stretches over which a command stands still, shape (n, stretches)."""
    stretch = np.cumsum(np.diff(command, prepend=command[0]) != 0.0)
    return np.asarray(stretch[:, None] == np.arange(stretch[-1] + 1), dtype=np.float64)


def check_order(where: str, fit: LagFit, size: float, *, most: float = 0.02) -> BenchCheck:
    """Whether one lag is enough, by what is left after it: at most this share of the steps."""
    share = float(np.sqrt(np.mean(np.convolve(fit.residuals, np.ones(10) / 10.0, mode="valid") ** 2))) / size
    return BenchCheck(
        f"{where}: the smoothed residual is {100 * share:.1f} % of the steps"
        + ("; a first-order lag does not describe them." if share > most else "."),
        good=share <= most,
    )
