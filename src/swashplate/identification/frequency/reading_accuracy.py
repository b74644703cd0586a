"""How far a number that is read off a fitted model may be off: its parameters' bounds, and the error of its form.

How far a fitted model's responses are from the aircraft's: its numbers are uncertain, and its form is never right.

With the slopes S of the logarithm by the free numbers, model over aircraft is

    e = S b + d,    of which the fit leaves    r = e - n

at the measured points, whose errors n are known. What S b and n do not explain of r is the form's, d: a normal process
over log frequency, the same for gain and phase, whose size and length the residuals of each response tell by their
likelihood. Then e is what is likely under r (kriging with a trend: Rasmussen and Williams 2006, sec. 2.7). Where the
flight was measured e is known nearly as well as n is; away from there it grows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.identification.core.result import Result
from swashplate.identification.frequency.fit_accuracy import GIVEN, error_covariance, has_errors
from swashplate.identification.frequency.response_cost import ResponseComparison, Target, log_error
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.transfer_function import TransferFunctions

Fitted = Result[StateSpaceModel, Any] | Result[TransferFunctions, Any]

_LENGTHS = np.log(2.0) * np.array([0.25, 0.5, 1.0, 2.0, 4.0])
_SIZES = np.array([0.0, *np.geomspace(0.1, 100.0, 13)])
"""Lengths of the process [log frequency], and variances over the mean square of the residuals, that are tried."""

_FREE = 9.0
"""By which the variances of the fit's numbers are loosened while one response alone tells its process."""

_MOST, _EVEN = 10.0, 1e-12
"""Of a logarithm, by which one of them then moves a response at most; and what keeps the sum of all positive."""

_UNKNOWN = 0.25
"""Of the mean square of the residuals: taken for the responses' errors where these are not known."""

_KNOTS = 90
"""Frequencies at which errors are reckoned; straight lines over log frequency join them."""

_UNSEEN, _LEFT_OUT, _RIDGE = 1e-10, 1e-3, 1e-6
"""Information on a combination of numbers, and share of a variance, below which nothing moves; what is added to one."""


@dataclass(frozen=True)
class Process:
    """The error of a form in one response: its variance, gain and phase alike, and its length [log frequency]."""

    variance: float
    length: float

    def covariance(self, omega: Array, other: Array) -> Array:
        """Of gains, then phases, at two sets of frequencies [rad/s]: shape (2 n, 2 m)."""
        return _twice(self.variance * _shape(omega, other, self.length))


def error_of(fit: Fitted, output: str, input: str, omega: Array) -> tuple[Complex, Complex]:
    """The likely error of the logarithm of one response of a fit, and the spread about it.

    Args:
        fit: with the responses that it was fitted to. output, input: the pair. omega: frequencies [rad/s], shape (n,).

    Returns:
        The error (n,), and columns (n, m) that each move it by one standard deviation, independently.
    """
    fitted = [c for c in fit.comparisons if isinstance(c, ResponseComparison) and not c.target.ceiling]
    targets = [c.target for c in fitted]
    residuals = [_parts(log_error(c.model, c.target.measured)) for c in fitted]
    slopes = [_slopes(fit, t.output, t.input, t.omega) for t in targets]
    noise, rows = _noise(targets, residuals, free=len(fit.names))
    processes = [
        _process(t.omega, r, noise[np.ix_(k, k)] + _loosened(fit, s))
        for t, r, s, k in zip(targets, residuals, slopes, rows, strict=True)
    ]
    joint = noise.copy()
    for process, t, k in zip(processes, targets, rows, strict=True):
        joint[np.ix_(k, k)] += process.covariance(t.omega, t.omega)

    at = omega if omega.size <= _KNOTS else np.geomspace(omega[0], omega[-1], _KNOTS)
    of_pair = [k for k, t in enumerate(targets) if (t.output, t.input) == (output, input)]
    beside = np.zeros((2 * at.size, joint.shape[0]))
    if of_pair:
        mine = processes[of_pair[0]]
        beside[:, rows[of_pair[0]]] = mine.covariance(at, targets[of_pair[0]].omega)
    else:  # nothing was measured there: as the form does elsewhere
        mine = Process(*(float(np.median([getattr(p, part) for p in processes])) for part in ("variance", "length")))
    order = np.concatenate(rows)
    left, trend = np.zeros(order.size), np.zeros((order.size, slopes[0].shape[1]))
    left[order], trend[order] = np.concatenate(residuals), np.concatenate(slopes)
    mean, spread = _likely(joint, beside, mine.covariance(at, at), left, trend, _slopes(fit, output, input, at))
    columns = np.column_stack([mean, _root(spread)])
    columns = columns[: at.size] + 1j * columns[at.size :]
    if at is not omega:
        columns = np.stack([np.interp(np.log(omega), np.log(at), column) for column in columns.T], axis=1)
    return columns[:, 0], columns[:, 1:]


def _likely(joint: Array, beside: Array, prior: Array, left: Array, trend: Array, slopes: Array) -> tuple[Array, Array]:
    """Mean and covariance of the errors under the residuals `left`, with all of the trend's numbers free.

    Args:
        joint, beside, prior: covariances of residuals, of errors with residuals, and of errors.
        trend, slopes: by the fit's numbers, at the residuals and at the errors.
    """
    size = np.maximum(np.linalg.norm(trend, axis=0), 1e-300)
    trend, slopes = trend / size, slopes / size
    solved = np.linalg.solve(joint, np.column_stack([left, trend, beside.T]))
    by_left, by_trend, by_own = solved[:, 0], solved[:, 1 : 1 + size.size], solved[:, 1 + size.size :]
    values, vectors = np.linalg.eigh(trend.T @ by_trend)
    kept = values > _UNSEEN * max(values.max(initial=0.0), 1e-300)
    inverse = (vectors[:, kept] / values[kept]) @ vectors[:, kept].T
    numbers = inverse @ (trend.T @ by_left)
    beyond = slopes - beside @ by_trend
    mean = beside @ by_left + beyond @ numbers
    return mean, prior - beside @ by_own + beyond @ inverse @ beyond.T


def _process(omega: Array, left: Array, explained: Array) -> Process:
    """The likeliest process behind the residuals of one response, beside a covariance that explains them without it."""
    sizes = float(np.mean(left**2)) * _SIZES
    best, process = -np.inf, Process(0.0, float(_LENGTHS[0]))
    for length in _LENGTHS:
        tried = explained + sizes[:, None, None] * _twice(_shape(omega, omega, length))
        root = np.linalg.cholesky(tried)
        white = np.linalg.solve(root, np.broadcast_to(left[:, None], (sizes.size, left.size, 1)))[..., 0]
        likely = -np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1) - 0.5 * (white**2).sum(axis=1)
        k = int(np.argmax(likely))
        if likely[k] > best:
            best, process = float(likely[k]), Process(float(sizes[k]), float(length))
    return process


def _noise(targets: Sequence[Target], residuals: Sequence[Array], *, free: int) -> tuple[Array, list[Array]]:
    """Covariance of the measured logarithms, all gains, then all phases; and each target's places in it.

    Less than the errors say is believed as the bounds of the numbers believe it.
    """
    ends = np.cumsum([0, *(t.omega.size for t in targets)])
    rows = [np.concatenate([np.arange(a, b), ends[-1] + np.arange(a, b)]) for a, b in pairwise(ends)]
    if all(has_errors(t) for t in targets):
        known = error_covariance(targets)
        place, size = np.argsort(np.concatenate(rows)), np.sqrt(np.diag(known))
        left = max(size.size - free, 1)
        missed = float(np.sum((np.concatenate(residuals)[place] / size) ** 2)) / left
        freedom = left**2 / float(np.sum((known / np.outer(size, size)) ** 2))
        scale = min((freedom * missed + GIVEN) / (freedom + GIVEN), 1.0)
        return scale * (known + np.diag(_RIDGE * size**2)), rows
    square = np.zeros(2 * ends[-1])
    for r, k in zip(residuals, rows, strict=True):
        square[k] = max(_UNKNOWN * float(np.mean(r**2)), 1e-12)
    return np.diag(square), rows


def _loosened(fit: Fitted, slopes: Array) -> Array:
    """What the free numbers, loosened, make of one response: a covariance; what leaves no trace does not move."""
    known = np.isfinite(np.diag(fit.covariance))
    covariance = np.where(np.outer(known, known), _FREE * fit.covariance, 0.0)
    reach = np.abs(slopes).max(axis=0) * np.sqrt(np.diag(covariance))
    bounded = slopes * np.minimum(1.0, _MOST / np.maximum(reach, 1e-300))
    loosened = bounded @ covariance @ bounded.T
    return np.asarray(loosened + _EVEN * np.max(np.diag(loosened), initial=0.0) * np.eye(loosened.shape[0]))


def _slopes(fit: Fitted, output: str, input: str, omega: Array) -> Array:
    return _parts(fit.solution.log_slopes(output, input, omega, fit.names)[1])


def _parts(columns: Complex) -> Array:
    """Gains above phases."""
    return np.asarray(np.concatenate([columns.real, columns.imag]), dtype=np.float64)


def _shape(omega: Array, other: Array, length: float) -> Array:
    return np.asarray(np.exp(-0.5 * ((np.log(omega)[:, None] - np.log(other)[None, :]) / length) ** 2))


def _twice(block: Array) -> Array:
    return np.asarray(np.kron(np.eye(2), block), dtype=np.float64)


def _root(covariance: Array) -> Array:
    """L with L L' the covariance, but for what is small beside each variance."""
    size = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance / np.outer(size, size))
    kept = values > _LEFT_OUT * values[-1]
    return np.asarray(size[:, None] * vectors[:, kept] * np.sqrt(values[kept]))


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
    h, error, deviations = _errors(fit, output, input, omega)
    if not deviations.shape[1]:
        return Answers(omega, h, *[np.full(omega.size, np.nan)] * 2)
    deviations = np.column_stack([error, deviations])
    return Answers(omega, h, np.sqrt((deviations.real**2).sum(axis=1)), np.sqrt((deviations.imag**2).sum(axis=1)))


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
    return h, np.zeros_like(h), slopes @ _fit_root(fit)


def _fit_root(fit: Fitted) -> Array:
    """L with L L' = the covariance of the parameters; one that is not seen at all does not move."""
    known = np.isfinite(np.diag(fit.covariance))
    values, vectors = np.linalg.eigh(np.where(np.outer(known, known), fit.covariance, 0.0))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
