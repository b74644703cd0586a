"""How far a number that is read off a fitted model moves with the Cramér-Rao bounds of the model's parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.flights.flight import Array
from swashplate.identification.response_cost import ParameterAccuracy
from swashplate.identification.spectra import Complex
from swashplate.identification.state_space_result import StateSpaceFit
from swashplate.identification.transfer_function_fit import TransferFunctionFit

_STEP = 0.1
"""Of a bound, to either side: small enough for a straight line, large enough for a crossing between two lines."""

Fitted = StateSpaceFit | TransferFunctionFit


@dataclass(frozen=True)
class Answers:
    """One response of a fitted model.

    Attributes:
        omega: [rad/s]. response: H(j omega), shape (n,).
        gain, phase: what the Cramér-Rao bounds make of log|H| and of the phase [rad], shape (n,).
    """

    omega: Array
    response: Complex
    gain: Array
    phase: Array


def has_pair(fit: Fitted, output: str, input: str) -> bool:
    """Whether the fitted model joins these channels."""
    if isinstance(fit, StateSpaceFit):
        return output in fit.model.outputs and input in fit.model.inputs
    return any((m.output, m.input) == (output, input) for m in fit.models)


def response_of(fit: Fitted, output: str, input: str, omega: Array, changes: Mapping[str, float]) -> Complex:
    """One response of a fitted model with some parameters at other values, shape (n,)."""
    if isinstance(fit, StateSpaceFit):
        model = fit.model.with_values(changes) if changes else fit.model
        return model.response(omega)[:, model.outputs.index(output), model.inputs.index(input)]
    return next(m for m in fit.changed(changes) if (m.output, m.input) == (output, input)).response(omega)


def answers(fit: Fitted, output: str, input: str, omega: Array) -> Answers:
    """A response of a fitted model with the bounds of its gain and phase."""
    h = response_of(fit, output, input, omega, {})

    def read(other: Complex) -> Array:
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = other / h
            return np.concatenate([np.log(np.abs(ratio)), np.angle(ratio)])

    _, sigma = spread(fit, output, input, omega, read)
    return Answers(omega, h, sigma[: omega.size], sigma[omega.size :])


def spread(fit: Fitted, output: str, input: str, omega: Array, read: Callable[[Complex], Array]) -> tuple[Array, Array]:
    """Numbers read off one response of a fitted model, and what the parameters' bounds make of them.

    With a square root L of the bounds' covariance (correlations included) every column moves all parameters together;
    the squares of what each does add up. As the bounds themselves these figures order, they are no standard deviations
    (Tischler and Remple 2012, ch. 12). NaN where a number vanishes on the way.

    Args:
        fit: a transfer-function or state-space fit.
        output, input: the pair. omega: frequencies [rad/s].
        read: from the response (n,) to numbers (m,).

    Returns:
        The numbers and their bounds, shape (m,) each.
    """
    value = np.asarray(read(response_of(fit, output, input, omega, {})), dtype=np.float64)
    free = [p for p in fit.parameters if not p.fixed and not p.tie]
    total = np.zeros(value.shape)

    def moved(column: Array) -> Array:
        changes = {p.name: p.value + float(c) for p, c in zip(free, column, strict=True)}
        return read(response_of(fit, output, input, omega, changes))

    for column in _root(free, fit.correlation).T:
        if column.any():
            total += ((moved(_STEP * column) - moved(-_STEP * column)) / (2.0 * _STEP)) ** 2
    return value, np.sqrt(total) if free else np.full(value.shape, np.nan)


def _root(free: Sequence[ParameterAccuracy], correlation: Array) -> Array:
    """L with L L' = the covariance of the bounds; a parameter that is not seen at all does not move."""
    bounds = np.array([p.cramer_rao for p in free])
    seen = np.isfinite(bounds)
    values, vectors = np.linalg.eigh(np.where(np.outer(seen, seen), correlation, 0.0))
    return np.asarray(np.where(seen, bounds, 0.0)[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))
