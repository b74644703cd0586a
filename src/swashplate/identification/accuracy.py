"""How sure an estimate is: Cramér-Rao bounds, plain and corrected for coloured residuals, and blind directions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.fft import next_fast_len, rfft

from swashplate.errors import IdentificationError
from swashplate.flights.flight import Array
from swashplate.identification.fit import Direction
from swashplate.identification.rows import Row

_BLIND = 1.0
"""A direction whose standard deviation exceeds this many scales is named as one that the data hardly see."""

_NO_INFORMATION = 1e-9
"""Data information per squared scale below which a parameter without a prior cannot be estimated at all."""


def refuse_unseen(row: Row, information: Array, *, where: str) -> None:
    """Raise where a free parameter without a prior leaves no trace in the data.

    Raises:
        IdentificationError: naming the parameters.
    """
    unseen = [
        entry.name
        for i, entry in enumerate(row.entries)
        if entry.group == "parameter" and not np.isfinite(entry.sigma) and information[i, i] < _NO_INFORMATION
    ]
    if unseen:
        raise IdentificationError(
            "the flight carries no information about it.",
            where=where,
            channel=", ".join(unseen),
            hint="Fix it, give it a prior, or fly what moves it.",
        )


def covariance(row: Row, information: Array, prior: Array) -> Array:
    """Cramér-Rao bound of the scaled row: the inverse of data and prior information together."""
    total = information + np.diag(prior)
    d = np.sqrt(np.maximum(np.diag(total), 1e-300))
    return np.asarray(np.linalg.pinv(total / np.outer(d, d), hermitian=True) / np.outer(d, d))


def corrected_covariance(
    plain: Array, prior: Array, whitened: Sequence[Array], sensitivities: Sequence[Array], *, lags: int
) -> Array:
    """Bound that allows for coloured residuals (Morelli and Klein 1997; Klein and Morelli 2006, sec. 6.1).

        Sigma = M^-1 [ sum_i sum_j S_i' R^-1 Rvv(i-j) R^-1 S_j ] M^-1

    in whitened form. The sample autocorrelations are tapered linearly (Bartlett), which keeps the result positive; the
    double sum is taken in the frequency domain, where it is one product per frequency.

    Args:
        plain: M^-1, scaled, shape (p, p).
        prior: prior information on the diagonal (p,), which is not coloured.
        whitened: per record, residuals (n, m) divided by their standard deviation.
        sensitivities: per record, their derivatives (p, n, m).
        lags: how many samples of correlation to allow for.
    """
    middle = np.diag(prior).astype(np.float64)
    for residual, sensitivity in zip(whitened, sensitivities, strict=True):
        moving = np.flatnonzero(sensitivity.any(axis=(1, 2)))  # a window's residuals know nothing of other windows
        middle[np.ix_(moving, moving)] += _spread(residual, sensitivity[moving], lags=lags)
    return np.asarray(plain @ middle @ plain)


def _spread(residual: Array, sensitivity: Array, *, lags: int) -> Array:
    """Covariance of sum_t S_t' v_t for residuals v with the tapered autocorrelation of `residual`, shape (p, p)."""
    n, m = residual.shape
    reach = min(lags, n - 1)
    size = next_fast_len(n + reach, real=True)  # long enough for the sums over t and t + lag not to wrap round
    correlation = np.zeros((size, m, m))
    for lag in range(reach + 1):
        tapered = (1.0 - lag / (lags + 1.0)) * (residual[: n - lag].T @ residual[lag:]) / n
        correlation[-lag], correlation[lag] = tapered, tapered.T
    spectrum = rfft(correlation, axis=0)
    moved = rfft(sensitivity, size, axis=1).transpose(1, 2, 0)
    share = np.full(len(spectrum), 2.0 / size)  # of both signs of a frequency (Parseval)
    share[0] = 1.0 / size
    if size % 2 == 0:
        share[-1] = 1.0 / size
    left = (moved.conj() * share[:, None, None]).reshape(-1, moved.shape[2])
    return np.asarray((left.T @ (spectrum @ moved).reshape(-1, moved.shape[2])).real)


def marginal_information(information: Array, prior: Array, places: Array) -> Array:
    """What the data say about some entries when all others are unknown (Schur complement), scaled.

    The others keep their priors, so that a nuisance nobody can see does not make the rest blind.
    """
    others = np.setdiff1d(np.arange(information.shape[0]), places)
    within = information[np.ix_(places, places)]
    if not others.size:
        return np.asarray(within)
    across = information[np.ix_(places, others)]
    rest = information[np.ix_(others, others)] + np.diag(prior[others])
    return np.asarray(within - across @ np.linalg.pinv(rest, hermitian=True) @ across.T)


def blind_directions(names: Sequence[str], information: Array) -> tuple[Direction, ...]:
    """Combinations of parameters that the data hardly see, worst first.

    Args:
        names: the parameters.
        information: of the scaled parameters, nuisances marginalised, priors left out.
    """
    values, vectors = np.linalg.eigh(0.5 * (information + information.T))
    directions = []
    for value, vector in zip(values, vectors.T, strict=True):
        sigma = float(1.0 / np.sqrt(max(value, 1e-18)))
        if sigma < _BLIND:
            continue
        vector = vector * np.sign(vector[np.argmax(np.abs(vector))])
        weights = {name: float(w) for name, w in zip(names, vector, strict=True)}
        directions.append(Direction(weights, sigma, _in_words(weights, sigma)))
    return tuple(directions)


def _in_words(weights: dict[str, float], sigma: float) -> str:
    main = sorted(((abs(w), name) for name, w in weights.items() if abs(w) > 0.3), reverse=True)
    parts = [f"{name} {'up' if weights[name] > 0 else 'down'}" for _, name in main]
    size = "without limit" if sigma > 1e6 else f"by {sigma:.2g} times the usual size"
    if len(parts) == 1:
        return f"{main[0][1]} can move {size} before the data object"
    return f"{' with '.join(parts)} can move {size} before the data object"
