"""Exact slopes of a graph at a point: of a vehicle's rates by its state and what drives it, and of other functions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.equations import Equations
from swashplate.engine.roots import require_casadi
from swashplate.engine.trace import unrolled_rates
from swashplate.errors import ExportError
from swashplate.physics.backend import Backend, CasadiBackend

Scalars = Callable[[Sequence[Any], Sequence[Any], Sequence[Any], Backend], Sequence[Any]]
"""`f(x, w, p, xp)`: a row of scalars of a state row, a driving row and a row of numbers."""


def rates_and_slopes(equations: Equations, x: Array, w: Array, p: Array) -> tuple[Array, Array, Array]:
    """The rates of a state row (n,), and their slopes by it (n, n) and by what drives it (n, driving).

    Args:
        equations: of which vehicle.
        x, w, p: rows as in `engine.trace.traced_rates`.

    Raises:
        ExportError: for equations that CasADi cannot trace.
    """
    return _split(_slopes_of_rates(equations)(x, w, p), len(x))


def slopes_graph(f: Scalars, sizes: tuple[int, int, int], *, where: str) -> Any:
    """A CasADi function of (x, w, p) to the values of `f` and their slopes by x and w, side by side.

    Args:
        f: what is traced. sizes: of x, w and p. where: whose it is, for messages.

    Raises:
        ExportError: where CasADi cannot trace it.
    """
    casadi = require_casadi()
    x, w, p = (casadi.SX.sym(name, size) for name, size in zip("xwp", sizes, strict=True))
    try:
        rows = [[column[i] for i in range(column.shape[0])] for column in (x, w, p)]
        values = casadi.vertcat(*f(rows[0], rows[1], rows[2], CasadiBackend()))
    except Exception as error:  # whatever a model of another package does with numbers that are none
        raise ExportError(f"CasADi cannot trace the equations: {error}", where=where) from error
    return _with_slopes(casadi, x, w, p, values)


def slopes_at(graph: Any, x: Array, w: Array, p: Array) -> tuple[Array, Array, Array]:
    """Values (m,) and slopes by x (m, n) and by w (m, driving) of a graph of `slopes_graph`."""
    return _split(graph(x, w, p), len(x))


@lru_cache(maxsize=64)
def _slopes_of_rates(equations: Equations) -> Any:
    casadi, rates = require_casadi(), unrolled_rates(equations)
    x, w, p = (casadi.SX.sym(name, rates.size1_in(i)) for i, name in enumerate("xwp"))
    return _with_slopes(casadi, x, w, p, rates(x, w, p))


def _with_slopes(casadi: Any, x: Any, w: Any, p: Any, values: Any) -> Any:
    slopes = casadi.densify(casadi.jacobian(values, casadi.vertcat(x, w)))
    return casadi.Function("slopes", [x, w, p], [casadi.densify(values), slopes], {"cse": True})


def _split(results: Sequence[Any], n: int) -> tuple[Array, Array, Array]:
    values, slopes = (np.asarray(part.full(), dtype=np.float64) for part in results)
    return values[:, 0], slopes[:, :n], slopes[:, n:]
