"""One-step prediction errors: are they as large as promised, and white?"""

from __future__ import annotations

import numpy as np

from swashplate.arrays import Array
from swashplate.validation.validation import InnovationCheck

_LAGS = 20


def log_likelihood(innovations: Array, covariance: Array) -> float:
    """Mean Gaussian log-likelihood per sample of innovations (n, m) with a constant covariance (m, m)."""
    L = np.linalg.cholesky(covariance)
    white = np.linalg.solve(L, innovations.T)
    m = covariance.shape[0]
    return float(-0.5 * np.mean(np.sum(white**2, axis=0)) - np.log(np.diag(L)).sum() - 0.5 * m * np.log(2.0 * np.pi))


def check(innovations: Array, covariance: Array, names: tuple[str, ...]) -> tuple[InnovationCheck, ...]:
    """Size, consistency and whiteness per output (Bar-Shalom, Li and Kirubarajan 2001, sec. 5.4)."""
    n = innovations.shape[0]
    checks = []
    for i, name in enumerate(names):
        row = innovations[:, i] - innovations[:, i].mean()
        power = float(row @ row) or 1e-300
        correlations = [float(row[:-lag] @ row[lag:]) / power for lag in range(1, min(_LAGS, n - 1) + 1)]
        expected = float(np.sqrt(covariance[i, i]))
        size = float(np.sqrt(np.mean(innovations[:, i] ** 2)))
        checks.append(
            InnovationCheck(
                channel=name,
                rms=size,
                expected=expected,
                consistency=(size / expected) ** 2,
                whiteness=max(map(abs, correlations), default=0.0),
                whiteness_bound=2.576 / np.sqrt(n),
            )
        )
    return tuple(checks)
