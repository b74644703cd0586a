"""Least squares over a chain of states with parameters beside it: banded Cholesky factors and a Schur complement.

Residuals are defects w(k) of two neighbours in the chain and errors v(k) of one state, divided by their standard
deviations; parameters may stand in all of them. The states' part of Gauss-Newton's matrix has a band of two states'
width, whose factor takes time and memory in proportion to the chain's length (Nocedal and Wright 2006, sec. 10.2 and
16.2; `pbtrf` of LAPACK by SciPy).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from swashplate.arrays import Array


class Chain(NamedTuple):
    """Residuals of n states of size s and their slopes.

    w, v: defects (n - 1, s) and errors (n, o).
    before, after: slopes of the defects by the state before and after (n - 1, s, s). here: of the errors (n, o, s).
    """

    w: Array
    v: Array
    before: Array
    after: Array
    here: Array

    @property
    def shape(self) -> tuple[int, int]:
        """Of the states, (n, s)."""
        return self.v.shape[0], self.here.shape[2]

    @property
    def cost(self) -> float:
        """Half the sum of squares."""
        return 0.5 * float(np.sum(self.w**2) + np.sum(self.v**2))

    def divided(self, gust: Array, noise: Array) -> Chain:
        """The same in standard deviations of defects (s,) and errors (o,)."""
        return Chain(
            self.w / gust, self.v / noise, self.before / gust[:, None], self.after / gust[:, None],
            self.here / noise[:, None],
        )  # fmt: skip

    def pulled(self, w: Array, v: Array) -> Array:
        """The slopes' transpose times columns (n - 1, s, ...) and (n, o, ...), as (n s, ...)."""
        pull = np.einsum("koi,ko...->ki...", self.here, v)
        pull[:-1] += np.einsum("kli,kl...->ki...", self.before, w)
        pull[1:] += np.einsum("kli,kl...->ki...", self.after, w)
        return np.asarray(pull.reshape(-1, *pull.shape[2:]))

    def band(self) -> Array:
        """Gauss-Newton's matrix of the states as its lower band (2 s, n s)."""
        n, s = self.shape
        own = np.einsum("koi,koj->kij", self.here, self.here)
        own[:-1] += np.einsum("kli,klj->kij", self.before, self.before)
        own[1:] += np.einsum("kli,klj->kij", self.after, self.after)
        below = np.einsum("kli,klj->kij", self.after, self.before)
        band = np.zeros((2 * s, n * s))
        for i in range(s):
            for j in range(s):
                if i >= j:
                    band[i - j, j::s] = own[:, i, j]
                band[s + i - j, j : (n - 1) * s : s] = below[:, i, j]
        return band


class Border(NamedTuple):
    """A chain with its residuals' slopes by parameters, w (n - 1, s, p) and v (n, o, p)."""

    chain: Chain
    w: Array
    v: Array


_SINGULAR = 1e-13
"""Singular bands left up to 4e-17 here, regular ones 0.25 and more; rounding grows with a band's length."""


def factor(band: Array, damping: float = 0.0) -> Array | None:
    """Cholesky factor of a band, its diagonal enlarged by a share; None where it is not positive definite.

    Rounding may leave a singular band with tiny pivots instead of an error: a squared pivot below `_SINGULAR` of its
    diagonal is no information either (asked without damping, which makes every band regular).
    """
    raised = band if damping == 0.0 else np.concatenate([band[:1] * (1.0 + damping), band[1:]])
    try:
        factored = np.asarray(cholesky_banded(raised, lower=True, check_finite=False))
    except LinAlgError:
        return None
    if damping == 0.0 and np.any(factored[0] ** 2 < _SINGULAR * band[0]):
        return None
    return factored


def solved(factored: Array, right: Array) -> Array:
    """The factored matrix's inverse times columns."""
    return np.asarray(cho_solve_banded((factored, True), right, check_finite=False))


def half_log_determinant(factored: Array) -> float:
    """Half the logarithm of the factored matrix's determinant."""
    return float(np.log(factored[0]).sum())


class Eliminated(NamedTuple):
    """Chains with their states eliminated.

    information (p, p): the Schur complement. pull (p,): gradient of the parameters when the states follow.
    diagonal (p,): information of each parameter were all else known. factors, pulls, across: of every chain.
    """

    information: Array
    pull: Array
    diagonal: Array
    factors: tuple[Array, ...]
    pulls: tuple[Array, ...]
    across: tuple[Array, ...]

    def states(self, step: Array) -> tuple[Array, ...]:
        """How the states follow a step of the parameters, (n s,) each."""
        return tuple(-solved(f, g + k @ step) for f, g, k in zip(self.factors, self.pulls, self.across, strict=True))


def eliminated(borders: Sequence[Border], damping: float = 0.0) -> Eliminated | None:
    """The states of chains eliminated from Gauss-Newton's equations; None where some state shows nowhere."""
    p = borders[0].w.shape[2]
    information, pull, diagonal = np.zeros((p, p)), np.zeros(p), np.zeros(p)
    factors, pulls, across = [], [], []
    for chain, w, v in borders:
        factored = factor(chain.band(), damping)
        if factored is None:
            return None
        flat = np.concatenate([w.reshape(-1, p), v.reshape(-1, p)])
        gradient, coupled = chain.pulled(chain.w, chain.v), chain.pulled(w, v)
        own = flat.T @ flat
        information += own - coupled.T @ solved(factored, coupled)
        pull += flat.T @ np.concatenate([chain.w.ravel(), chain.v.ravel()]) - coupled.T @ solved(factored, gradient)
        diagonal += np.diag(own)
        factors.append(factored)
        pulls.append(gradient)
        across.append(coupled)
    return Eliminated(0.5 * (information + information.T), pull, diagonal, tuple(factors), tuple(pulls), tuple(across))
