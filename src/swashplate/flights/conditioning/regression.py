"""Linear regression on filtered, and therefore coloured, records: bounds that know it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError


@dataclass(frozen=True)
class Regression:
    """Least squares with its bounds.

    Attributes:
        values: estimates, shape (k,).
        covariance: corrected for coloured residuals, shape (k, k).
        determination: R^2, the part of the response's variance that is explained.
        partial: partial R^2 of each regressor, given all the others, shape (k,).
    """

    values: Array
    covariance: Array
    determination: float
    partial: Array

    @property
    def sigma(self) -> Array:
        """Standard errors, shape (k,)."""
        return np.sqrt(np.diag(self.covariance))


def coloured_covariance(pieces: Sequence[tuple[Array, Array]], *, lag: int) -> Array:
    """Covariance of a least-squares estimate whose residuals are correlated in time, shape (k, k).

    Klein and Morelli (2006, sec. 6.1; Morelli and Klein 1997) with the weights of Newey and West (1987), which keep the
    sum positive definite: M^-1 (sum_ij s_i R(i-j) s_j^T) M^-1.

    Args:
        pieces: per unbroken piece the sensitivities (n, k) and the residuals (n,).
        lag: furthest correlation that is counted [samples].
    """
    inverse = np.linalg.inv(np.asarray(sum(s.T @ s for s, _ in pieces)))
    middle = np.zeros_like(inverse)
    for sensitivity, residual in pieces:
        score = sensitivity * residual[:, None]
        middle += score.T @ score
        for k in range(1, min(lag, score.shape[0] - 1) + 1):
            cross = score[k:].T @ score[:-k]
            middle += (1.0 - k / (lag + 1.0)) * (cross + cross.T)
    return np.asarray(inverse @ middle @ inverse)


def regress(pieces: Sequence[tuple[Array, Array]], *, lag: int) -> Regression:
    """Ordinary least squares over unbroken pieces, with coloured-residual bounds.

    Args:
        pieces: per piece the regressors (n, k) and the response (n,), zero-mean or with a constant among them.
        lag: furthest residual correlation that is counted [samples].

    Raises:
        FlightError: fewer samples than regressors, or regressors that are multiples of each other.
    """
    x = np.concatenate([regressors for regressors, _ in pieces])
    y = np.concatenate([response for _, response in pieces])
    scale = np.sqrt(np.mean(x**2, axis=0))
    if x.shape[0] <= x.shape[1] or np.any(scale <= 0) or np.linalg.cond(x / np.where(scale > 0, scale, 1.0)) > 1e8:
        raise FlightError(
            f"{x.shape[0]} samples cannot tell {x.shape[1]} regressors apart: one is constant or a multiple.",
            hint="Use a record in which every axis is excited.",
        )
    inverse = np.linalg.inv(x.T @ x)
    values = inverse @ x.T @ y
    residual = y - x @ values
    covariance = coloured_covariance([(a, b - a @ values) for a, b in pieces], lag=lag)
    gain = values**2 / np.diag(inverse)  # what the residual's square sum would rise by without this regressor
    rest = float(residual @ residual)
    return Regression(values, covariance, 1.0 - rest / float(y @ y), gain / (gain + rest))
