"""How far a number that is read off a fitted model may be off: its parameters' bounds, and the error of its form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.identification.frequency.form_error import Fitted, error_of

_STEP = 1.0
"""Of a bound, to either side: small enough for a straight line, large enough for a crossing between two lines."""


@dataclass(frozen=True)
class Answers:
    """One response of a fitted model.

    Attributes:
        omega: [rad/s]. response: H(j omega), shape (n,).
        gain, phase: standard deviations of log|H| and of the phase [rad], shape (n,); NaN where none are known.
    """

    omega: Array
    response: Complex
    gain: Array
    phase: Array


def has_pair(fit: Fitted, output: str, input: str) -> bool:
    """Whether the fitted model joins these channels."""
    return output in fit.solution.outputs and input in fit.solution.inputs


def answers(fit: Fitted, output: str, input: str, omega: Array) -> Answers:
    """A response of a fitted model with the standard deviations of its gain and phase."""
    h, error, moved = _errors(fit, output, input, omega)
    if not moved.shape[1]:
        return Answers(omega, h, *[np.full(omega.size, np.nan)] * 2)
    moved = np.column_stack([error, moved])
    return Answers(omega, h, np.sqrt((moved.real**2).sum(axis=1)), np.sqrt((moved.imag**2).sum(axis=1)))


def spread(fit: Fitted, output: str, input: str, omega: Array, read: Callable[[Complex], Array]) -> tuple[Array, Array]:
    """Numbers read off one response of a fitted model, and their standard deviations.

    The error that the residuals tell is taken away as a whole, and what is read then is compared. About there every
    column of the spread moves the response; the squares of what each does to a number add up.

    Args:
        fit: a transfer-function or state-space fit.
        output, input: the pair. omega: frequencies [rad/s].
        read: from the response (n,) to numbers (m,).

    Returns:
        The numbers and their standard deviations, shape (m,) each; NaN where a number vanishes on the way.
    """
    h, error, columns = _errors(fit, output, input, omega)
    value = np.asarray(read(h), dtype=np.float64)
    if not columns.shape[1]:
        return value, np.full(value.shape, np.nan)
    likely = h * np.exp(-error)
    middle = read(likely) if error.any() else value
    total = (value - middle) ** 2
    for column in columns.T:
        if column.any():
            ahead, back = read(likely * np.exp(_STEP * column)), read(likely * np.exp(-_STEP * column))
            total += (_apart(ahead, middle, back) / _STEP) ** 2
    return value, np.sqrt(total)


def _apart(ahead: Array, middle: Array, back: Array) -> Array:
    """Half of what lies between two numbers; where one is missing, what lies between the other one and the middle."""
    ahead, back = (np.where(np.isnan(one), 2.0 * middle - other, one) for one, other in ((ahead, back), (back, ahead)))
    return np.asarray((ahead - back) / 2.0)


def _errors(fit: Fitted, output: str, input: str, omega: Array) -> tuple[Complex, Complex, Complex]:
    """H(j omega) (n,), the likely error of its logarithm (n,) and what moves that by one deviation each (n, m)."""
    h, slopes = fit.solution.log_slopes(output, input, omega, fit.names)
    if slopes.shape[1] and any(not t.ceiling for t in fit.targets):
        return h, *error_of(fit, output, input, omega)
    return h, np.zeros_like(h), slopes @ _root(fit)


def _root(fit: Fitted) -> Array:
    """L with L L' = the covariance of the parameters; one that is not seen at all does not move."""
    seen = np.isfinite(np.diag(fit.covariance))
    values, vectors = np.linalg.eigh(np.where(np.outer(seen, seen), fit.covariance, 0.0))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
