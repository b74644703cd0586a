"""Exact slopes at a point: of a vehicle's rates by its state and what drives it, and of other functions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.equations import Equations, unpack_rows
from swashplate.engine.graph import Expression, Graph
from swashplate.engine.roots import Looping, require_casadi
from swashplate.engine.untraced import untraced
from swashplate.physics.backend import Backend, CasadiBackend, Residual

Scalars = Callable[[Sequence[Expression], Sequence[Expression], Sequence[Expression], Backend], Sequence[Expression]]
"""`f(x, w, p, xp)`: a row of scalars of a state row, a driving row and a row of numbers."""
Slopes = Callable[[Array, Array, Array], tuple[Array, Array, Array]]
"""Of (x, w, p) the values (m,), their slopes by x (m, n) and by w (m, driving)."""


def rates_and_slopes(equations: Equations, x: Array, w: Array, p: Array) -> tuple[Array, Array, Array]:
    """The rates of a state row (n,), and their slopes by it (n, n) and by what drives it (n, driving).

    Args:
        equations: of which vehicle.
        x, w, p: rows as in `engine.trace.traced_rates`.

    Raises:
        ExportError: for equations that CasADi cannot trace.
    """
    return _of_rates(equations)(x, w, p)


def slopes_of(f: Scalars, sizes: tuple[int, int, int], *, where: str) -> Slopes:
    """A function's values and slopes, from its graph.

    Args:
        f: what is differentiated. sizes: of x, w and p. where: whose it is, for messages.

    Raises:
        ExportError: where CasADi cannot trace it.
    """
    casadi = require_casadi()
    given = [casadi.SX.sym(name, size) for name, size in zip("xwp", sizes, strict=True)]
    try:
        values, slopes = with_slopes(f, *given)
    except Exception as error:  # whatever a model of another package does with numbers that are none
        raise untraced(error, "equations", where) from error
    graph = casadi.Function("slopes", given, [casadi.densify(values), casadi.densify(slopes)], {"cse": True})

    def at(x: Array, w: Array, p: Array) -> tuple[Array, Array, Array]:
        values, slopes = (np.asarray(part.full(), dtype=np.float64) for part in graph(x, w, p))
        return values[:, 0], slopes[:, : len(x)], slopes[:, len(x) :]

    return at


def with_slopes(f: Scalars, x: Expression, w: Expression, p: Expression) -> tuple[Expression, Expression]:
    """Values (m, 1) and slopes by x and w side by side (m, n + driving), as CasADi's expressions of columns.

    Slopes of a root are those of its residual there (implicit function theorem), not of the search that finds it.
    """
    casadi, recording, left = require_casadi(), _Recording(), Looping(require_casadi())
    rows = [[column[i] for i in range(column.shape[0])] for column in (x, w, p)]
    values = casadi.vertcat(*f(rows[0], rows[1], rows[2], recording))
    if not recording.roots:
        return values, casadi.jacobian(values, casadi.vertcat(x, w))
    moving = casadi.vertcat(x, w)
    open_values = casadi.vertcat(*f(rows[0], rows[1], rows[2], left))
    roots, guesses = (casadi.vertcat(*(getattr(root, name) for root in left.roots)) for name in ("root", "guess"))
    residuals = casadi.substitute(casadi.vertcat(*(root.value for root in left.roots)), guesses, roots)
    by_moving, by_root = casadi.jacobian(residuals, moving), casadi.jacobian(residuals, roots)
    root_slopes = casadi.SX(0, moving.shape[0])
    for i in range(roots.shape[0]):  # a root depends on earlier ones
        root_slopes = casadi.vertcat(root_slopes, -(by_moving[i, :] + by_root[i, :i] @ root_slopes) / by_root[i, i])
    slopes = casadi.jacobian(open_values, moving) + casadi.jacobian(open_values, roots) @ root_slopes
    at_roots = casadi.Function("at_roots", [x, w, p, roots], [open_values, slopes], {"cse": True})
    return tuple(at_roots(x, w, p, casadi.vertcat(*recording.roots)))


class _Recording(CasadiBackend):
    """Seeks roots in a fixed number of steps, and keeps what it finds."""

    def __init__(self) -> None:
        super().__init__()
        self.roots: list[Expression] = []

    def newton(self, residual: Residual, start: Expression, *, steps: int) -> Expression:
        self.roots.append(super().newton(residual, start, steps=steps))
        return self.roots[-1]


@lru_cache(maxsize=64)
def _of_rates(equations: Equations) -> Slopes:
    return slopes_of(_rates(equations), _sizes(equations), where=equations.vehicle.name)


def rates_at(equations: Equations) -> Graph:
    """The rates and their slopes by state and driving row side by side, as a CasADi function of (x, w, p)."""
    casadi = require_casadi()
    given = [casadi.SX.sym(name, size) for name, size in zip("xwp", _sizes(equations), strict=True)]
    return casadi.Function("rates_at", given, with_slopes(_rates(equations), *given), {"cse": True})


def _sizes(equations: Equations) -> tuple[int, int, int]:
    vehicle = equations.vehicle
    return len(vehicle.state_names), len(vehicle.input_names) + 4, len(vehicle.parameter_names) + 2


def _rates(equations: Equations) -> Scalars:
    return lambda x, w, p, xp: equations.vehicle.rates(x, *unpack_rows(equations, w, p), xp)
