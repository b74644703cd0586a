"""The few matrix operations of the observer, for JAX here and for CasADi in `swashplate.export`.

The observer is written once, on columns (n, 1) and matrices with `@`, `.T`, `*`, `+` and slices, which both have; what
they write differently is here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import jax
import jax.numpy as jnp

from swashplate.physics.backend import Backend
from swashplate.simulation.dynamics import jax_backend

Scalars = Callable[[Sequence[Any], Sequence[Any]], Sequence[Any]]
"""A function of two rows of scalars; scalars back."""


class Matrices(Protocol):
    """Operations beyond `@`, `.T`, `*`, `+` and slices."""

    @property
    def xp(self) -> Backend: ...
    def column(self, scalars: Sequence[Any], /) -> Any: ...
    def scalars(self, column: Any, /) -> list[Any]: ...
    def value(self, f: Scalars, x: Any, w: Any, /) -> Any: ...
    def linearised(self, f: Scalars, x: Any, w: Any, /) -> tuple[Any, Any]: ...
    def repeated(self, count: int, body: Callable[[Any, Any], Any], start: Any, /) -> Any: ...
    def chosen(self, values: Sequence[float], i: Any, /) -> Any: ...
    def stacked(self, parts: Sequence[Any], /) -> Any: ...
    def diagonal(self, values: Any, /) -> Any: ...


def runge_kutta(rates: Scalars, x: Any, w: Any, dt: float, M: Matrices) -> Any:
    """How far a classical Runge-Kutta step of length `dt` [s] takes a column `x` under a column `w` that stays."""

    def stage(i: Any, carry: Any) -> Any:
        k, total = carry
        ahead, weight = M.chosen((0.0, 0.5, 0.5, 1.0), i) * dt, M.chosen((1 / 6, 1 / 3, 1 / 3, 1 / 6), i) * dt
        k = M.value(rates, x + ahead * k, w)
        return k, total + weight * k

    return M.repeated(4, stage, (0.0 * x, 0.0 * x))[1]


class JaxMatrices:
    """Columns are arrays (n, 1); a repeated part is a loop, so that it is compiled once."""

    def __init__(self) -> None:
        self.xp: Backend = jax_backend()

    def column(self, scalars: Sequence[Any], /) -> Any:
        return jnp.stack([jnp.reshape(jnp.asarray(s, dtype=float), ()) for s in scalars])[:, None]

    def scalars(self, column: Any, /) -> list[Any]:
        return [column[i, 0] for i in range(column.shape[0])]

    def value(self, f: Scalars, x: Any, w: Any, /) -> Any:
        return self.column(f(self.scalars(x), self.scalars(w)))

    def linearised(self, f: Scalars, x: Any, w: Any, /) -> tuple[Any, Any]:
        """Value (m, 1) and Jacobian by x (m, n)."""
        rest = self.scalars(w)

        def both(row: Any) -> tuple[Any, Any]:
            found = self.column(f([row[i] for i in range(x.shape[0])], rest))[:, 0]
            return found, found

        J, found = jax.jacfwd(both, has_aux=True)(x[:, 0])
        return found[:, None], J

    def repeated(self, count: int, body: Callable[[Any, Any], Any], start: Any, /) -> Any:
        return jax.lax.fori_loop(0, count, body, start)

    def chosen(self, values: Sequence[float], i: Any, /) -> Any:
        return jnp.asarray(values)[i]

    def row(self, scalars: Sequence[Any], /) -> Any:
        """Scalars side by side."""
        return self.column(scalars)[:, 0]

    def matrix(self, row: Any, rows: int, columns: int, /) -> Any:
        """A matrix from a row of its entries, row after row; `flat` is the way back."""
        return row.reshape(rows, columns)

    def flat(self, matrix: Any, /) -> Any:
        return matrix.ravel()

    def stacked(self, parts: Sequence[Any], /) -> Any:
        """One above the other."""
        return jnp.concatenate(parts, axis=0)

    def diagonal(self, values: Any, /) -> Any:
        """A matrix of a row's values."""
        return jnp.eye(len(values)) * values
