"""Shares and quantiles of a sample with how sure they are."""

from __future__ import annotations

import numpy as np
from scipy.stats import beta, binom

from swashplate.arrays import Array

SURE = 0.95
"""Of the intervals."""


def share_interval(count: int, of: int, *, sure: float = SURE) -> tuple[float, float]:
    """Exact interval of a share (Clopper and Pearson 1934): it holds the truth at least so often."""
    rest = 0.5 * (1.0 - sure)
    low = float(beta.ppf(rest, count, of - count + 1)) if count else 0.0
    high = float(beta.ppf(1.0 - rest, count + 1, of - count)) if count < of else 1.0
    return low, high


def share_words(count: int, of: int) -> str:
    """A share with its interval, for a person."""
    if not of:
        return "none yet"
    low, high = share_interval(count, of)
    return f"{count} of {of} ({100 * count / of:.3g} %; with 95 % confidence {100 * low:.3g} to {100 * high:.3g} %)"


def quantile(values: Array, share: float) -> tuple[float, float, float]:
    """A quantile and its interval by order statistics, without any assumption of how the sample is distributed.

    The number of values below the true quantile is binomial; the interval is between the two order statistics that
    hold it (David and Nagaraja 2003, sec. 7.1). An end that the sample is too small for is infinite.

    Args:
        values: (n,), infinite ones too, NaN none.
        share: 0 to 1.
    """
    ranked = np.sort(values)
    n, rest = len(ranked), 0.5 * (1.0 - SURE)
    if not n:
        return float("nan"), float("-inf"), float("inf")
    low = int(binom.ppf(rest, n, share)) - 1
    high = int(binom.ppf(1.0 - rest, n, share))
    with np.errstate(invalid="ignore"):
        at = float(np.quantile(ranked, share, method="inverted_cdf"))
    return at, float(ranked[low]) if low >= 0 else -np.inf, float(ranked[high]) if high < n else np.inf
