"""How sure the parameters of a fit to responses are: the responses' own errors, carried through the fit.

J is no likelihood: its weights know the coherence and not how large the errors are, so its Hessian alone is no bound.
With the slopes S of the weighted errors and their covariance C a fit scatters by

    Sigma = (S'S)^-1 S'C S (S'S)^-1

(White 1980, eq. 1). C is known before the fit: the random error of every point, and how the errors of two points go
together (`shared_errors`). What the fit leaves tests it: a response that is missed by more than its errors allow counts
with its misfit instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.identification.core.accuracy import blind_directions
from swashplate.identification.core.result import Direction, correlation_of
from swashplate.identification.frequency.response_cost import DB, DEG, ResponseCost, Target
from swashplate.identification.responses.shared_errors import correlation_of_errors

_UNSEEN = 1e-10
"""Information on a combination of parameters, of one on each alone, below which it is not seen."""

GIVEN = 10.0
"""Degrees of freedom that the responses' own errors count for, where the fit leaves less than they say."""

_CHANCE = 3.0
"""Standard deviations by which a response's mean square may exceed that of the others without counting by itself."""

NO_ERRORS = (
    "the responses carry no random errors: the bounds know how far the model misses them, and nothing of the flight."
)
NOT_SHARED = (
    "the responses do not say how their errors go together (an older file, or another program's): the bounds take them "
    "as independent, and are too narrow where gusts move several outputs at once. Make the responses again."
)


@dataclass(frozen=True)
class FitAccuracy:
    """What a fit knows of its parameters.

    Attributes:
        covariance: in the parameters' units (p, p); infinite variance of what leaves no trace.
        insensitivity: standard deviation of each, were all others known (p,).
        misfit: mean square of what the fit leaves of each response, over what its errors let it leave.
        directions: combinations that are hardly seen, worst first.
        warnings: what the bounds lack, in words.
    """

    covariance: Array
    insensitivity: Array
    misfit: Array
    directions: tuple[Direction, ...]
    warnings: tuple[str, ...]

    @property
    def sigma(self) -> Array:
        """Standard deviations (p,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> Array:
        """Of the estimates (p, p); none with a parameter that leaves no trace."""
        return np.nan_to_num(correlation_of(self.covariance))


def accuracy_of_fit(cost: ResponseCost, row: Array) -> FitAccuracy:
    """The bounds of a fit that ended at `row`. Ceilings count for nothing: they say what a number is not.

    Args:
        cost: targets and model. row: scaled parameters (p,).
    """
    targets = [t for t in cost.targets if not t.ceiling]
    residual, slopes = (part[_rows(cost.targets)] for part in cost.residuals(row))
    known = any(has_errors(t) for t in targets)
    weight = np.concatenate([DB * t.weights[0] for t in targets] + [DEG * t.weights[1] for t in targets])
    covariance = error_covariance(targets, known=known) * np.outer(weight, weight)
    spread = np.sqrt(np.diag(covariance))
    size = np.sqrt(np.sum(slopes**2, axis=0))
    sized = np.isfinite(size) & (size > 0.0)
    normal = slopes[:, sized] / size[sized]
    values, vectors = np.linalg.eigh(normal.T @ normal)
    well = values > _UNSEEN
    inverse = (vectors[:, well] / values[well]) @ vectors[:, well].T

    # What such errors leave after a fit to them: the diagonal of P C P with P = 1 - S (S'S)^-1 S'.
    weighted, taken = covariance @ normal, normal @ inverse
    left = np.diag(covariance) - 2.0 * np.sum(weighted * taken, axis=1)
    left = np.maximum(left + np.sum((taken @ (normal.T @ weighted)) * taken, axis=1), 0.0)
    of = np.tile(np.repeat(np.arange(len(targets)), [t.omega.size for t in targets]), 2)
    missed, expected = (np.bincount(of, part / spread**2) for part in (residual**2, left))
    unit = covariance / np.outer(spread, spread)
    freedom = np.array([expected[k] ** 2 / np.sum(unit[np.ix_(of == k, of == k)] ** 2) for k in range(len(targets))])
    misfit = missed / np.maximum(expected, np.finfo(float).tiny)
    factor = np.sqrt(_counted(misfit, freedom, given=GIVEN if known else 0.0))[of]

    score = normal.T @ (covariance * np.outer(factor, factor)) @ normal
    bound = inverse @ score @ inverse + (vectors[:, ~well] / _UNSEEN) @ vectors[:, ~well].T
    units = cost.row.scale[sized] / size[sized]
    joint, alone = np.zeros((sized.size, sized.size)), np.full(sized.size, np.inf)
    np.fill_diagonal(joint, np.inf)
    joint[np.ix_(sized, sized)] = bound * np.outer(units, units)
    alone[sized] = np.sqrt(np.diag(score)) * np.abs(units)
    names = [entry.name for entry in cost.row.entries]
    directions = ()
    if sized.all():
        directions = blind_directions(names, np.linalg.pinv(bound / np.outer(size, size), hermitian=True))
    shared = all(t.shared is not None for t in targets)
    warnings = () if known and shared else (NOT_SHARED,) if known else (NO_ERRORS,)
    return FitAccuracy(joint, alone, misfit, directions, warnings)


def _rows(targets: Sequence[Target]) -> NDArray[np.int64]:
    """Places of the residuals: the gains of all targets, then the phases, without ceilings."""
    gains, phases, at = [], [], 0
    for t in targets:
        n = t.omega.size
        if not t.ceiling:
            gains.append(np.arange(at, at + n))
            phases.append(np.arange(at + n, at + 2 * n))
        at += n if t.ceiling else 2 * n
    return np.concatenate([*gains, *phases])


def has_errors(target: Target) -> bool:
    """Whether a target's random errors are known."""
    return target.error is not None and bool(np.all(np.isfinite(target.error)) and np.all(target.error > 0.0))


def error_covariance(targets: Sequence[Target], *, known: bool = True) -> Array:
    """Covariance (2 n, 2 n) of the logarithms' gains and phases, in the order of `_rows`.

    Where no errors are known, all relative errors are taken as one.
    """
    relative = [t.error if known and t.error is not None else np.ones(t.omega.size) for t in targets]
    # The errors of H itself have no preferred phase; relative ones turn with H.
    turned = np.concatenate([e * np.exp(-1j * np.angle(t.measured)) for e, t in zip(relative, targets, strict=True)])
    complete = np.outer(turned, turned.conj()) * correlation_of_errors(
        [t.omega for t in targets], [t.shared for t in targets]
    )
    return np.block([[complete.real, -complete.imag], [complete.imag, complete.real]])


def _counted(misfit: Array, freedom: Array, *, given: float) -> Array:
    """By how much the variance of each response's errors counts.

    The mean square of those that agree, for all; a response beyond what chance allows counts by itself. Less than the
    errors say is believed as far as there are degrees of freedom to see it.
    """
    body = misfit <= np.median(misfit) * (1.0 + _CHANCE * np.sqrt(2.0 / np.maximum(freedom, 1.0)))
    many = float(np.sum(freedom[body]))
    usual = float(np.sum((misfit * freedom)[body])) / max(many, 1e-300)
    if usual < 1.0:
        usual = (many * usual + given) / (many + given)
    return np.where(body, usual, np.maximum(misfit, usual))
