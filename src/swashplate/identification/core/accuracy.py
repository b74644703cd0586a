"""How sure an estimate is: Cramér-Rao bounds, plain and corrected for coloured residuals, and blind directions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.identification.core.parameter_row import Row
from swashplate.identification.core.result import Direction, Estimate

_BLIND = 1.0
"""A direction whose standard deviation exceeds this many scales is named as one that the data hardly see."""

_NO_INFORMATION = 1e-9
"""Data information per squared scale below which a parameter without a prior cannot be estimated at all."""


_LISTED = 6
"""Numbers that a warning names."""


def sign_words(estimates: Sequence[Estimate]) -> list[str]:
    """Which free numbers lie within two standard deviations of zero, in words: neither their sign nor their size is
    known."""
    open_ = [e for e in estimates if e.free and np.isfinite(e.best_sigma) and abs(e.value) < 2.0 * e.best_sigma]
    if not open_:
        return []
    named = ", ".join(f"{e.name} {e.value:.3g} ± {2.0 * e.best_sigma:.2g}" for e in open_[:_LISTED])
    more = f" and {len(open_) - _LISTED} more" if len(open_) > _LISTED else ""
    return [f"the data do not tell the sign of {named}{more} (two standard deviations): do not use these numbers."]


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
    total = information + prior
    d = np.sqrt(np.maximum(np.diag(total), 1e-300))
    return np.asarray(np.linalg.pinv(total / np.outer(d, d), hermitian=True) / np.outer(d, d))


def corrected_covariance(
    bound: Array, rest: Array, whitened: Sequence[Array], sensitivities: Sequence[Array], *, lags: int
) -> Array:
    """Bound that allows for coloured residuals (Morelli and Klein 1997; Klein and Morelli 2006, sec. 6.1).

        Sigma = M^-1 [ sum_i sum_j S_i' R^-1 Rvv(i-j) R^-1 S_j ] M^-1

    in whitened form, with one autocorrelation for all records. Residuals are the errors less what the fit took out of
    them, `v = (1 - S M^-1 S') e`, so their products fall short of the errors'; what a white error loses is added back
    (without it windows with their own initial states look less correlated than they are). The autocorrelation is
    tapered linearly (Bartlett), which keeps the result positive; the double sum is taken in the frequency domain.

    Args:
        plain: M^-1, scaled, shape (p, p).
        rest: information that no residual carries (priors, the covariance's own), shape (p, p); it is not coloured.
        whitened: per record, residuals (n, m) divided by their standard deviation.
        sensitivities: per record, their derivatives (p, n, m).
        lags: how many samples of correlation to allow for.
    """
    affected = [np.flatnonzero(np.any(sensitivity, axis=(1, 2))) for sensitivity in sensitivities]
    pieces = [sensitivity[rows] for sensitivity, rows in zip(sensitivities, affected, strict=True)]
    products = [
        _products(residual, residual, lags) + _products(*_taken(piece, bound[np.ix_(rows, rows)]), lags)
        for residual, piece, rows in zip(whitened, pieces, affected, strict=True)
    ]
    taper = 1.0 - np.arange(lags + 1) / (lags + 1.0)
    correlation = taper[:, None, None] * np.sum(products, axis=0) / sum(len(residual) for residual in whitened)
    middle = np.array(rest, dtype=np.float64)
    for piece, places in zip(pieces, affected, strict=True):  # a window's residuals know nothing of other windows
        middle[np.ix_(places, places)] += _spread(correlation, piece)
    return np.asarray(bound @ middle @ bound)


def covariance_by_octaves(
    bound: Array, rest: Array, whitened: Sequence[Array], sensitivities: Sequence[Array]
) -> Array:
    """Bound that allows for errors which hold together over half an octave, as those of what a model lacks do.

        Sigma = M^-1 [ sum_b g_b g_b' ] M^-1,    g_b = sum_{w in band b} S(w)* R^-1/2 v(w)

    with the pull of every band on the parameters, of all records together (clusters of Liang and Zeger 1986). What
    pulls the same way in every band goes into the parameters, and no residual tells it. Arguments: as in
    `corrected_covariance`.
    """
    pulls: dict[int, Array] = {}
    for residual, piece in zip(whitened, sensitivities, strict=True):
        n = len(residual)
        share = np.full(n // 2 + 1, 2.0 / n)  # of both signs of a frequency (Parseval)
        share[0] = 1.0 / n
        if n % 2 == 0:
            share[-1] = 1.0 / n
        spectrum = rfft(piece, axis=1).conj() * share[None, :, None]
        by_line = np.einsum("pkm,km->kp", spectrum, rfft(residual, axis=0)).real
        band = np.floor(2.0 * np.log2(np.maximum(np.arange(len(share)), 1.0) / n)).astype(int)
        for b in np.unique(band):
            pulls[b] = pulls.get(b, np.zeros(len(bound))) + by_line[band == b].sum(axis=0)
    together = np.array(list(pulls.values()))
    return np.asarray(bound @ (together.T @ together + rest) @ bound)


def covering(covariance: Array, *others: Array) -> Array:
    """A covariance with the same correlations whose variances are the largest of all."""
    variance = np.diag(covariance)
    largest = np.max([variance, *map(np.diag, others)], axis=0)
    stretch = np.sqrt(np.divide(largest, variance, out=np.ones_like(variance), where=variance > 0.0))
    return np.asarray(covariance * np.outer(stretch, stretch))


def information_beyond(covariance: Array, prior: Array) -> Array:
    """The information in a covariance (p, p) that the priors (p, p) had not; nothing where they had more."""
    stretch, turn = np.linalg.eigh(np.linalg.pinv(covariance, hermitian=True) - prior)
    return np.asarray((turn * np.maximum(stretch, 0.0)) @ turn.T)


def _taken(sensitivity: Array, bound: Array) -> tuple[Array, Array]:
    """Two rows of which the products over time are what the fit takes out of a white error, each (n, m, p)."""
    slopes = sensitivity.transpose(1, 2, 0)
    return slopes @ bound, slopes


def _products(left: Array, right: Array, lags: int) -> Array:
    """sum_t left(t) right(t + lag)' for lags 0 to `lags`, over a last axis too where there is one; (lags + 1, m, m)."""
    n = len(left)
    size = next_fast_len(n + lags, real=True)  # long enough for the sums not to wrap round
    a, b = (rfft(x.reshape(n, x.shape[1], -1), size, axis=0) for x in (left, right))
    return np.asarray(irfft(a.conj() @ b.transpose(0, 2, 1), size, axis=0)[: lags + 1])


def _spread(correlation: Array, sensitivity: Array) -> Array:
    """Covariance of sum_t S_t' v_t for errors v with a one-sided autocorrelation (lags + 1, m, m), shape (p, p)."""
    n, lags, m = sensitivity.shape[1], len(correlation) - 1, correlation.shape[1]
    size = next_fast_len(n + lags, real=True)
    both = np.zeros((size, m, m))
    both[: lags + 1] = correlation.transpose(0, 2, 1)
    both[size - lags :] = correlation[:0:-1]
    spectrum = rfft(both, axis=0)
    slopes = rfft(sensitivity, size, axis=1).transpose(1, 2, 0)
    share = np.full(len(spectrum), 2.0 / size)  # of both signs of a frequency (Parseval)
    share[0] = 1.0 / size
    if size % 2 == 0:
        share[-1] = 1.0 / size
    left = (slopes.conj() * share[:, None, None]).reshape(-1, slopes.shape[2])
    return np.asarray((left.T @ (spectrum @ slopes).reshape(-1, slopes.shape[2])).real)


def marginal_information(information: Array, prior: Array, places: Array | NDArray[np.int64]) -> Array:
    """What the data say about some entries when all others are unknown (Schur complement), scaled.

    The others keep their priors, so that a nuisance nobody can see does not make the rest blind.
    """
    others = np.setdiff1d(np.arange(information.shape[0]), places)
    within = information[np.ix_(places, places)]
    if not others.size:
        return np.asarray(within)
    across = information[np.ix_(places, others)]
    rest = information[np.ix_(others, others)] + prior[np.ix_(others, others)]
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
