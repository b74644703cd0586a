"""Numbers in which a posterior is nearly a standard normal distribution, and whether chains of draws may be believed.

The numbers of a fit are whitened by the inverse of information and priors at the optimum. A scale with a near bound is
bent so that the bound lies at infinity: exponential for one bound, logistic for two; at the middle its slope is one.
The logarithm of a noise is stretched to the prior's width where the noise is too small to be seen.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.identification.core.parameter_row import Row

_NEAR = 8.0
"""Sigmas from the optimum within which a bound bends the scale; farther ones only end it."""
_INSIDE = 0.5
"""Sigmas that the bent scale's middle keeps from a bound on which the optimum lies."""

_ASIDE = 0.3
"""Standard deviations to either side at which gradients say how the density bends."""
_FLATTEST = 0.04
"""Of the information: less bending than this is taken for as much, so that no direction is made wider than five."""

_UNSEEN, _BLEND, _SHARE = 1.0, 0.3, 0.8
"""How far below the optimum the logarithm of a noise is that the data no longer see (its variance is a seventh there),
and how wide the change to the prior's width is; in sigmas at most `_SHARE`, so that the optimum keeps its width."""


@dataclass(frozen=True)
class Chains:
    """What a sampler found: scaled rows (chains, draws, p), statistics (chains, draws) each, steps (chains,)."""

    rows: Array
    stats: Mapping[str, Array]
    step: Array


def whitening(row: Row, optimum: Array, covariance: Array) -> dict[str, NDArray[Any]]:
    """The arrays that `unbent` takes.

    Args:
        row: entries, with bounds and priors. optimum: scaled row (p,).
        covariance: inverse of information and priors there (p, p).
    """
    sigma = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    low, high = row.bounds()
    middle = np.minimum(np.maximum(optimum, low + _INSIDE * sigma), high - _INSIDE * sigma)
    tight = ~(low < middle) | ~(middle < high)
    middle = np.where(tight, 0.5 * (np.where(tight, low, 0.0) + np.where(tight, high, 0.0)), middle)
    below, above = middle - low < _NEAR * sigma, high - middle < _NEAR * sigma
    values, vectors = np.linalg.eigh(covariance / np.outer(sigma, sigma))
    logarithmic, wide = row.column("logarithmic") > 0.0, row.column("sigma") / row.scale
    return {
        "middle": middle,
        "low": low,
        "high": high,
        "gap_low": np.where(below, middle - low, 1.0),
        "gap_high": np.where(above, high - middle, 1.0),
        "below": below,
        "above": above,
        "wider": np.where(logarithmic & np.isfinite(wide), np.maximum(wide / sigma, 1.0), 1.0) - 1.0,
        "unseen": _UNSEEN / row.scale,
        "blend": np.minimum(_BLEND / row.scale, _SHARE * sigma),
        "root": sigma[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)),
    }


def evened(data: Mapping[str, Any], slopes: Callable[[Array], Sequence[Array]]) -> dict[str, Any]:
    """The same for numbers in which the density bends alike in every direction, by differences of its gradients.

    Args:
        data: from `whitening`. slopes: gradients of the density's logarithm at whitened places (n, p).
    """
    numbers = data["middle"].size
    sides = _ASIDE * np.stack([np.eye(numbers), -np.eye(numbers)], axis=1).reshape(-1, numbers)
    high, low = np.array(slopes(sides)).reshape(numbers, 2, numbers).transpose(1, 0, 2)
    bends = (low - high) / (2.0 * _ASIDE)
    lost = np.all(low == 0.0, axis=1) | np.all(
        high == 0.0, axis=1
    )  # the model diverges there: as the information has it
    bends[lost] = bends[:, lost] = 0.0
    values, vectors = np.linalg.eigh(0.5 * (bends + bends.T) + np.diag(lost.astype(float)))
    return {**data, "root": data["root"] @ (vectors / np.sqrt(np.maximum(values, _FLATTEST)))}


class Unbent(NamedTuple):
    """A scaled row, and the bent scales there.

    Attributes:
        row: (p,). stretch: logarithm of what all scales stretch.
        slope: of each number by its straight one, (p,). bend: of the logarithm of that, (p,).
    """

    row: Array
    stretch: float
    slope: Array
    bend: Array


def unbent(data: Mapping[str, Any], z: Array) -> Unbent:
    """The scaled row of whitened numbers (p,); `data` is that of `whitening`."""
    away = data["root"] @ z
    small = (-away - data["unseen"]) / data["blend"]
    unseen = np.exp(-np.logaddexp(0.0, -small))
    widened = 1.0 + data["wider"] * unseen
    away = away - data["wider"] * data["blend"] * np.logaddexp(0.0, small)
    a, b, below, above = data["gap_low"], data["gap_high"], data["below"], data["above"]
    both, steep, share = below & above, (a + b) / (a * b), a / (a + b)
    place = np.log(a / b) + steep * away
    low, high = -np.logaddexp(0.0, -place), -np.logaddexp(0.0, place)  # of the logistic function and its rest

    def bent(by_both: Array, by_below: Array, by_above: Array, straight: Any) -> Array:
        return np.where(both, by_both, np.where(below, by_below, np.where(above, by_above, straight)))

    up, down = data["low"] + a * np.exp(away / a), data["high"] - b * np.exp(-away / b)
    row = bent(data["low"] + (a + b) * np.exp(low), up, down, data["middle"] + away)
    logs = bent(low + high - np.log(share * (1.0 - share)), away / a, -away / b, 0.0) + np.log(widened)
    bend = bent(steep * (np.exp(high) - np.exp(low)), 1.0 / a, -1.0 / b, 0.0) * widened
    bend = bend - data["wider"] * unseen * (1.0 - unseen) / (data["blend"] * widened)
    return Unbent(row, float(logs.sum()), np.exp(logs), bend)


def split_rhat(draws: Array) -> Array:
    """Split-R-hat of every number, (p,): chains cut in halves, against one another (Gelman et al. 2013, sec. 11.4).

    Args:
        draws: shape (chains, draws, p).
    """
    half = draws.shape[1] // 2
    split = np.concatenate([draws[:, :half], draws[:, -half:]])
    within = split.var(axis=1, ddof=1).mean(axis=0)
    between = half * split.mean(axis=1).var(axis=0, ddof=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.sqrt((half - 1.0) / half + between / (half * within)))


def effective(draws: Array) -> Array:
    """Effective number of draws of every number, (p,): Geyer's (1992) initial monotone sequence over all chains.

    Args:
        draws: shape (chains, draws, p).
    """
    m, n, p = draws.shape
    centred = draws - draws.mean(axis=1, keepdims=True)
    spectrum = np.fft.rfft(centred, 2 * n, axis=1)
    lagged = np.fft.irfft(np.abs(spectrum) ** 2, axis=1)[:, :n].mean(axis=0) / n
    within = lagged[0] * n / (n - 1.0)
    total = within * (n - 1.0) / n + (draws.mean(axis=1).var(axis=0, ddof=1) if m > 1 else 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        rho = 1.0 - (within - lagged * n / (n - 1.0)) / total
    sizes = np.full(p, np.nan)
    for i in np.flatnonzero(total > 0.0):
        pairs = rho[: 2 * (n // 2), i].reshape(-1, 2).sum(axis=1)
        positive = int(np.argmax(pairs < 0.0)) if np.any(pairs < 0.0) else pairs.size
        tau = -1.0 + 2.0 * np.minimum.accumulate(pairs[:positive]).sum() if positive else 1.0
        sizes[i] = m * n / max(tau, 1.0 / np.log10(m * n))  # Stan's limit for draws that repel each other
    return sizes
