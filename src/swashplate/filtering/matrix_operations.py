"""The few matrix operations of the observer, for JAX and for CasADi.

The observer is written once, on columns (n, 1) and matrices with `@`, `.T`, `*`, `+` and slices, which both have; what
they write differently is here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from swashplate.jax_on_demand import jax, jnp
from swashplate.physics.backend import Backend, CasadiBackend
from swashplate.simulation.dynamics import jax_backend
from swashplate.simulation.runge_kutta import rk4_change

Scalars = Callable[[Sequence[Any], Sequence[Any]], Sequence[Any]]
"""A function of two rows of scalars; scalars back."""


class Matrices(Protocol):
    """Operations beyond `@`, `.T`, `*`, `+` and slices."""

    looped: bool
    """Whether the stages of a Runge-Kutta step are a loop, compiled once."""

    @property
    def xp(self) -> Backend: ...
    def column(self, scalars: Sequence[Any], /) -> Any: ...
    def scalars(self, column: Any, /) -> list[Any]: ...
    def value(self, f: Scalars, x: Any, w: Any, /) -> Any: ...
    def linearised(self, f: Scalars, x: Any, w: Any, /) -> tuple[Any, Any]: ...
    def stacked(self, parts: Sequence[Any], /) -> Any: ...
    def diagonal(self, values: Any, /) -> Any: ...


def change(rates: Scalars, x: Any, w: Any, dt: float, M: Matrices) -> Any:
    """How far a Runge-Kutta step of length `dt` [s] takes a column `x` under a column `w` that stays."""
    return rk4_change(lambda x, w: M.value(rates, x, w), x, lambda _: w, dt, looped=M.looped)


class JaxMatrices:
    """Columns are arrays (n, 1)."""

    looped = True

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
            value = self.column(f([row[i] for i in range(x.shape[0])], rest))[:, 0]
            return value, value

        J, value = jax.jacfwd(both, has_aux=True)(x[:, 0])
        return value[:, None], J

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


class CasadiMatrices:
    """The observer's matrix operations as CasADi expressions."""

    looped = False

    def __init__(self) -> None:
        self.xp: Backend = CasadiBackend()
        self._made: dict[Any, Any] = {}

    def column(self, scalars: Sequence[Any], /) -> Any:
        import casadi

        return casadi.vertcat(*scalars)

    def scalars(self, column: Any, /) -> list[Any]:
        return [column[i] for i in range(column.shape[0])]

    def value(self, f: Scalars, x: Any, w: Any, /) -> Any:
        """Without the slopes, which a call would compute all the same."""
        import casadi

        key = (f.__code__, x.shape[0], w.shape[0], "value")
        if key not in self._made:
            xs, ws = casadi.SX.sym("x", x.shape[0]), casadi.SX.sym("w", w.shape[0])
            outputs = casadi.vertcat(*f(self.scalars(xs), self.scalars(ws)))
            self._made[key] = casadi.Function(f"swash_part{len(self._made)}", [xs, ws], [outputs])
        return self._made[key](x, w)

    def linearised(self, f: Scalars, x: Any, w: Any, /) -> tuple[Any, Any]:
        """Traced once per place in the program: the four stages of a Runge-Kutta step call one function."""
        import casadi

        key = (f.__code__, x.shape[0], w.shape[0])
        if key not in self._made:
            xs, ws = casadi.SX.sym("x", x.shape[0]), casadi.SX.sym("w", w.shape[0])
            outputs = casadi.vertcat(*f(self.scalars(xs), self.scalars(ws)))
            slopes = casadi.jacobian(outputs, xs)
            self._made[key] = casadi.Function(f"swash_part{len(self._made)}", [xs, ws], [outputs, slopes])
        return tuple(self._made[key](x, w))

    def stacked(self, parts: Sequence[Any], /) -> Any:
        import casadi

        return casadi.vertcat(*parts)

    def diagonal(self, values: Any, /) -> Any:
        import casadi

        return casadi.diag(casadi.DM(np.asarray(values)))
