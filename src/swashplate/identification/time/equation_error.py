"""Equation error: least squares of one equation of motion, in time or over a band of frequencies, and stepwise.

The usual first look (Klein and Morelli 2006, ch. 5 and sec. 7.3): quick, needs no start values, and biased by noise in
the regressors. Over a band of frequencies drift and noise outside the band do not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import detrend
from scipy.special import fdtri

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.shown import Shown

ENTER, LEAVE = 0.999, 0.99
"""Confidence of the partial F test for a regressor to come in, and below which it goes again."""


@dataclass(frozen=True)
class EquationError(Shown):
    """One equation's coefficients.

    Attributes:
        names: regressors in the model, "bias" last where there is one. values, sigmas: coefficients, standard errors.
        determination: R^2. noise: standard deviation of the residual. history: what came and went, in order.
        covariance: of the values, where it was worked out.
    """

    names: tuple[str, ...]
    values: Array
    sigmas: Array
    determination: float
    noise: float
    history: tuple[str, ...] = ()
    covariance: Array | None = None

    def __getitem__(self, name: str) -> float:
        return float(self.values[self.names.index(name)])

    def __repr__(self) -> str:
        rows = [f"  {n:<14}{v:>13.6g} +- {s:.2g}" for n, v, s in zip(self.names, self.values, self.sigmas, strict=True)]
        return "\n".join([f"Equation error: R^2 = {self.determination:.4f}", *rows])


def equation_error(
    measured: Array,
    regressors: Array,
    names: Sequence[str],
    *,
    dt: float | None = None,
    band: tuple[float, float] | None = None,
    bias: bool = True,
) -> EquationError:
    """Least squares of a measured derivative or force on regressors.

    Args:
        measured: left side, shape (n,).
        regressors: right side, shape (n, n_regressors).
        names: of the regressors.
        dt: sample time [s], needed with a band.
        band: limits [Hz]: the transforms of detrended records are regressed over them, without a bias.
        bias: a constant too (in time).

    Raises:
        IdentificationError: regressors that cannot be told apart, or fewer equations than unknowns.
    """
    if band is not None:
        if dt is None:
            raise IdentificationError("a band needs the sample time.")
        left, right = _over_band(measured, regressors, dt, band)
        return _solved(left, right, tuple(names))
    columns = np.column_stack([regressors, np.ones(len(measured))]) if bias else np.asarray(regressors)
    return _solved(np.asarray(measured), columns, (*names, "bias") if bias else tuple(names))


def _over_band(measured: Array, regressors: Array, dt: float, band: tuple[float, float]) -> tuple[Any, Any]:
    n = len(measured)
    hertz = np.arange(max(1, int(np.ceil(band[0] * n * dt))), int(band[1] * n * dt) + 1) / (n * dt)
    kernel = np.exp(-2j * np.pi * np.outer(hertz, np.arange(n) * dt)) * dt
    return kernel @ detrend(measured), kernel @ detrend(np.asarray(regressors), axis=0)


def _solved(left: Array, right: Array, names: tuple[str, ...], history: tuple[str, ...] = ()) -> EquationError:
    n, k = right.shape
    complex_rows = np.iscomplexobj(left)
    information = (right.conj().T @ right).real
    size = np.sqrt(np.maximum(np.diag(information), 1e-300))
    normal = information / np.outer(size, size)
    if n <= k or np.linalg.cond(normal) > 1e12:
        raise IdentificationError(
            f"{n} equations do not tell {', '.join(names)} apart.",
            hint="Leave out a regressor.",
        )
    values = np.linalg.solve(normal, (right.conj().T @ left).real / size) / size
    residual = left - right @ values
    variance = float(np.vdot(residual, residual).real) / (n - k)
    total = left if complex_rows or "bias" not in names else left - left.mean()
    determination = 1.0 - float(np.vdot(residual, residual).real) / max(float(np.vdot(total, total).real), 1e-300)
    # A complex equation is two real ones.
    sigmas = np.sqrt(np.diag(np.linalg.inv(normal)) * variance / (2.0 if complex_rows else 1.0)) / size
    return EquationError(names, values, sigmas, determination, float(np.sqrt(variance)), history)


def stepwise(measured: Array, candidates: Array, names: Sequence[str]) -> EquationError:
    """Stepwise regression in time: regressors come in by correlation and stay by their partial F (K&M, sec. 5.4).

    Args:
        measured: left side, shape (n,).
        candidates: possible regressors, shape (n, n_candidates).
        names: of the candidates.
    """
    n = len(measured)
    chosen: list[int] = []
    history: list[str] = []
    for _ in range(4 * len(names)):
        rest = [i for i in range(len(names)) if i not in chosen]
        gains = [(_partial_f(measured, candidates, chosen, i), i) for i in rest]
        best = max(gains, default=(0.0, -1))
        limit = float(fdtri(1, n - len(chosen) - 2, ENTER))
        if best[1] < 0 or best[0] < limit or f"+{names[best[1]]}" == (history[-2:] or [""])[0]:
            break
        chosen.append(best[1])
        history.append(f"+{names[best[1]]}")
        for i in list(chosen):
            others = [j for j in chosen if j != i]
            if _partial_f(measured, candidates, others, i) < float(fdtri(1, n - len(others) - 2, LEAVE)):
                chosen.remove(i)
                history.append(f"-{names[i]}")
    columns = np.column_stack([candidates[:, chosen], np.ones(n)])
    return _solved(np.asarray(measured), columns, (*(names[i] for i in chosen), "bias"), tuple(history))


def _partial_f(measured: Array, candidates: Array, chosen: Sequence[int], one: int) -> float:
    """How much a regressor lowers the squared error, in units of the noise."""
    n = len(measured)
    without = np.column_stack([candidates[:, list(chosen)], np.ones(n)])
    with_it = np.column_stack([candidates[:, [one]], without])
    before = float(np.sum((measured - without @ np.linalg.lstsq(without, measured, rcond=None)[0]) ** 2))
    after = float(np.sum((measured - with_it @ np.linalg.lstsq(with_it, measured, rcond=None)[0]) ** 2))
    return float((before - after) / max(after / (n - with_it.shape[1]), 1e-300))
