"""The matrix operations of the observer as CasADi expressions: columns (n, 1) and matrices.

`@`, `.T`, `*`, `+` and slices are CasADi's own; the rest is here, and the covariance's algebra.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from swashplate.engine.graph import Expression, Graph
from swashplate.engine.roots import require_casadi
from swashplate.physics.backend import Backend, CasadiBackend, Scalar
from swashplate.simulation.discretisation import held_series, rk4_change

Scalars = Callable[[Sequence[Scalar], Sequence[Scalar]], Sequence[Scalar]]
"""A function of two rows of scalars; scalars back."""


class Matrices:
    """Operations of one graph: functions are traced once for each place in the program that calls them."""

    def __init__(self) -> None:
        self._casadi = require_casadi()
        self.xp: Backend = CasadiBackend()
        self._made: dict[tuple[object, ...], Graph] = {}

    def column(self, scalars: Sequence[Scalar], /) -> Expression:
        return self._casadi.vertcat(*scalars)

    def scalars(self, column: Expression, /) -> list[Scalar]:
        return [column[i] for i in range(column.shape[0])]

    def stacked(self, parts: Sequence[Scalar], /) -> Expression:
        """One above the other."""
        return self._casadi.vertcat(*parts)

    def diagonal(self, values: Expression, /) -> Expression:
        """A matrix of a row's values."""
        return self._casadi.diag(self._casadi.DM(np.asarray(values)))

    def value(self, f: Scalars, x: Expression, w: Expression, /) -> Expression:
        """A column (m, 1) of columns, without the slopes, which a call would compute all the same."""
        return self._traced(f, x, w, slopes=False)(x, w)

    def linearised(self, f: Scalars, x: Expression, w: Expression, /) -> tuple[Expression, Expression]:
        """Value (m, 1) and Jacobian by x (m, n)."""
        return tuple(self._traced(f, x, w, slopes=True)(x, w))

    def change(self, rates: Scalars, x: Expression, w: Expression, dt: float) -> Expression:
        """How far a Runge-Kutta step of length `dt` [s] takes a column `x` under a column `w` that stays."""
        return rk4_change(lambda x, w: self.value(rates, x, w), x, lambda _: w, dt)

    def _traced(self, f: Scalars, x: Expression, w: Expression, *, slopes: bool) -> Graph:
        """The four stages of a Runge-Kutta step call one function."""
        casadi, key = self._casadi, (f.__code__, x.shape[0], w.shape[0], slopes)
        if key not in self._made:
            xs, ws = casadi.SX.sym("x", x.shape[0]), casadi.SX.sym("w", w.shape[0])
            values = casadi.vertcat(*f(self.scalars(xs), self.scalars(ws)))
            outputs = [values, casadi.jacobian(values, xs)] if slopes else [values]
            self._made[key] = casadi.Function(f"swash_part{len(self._made)}", [xs, ws], outputs)
        return self._made[key]

    def updated(
        self,
        H: Expression,
        mean: Expression,
        covariance: Expression,
        innovations: Expression,
        measurement: Expression,
        /,
    ) -> tuple[Expression, Expression, Expression]:
        """Mean (N, 1) and covariance (N, N) after readings, and the covariance of the innovations (m, m).

        Args:
            H: slopes of the readings (m, N). mean, covariance: predicted.
            innovations: (m, 1). measurement: variance of each reading.
        """
        together = H @ covariance
        spread = H @ together.T + self.diagonal(measurement)
        # Rows of [S | H P | innovation] without those above them, the pivots' roots taken out: a Cholesky factor L of
        # S and behind it L^-1 H P and L^-1 times the innovation, in which the update is a plain product.
        left, rows, m = self.stacked([spread, together.T, innovations.T]).T, [], innovations.shape[0]
        for i in range(m):
            (pivot,) = self.scalars(left[:1, :1])
            row = left[:1, :] * (1.0 / self.xp.sqrt(pivot))
            rows.append(row[:, m - i :])
            if i + 1 < m:
                left = left[1:, 1:] - row[:, 1 : m - i].T @ row[:, 1:]
        known = self.stacked(rows)
        scaled, news = known[:, : mean.shape[0]], known[:, mean.shape[0] :]
        return mean + scaled.T @ news, covariance - scaled.T @ scaled, spread

    def propagated(
        self, A: Expression, J: Expression | None, P: Expression, process: Expression, dt: float, /
    ) -> Expression:
        """The covariance (N, N) one sample later.

        Args:
            A: slopes of the rates of what moves, the first of what is estimated.
            J: slopes (kept, N) of the readings put in store, the last of it; None for none.
            P: now. process: variance that a sample adds to each. dt: length of the sample [s].
        """
        moves, fixed = A.shape[0], P.shape[0] - (0 if J is None else J.shape[0])
        F, _ = held_series(A, dt, np.eye(moves))
        for _ in range(2):  # rows of what moves, of offsets, of kept readings; then from the other side
            stored = [] if J is None else [J @ P]
            P = self.stacked([F @ P[:moves, :], P[moves:fixed, :], *stored]).T
        return 0.5 * (P + P.T) + self.diagonal(process)
