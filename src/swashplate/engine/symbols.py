"""Arrays of symbols: a controller's step that is written for arrays, traced by CasADi.

A step takes `xp`, a namespace of array functions: NumPy for numbers, `SymbolArrays` for a trace. An array of symbols is
a NumPy array of objects, so that its operators are those of every array. Comparisons of whole arrays are asked of `xp`
(`xp.greater`): NumPy turns the result of `>` into truth values, which a symbol has not.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.engine.graph import Expression
from swashplate.engine.roots import require_casadi

Symbols = NDArray[Any]
"""An array of `Symbol`s and numbers."""

Operand: TypeAlias = Any
"""A `Symbol`, a number, or an array of them: operators of arrays of objects give what a type cannot tell."""

ArrayFunctions: TypeAlias = Any
"""NumPy, or `SymbolArrays` for a trace: what a step calls `xp`."""


class Symbol:
    """One expression of CasADi that an array of objects may hold."""

    __slots__ = ("expression",)

    def __init__(self, expression: Expression) -> None:
        self.expression = expression

    def __add__(self, other: Operand) -> Operand:
        return _combined(lambda a, b: a + b, self, other)

    def __radd__(self, other: Operand) -> Operand:
        return _combined(lambda a, b: b + a, self, other)

    def __sub__(self, other: Operand) -> Operand:
        return _combined(lambda a, b: a - b, self, other)

    def __rsub__(self, other: Operand) -> Operand:
        return _combined(lambda a, b: b - a, self, other)

    def __mul__(self, other: Operand) -> Operand:
        return _combined(lambda a, b: a * b, self, other)

    def __rmul__(self, other: Operand) -> Operand:
        return _combined(lambda a, b: b * a, self, other)

    def __truediv__(self, other: Operand) -> Operand:
        return _combined(lambda a, b: a / b, self, other)

    def __rtruediv__(self, other: Operand) -> Operand:
        return _combined(lambda a, b: b / a, self, other)

    def __pow__(self, other: Operand) -> Operand:
        return _combined(lambda a, b: a**b, self, other)

    def __rpow__(self, other: Operand) -> Operand:
        return _combined(lambda a, b: b**a, self, other)

    def __and__(self, other: Operand) -> Operand:
        return _combined(require_casadi().logic_and, self, other)

    def __rand__(self, other: Operand) -> Operand:
        return self & other

    def __or__(self, other: Operand) -> Operand:
        return _combined(require_casadi().logic_or, self, other)

    def __ror__(self, other: Operand) -> Operand:
        return self | other

    def __gt__(self, other: Operand) -> Operand:
        return _combined(lambda a, b: a > b, self, other)

    def __ge__(self, other: Operand) -> Operand:
        return _combined(lambda a, b: a >= b, self, other)

    def __lt__(self, other: Operand) -> Operand:
        return _combined(lambda a, b: a < b, self, other)

    def __le__(self, other: Operand) -> Operand:
        return _combined(lambda a, b: a <= b, self, other)

    def __neg__(self) -> Symbol:
        return Symbol(-self.expression)

    def __abs__(self) -> Symbol:
        return Symbol(require_casadi().fabs(self.expression))

    def __bool__(self) -> bool:
        raise TypeError("a symbol is neither true nor false: ask `xp.where`, and `xp.greater` of whole arrays")


def _combined(f: Callable[[Expression, Expression], Expression], one: Symbol, other: Operand) -> Operand:
    return NotImplemented if isinstance(other, np.ndarray) else Symbol(f(one.expression, expression_of(other)))


def expression_of(value: Operand) -> Expression:
    """What CasADi knows of a symbol or a number."""
    if isinstance(value, Symbol):
        return value.expression
    return float(value) if isinstance(value, int | float | np.generic | bool) else value


def symbols(column: Expression) -> Symbols:
    """The entries of a column of CasADi as an array (n,)."""
    entries = np.empty(column.shape[0], dtype=object)
    entries[:] = [Symbol(column[i]) for i in range(column.shape[0])]
    return entries


def expressions(values: Operand) -> Expression:
    """An array (n,) of symbols and numbers as a column of CasADi."""
    return require_casadi().vertcat(*(expression_of(value) for value in np.ravel(values)))


class SymbolArrays:
    """The array functions that a step may use, on symbols; those of the same names in NumPy on numbers."""

    pi = np.pi
    stack = staticmethod(np.stack)
    concatenate = staticmethod(np.concatenate)
    reshape = staticmethod(np.reshape)
    ravel = staticmethod(np.ravel)
    atleast_1d = staticmethod(np.atleast_1d)
    array = staticmethod(np.array)
    zeros, ones = staticmethod(np.zeros), staticmethod(np.ones)
    cross = staticmethod(np.cross)

    def __init__(self) -> None:
        casadi = require_casadi()
        self.sin, self.cos, self.tan, self.sqrt = (
            _each(f, 1) for f in (casadi.sin, casadi.cos, casadi.tan, casadi.sqrt)
        )
        self.arctan, self.abs, self.sign = (_each(f, 1) for f in (casadi.atan, casadi.fabs, casadi.sign))
        self.log2 = _each(lambda x: casadi.log(x) / np.log(2.0), 1)
        self.arctan2, self.minimum, self.maximum = (_each(f, 2) for f in (casadi.atan2, casadi.fmin, casadi.fmax))
        self.greater, self.less_equal = _each(lambda a, b: a > b, 2), _each(lambda a, b: a <= b, 2)
        self.where = _each(casadi.if_else, 3)

    def clip(self, x: Operand, low: Operand, high: Operand) -> Operand:
        return self.minimum(self.maximum(x, low), high)

    def radians(self, x: Operand) -> Operand:
        return x * (np.pi / 180.0)


def _each(function: Callable[..., Any], arguments: int) -> Callable[..., Any]:
    """A function of expressions as one of arrays."""

    def wrapped(*values: Operand) -> Symbol:
        return Symbol(function(*map(expression_of, values)))

    many = np.frompyfunc(wrapped, arguments, 1)

    def applied(*values: Operand) -> Operand:
        return many(*values) if any(isinstance(value, np.ndarray) for value in values) else wrapped(*values)

    return applied


def jacobian_at(f: Callable[[Symbols, Any], Any], at: Array) -> Array:
    """The Jacobian (m, n) of a function of a row (n,) and array functions, `f(row, xp)`, at a point."""
    casadi = require_casadi()
    x = casadi.SX.sym("x", len(at))
    slopes = casadi.jacobian(expressions(f(symbols(x), SymbolArrays())), x)
    return np.asarray(casadi.Function("slopes", [x], [casadi.densify(slopes)])(at).full(), dtype=np.float64)
