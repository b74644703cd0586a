"""Linear regression on filtered, and therefore coloured, records: bounds that know it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError


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


def regress(pieces: Sequence[tuple[Array, Array]], *, lag: int) -> tuple[Array, Array]:
    """Ordinary least squares over unbroken pieces: estimates (k,) and their covariance (k, k) for coloured residuals.

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
    return values, coloured_covariance([(a, b - a @ values) for a, b in pieces], lag=lag)
