"""How far a number that is read off a fitted model moves with the standard deviations of the model's parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.identification.core.result import Estimate, Result
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.transfer_function import TransferFunctions

_STEP = 0.1
"""Of a bound, to either side: small enough for a straight line, large enough for a crossing between two lines."""

Fitted = Result[StateSpaceModel, Any] | Result[TransferFunctions, Any]


@dataclass(frozen=True)
class Answers:
    """One response of a fitted model.

    Attributes:
        omega: [rad/s]. response: H(j omega), shape (n,).
        gain, phase: what the standard deviations of the parameters make of log|H| and of the phase [rad], shape (n,).
    """

    omega: Array
    response: Complex
    gain: Array
    phase: Array


def has_pair(fit: Fitted, output: str, input: str) -> bool:
    """Whether the fitted model joins these channels."""
    return output in fit.solution.outputs and input in fit.solution.inputs


def answers(fit: Fitted, output: str, input: str, omega: Array) -> Answers:
    """A response of a fitted model with the bounds of its gain and phase."""
    h, slopes = _with_slopes(fit, output, input, omega)
    if not slopes.shape[1]:
        return Answers(omega, h, *[np.full(omega.size, np.nan)] * 2)
    moved = slopes @ _root(_free(fit), fit.correlation)
    return Answers(omega, h, np.sqrt((moved.real**2).sum(axis=1)), np.sqrt((moved.imag**2).sum(axis=1)))


def spread(fit: Fitted, output: str, input: str, omega: Array, read: Callable[[Complex], Array]) -> tuple[Array, Array]:
    """Numbers read off one response of a fitted model, and what the parameters' bounds make of them.

    With a square root L of the bounds' covariance (correlations included) every column moves all parameters together,
    and the response by its logarithm's slopes; the squares of what each does add up. NaN where a number vanishes on the
    way.

    Args:
        fit: a transfer-function or state-space fit.
        output, input: the pair. omega: frequencies [rad/s].
        read: from the response (n,) to numbers (m,).

    Returns:
        The numbers and their bounds, shape (m,) each.
    """
    h, slopes = _with_slopes(fit, output, input, omega)
    value = np.asarray(read(h), dtype=np.float64)
    free = _free(fit)
    if not free:
        return value, np.full(value.shape, np.nan)
    total = np.zeros(value.shape)
    for column in (slopes @ _root(free, fit.correlation)).T:
        if column.any():
            total += ((read(h * np.exp(_STEP * column)) - read(h * np.exp(-_STEP * column))) / (2.0 * _STEP)) ** 2
    return value, np.sqrt(total)


def _free(fit: Fitted) -> list[Estimate]:
    return [p for p in fit.estimates if not p.fixed and not p.tie]


def _with_slopes(fit: Fitted, output: str, input: str, omega: Array) -> tuple[Complex, Complex]:
    """H(j omega) (n,) and the derivatives of its logarithm by each free parameter (n, n_free)."""
    return fit.solution.log_slopes(output, input, omega, [p.name for p in _free(fit)])


def _root(free: Sequence[Estimate], correlation: Array) -> Array:
    """L with L L' = the covariance of the bounds; a parameter that is not seen at all does not move."""
    bounds = np.array([p.sigma for p in free])
    seen = np.isfinite(bounds)
    values, vectors = np.linalg.eigh(np.where(np.outer(seen, seen), correlation, 0.0))
    return np.asarray(np.where(seen, bounds, 0.0)[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))
