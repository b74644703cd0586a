"""`posterior`: what a fit does not know, as draws: normal ones, or those of the likelihood itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.identification.core import accuracy, nuts
from swashplate.identification.core.parameter_row import Row
from swashplate.identification.core.parameters import bounds_of
from swashplate.identification.core.posterior_draws import LEAST_ESS, SPLIT_RHAT, Posterior, normal_within
from swashplate.identification.core.result import Fitted, Result
from swashplate.identification.core.whitened import Chains, effective, split_rhat

METHODS = ("laplace", "nuts")
WARMUP = 25
"""Draws of each chain of NUTS in which it looks for its step."""
BLOCK = 50
"""Draws of each chain between two looks at whether they are enough."""
_LEAST = 100


def posterior(
    result: Result[object, object],
    *,
    method: Literal["laplace", "nuts"] | str = "laplace",
    draws: int = 1000,
    chains: int = 4,
    warmup: int | None = None,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> Result[object, object]:
    """A fit with draws of what it does not know, which `draw`, Monte Carlo and the control check then take.

    "laplace" is free: normal about the estimates from the covariance of the likelihood. "nuts" draws from the
    likelihood and the priors themselves, with every start state, delay, bias and noise that the fit moved, from the fit
    and in the metric of the Fisher information, along exact gradients (No-U-Turn sampler, Hoffman and Gelman 2014). It
    sees skewed and bounded parameters as they are, and ends when every number has a split-R-hat below 1.01 and every
    parameter 400 effective draws. Residuals count as the likelihood has them (white): where the fit corrects its bounds
    for coloured ones, `draw` widens the draws by the same matrices.

    Args:
        result: of a fit in this program, or any with a covariance ("laplace").
        method: "laplace" or "nuts".
        draws: of each chain at most.
        chains: how many.
        warmup: draws of each chain in which it looks for its step; None: `WARMUP`.
        seed: of all that is random.
        progress: told draws of a chain so far, and at most.

    Raises:
        IdentificationError: for a fit that failed, a result from a file or of a method without a likelihood in time
            (NUTS), and draws that did not converge, with their diagnostics.
    """
    where = f"the fit of {result.name}"
    check_posterior(method)
    warming = WARMUP if warmup is None else warmup
    for name, value, least in (("draws", draws, _LEAST), ("chains", chains, 2), ("warmup", warming, 0)):
        if value < least:
            raise IdentificationError(f"is {value}, expected at least {least}.", channel=name)
    if result.failed:
        raise IdentificationError("has failed: it has no posterior.", where=where, hint="Fit it again.")
    if method == "laplace":
        return replace(result, posterior=_laplace(result, draws=draws, chains=chains, seed=seed, where=where))
    fitted = result.fitted
    if fitted is None:
        raise IdentificationError(
            "has no likelihood beside it, and NUTS needs that of records in time itself.",
            where=where,
            channel="posterior",
            hint="Fit the flights again with --posterior nuts (without a horizon), or take 'laplace'.",
        )
    if getattr(fitted.likelihood, "constant", fitted.likelihood) is not fitted.likelihood:
        raise IdentificationError(
            "the fit has a wind, whose likelihood (a gain that follows) NUTS does not draw from.",
            channel="posterior",
            hint="Take 'laplace', or fit the flight without --wind.",
        )
    if not result.converged:
        raise IdentificationError(
            "did not converge: chains would start from nowhere.", where=where, hint="Allow more iterations."
        )
    drawn = _drawn(result, fitted, draws=draws, chains=chains, warmup=warming, seed=seed, progress=progress)
    drawn.check(where=where)
    return replace(result, posterior=drawn)


def check_posterior(method: str) -> None:
    """That there is such a posterior.

    Raises:
        IdentificationError: where not.
    """
    if method not in METHODS:
        raise IdentificationError(f"'{method}' is no posterior; there are {', '.join(METHODS)}.", channel="posterior")


def _laplace(result: Result[object, object], *, draws: int, chains: int, seed: int, where: str) -> Posterior:
    covariance = result.covariance
    vague = [n for n, v in zip(result.names, np.diag(covariance), strict=True) if not 0.0 < v < np.inf]
    if vague or not result.names or not np.all(np.isfinite(covariance)):
        problem = "has no standard deviation." if vague else "knows no spread: nothing was free."
        raise IdentificationError(problem, where=where, channel=", ".join(vague) or None)
    low, high = bounds_of(result.solution, result.names)
    mean = np.array([result[name].value for name in result.names])
    rows = normal_within(mean, covariance, low, high, count=draws * chains, seed=seed, where=where)
    return Posterior(
        "laplace",
        result.names,
        len(result.names),
        tuple(result[name].unit for name in result.names),
        rows.reshape(chains, draws, -1),
        seed=seed,
    )


def _drawn(
    result: Result[object, object],
    fitted: Fitted,
    *,
    draws: int,
    chains: int,
    warmup: int,
    seed: int,
    progress: Callable[[int, int], None] | None,
) -> Posterior:
    likelihood, row = fitted.likelihood, fitted.likelihood.row
    likelihood.refresh(fitted.row)
    information = likelihood.scores(fitted.row)[2]
    covariance = accuracy.covariance(row, information, row.prior(fitted.row)[2])
    k = len(result.names)

    def enough(so_far: Chains) -> bool:
        if so_far.rows.shape[1] < min(draws, _LEAST):
            return False
        good = np.all(effective(so_far.rows[:, :, :k]) >= LEAST_ESS)
        return bool(good and np.all(split_rhat(so_far.rows) < SPLIT_RHAT))

    sampled = nuts.sample(
        likelihood.slope,
        row,
        fitted.row,
        covariance,
        chains=chains,
        warmup=warmup,
        block=BLOCK,
        most=draws,
        enough=enough,
        seed=seed,
        progress=progress,
    )
    return Posterior(
        "nuts",
        row.names,
        k,
        tuple(result[name].unit for name in result.names),
        _plain_numbers(row, sampled.rows),
        split_rhat(sampled.rows),
        effective(sampled.rows),
        sampled.stats,
        sampled.step,
        seed,
    )


def _plain_numbers(row: Row, scaled: Array) -> Array:
    """Scaled rows (..., p) in units, logarithms undone."""
    numbers = scaled * row.scale
    logarithmic = row.column("logarithmic") > 0.0
    return np.where(logarithmic, np.exp(np.where(logarithmic, numbers, 0.0)), numbers)
