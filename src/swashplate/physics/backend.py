"""The few operations that equations of motion may use, for plain floats, arrays and CasADi.

An equation is written once, on named scalars, and takes one of these as `xp`. What is not here (data-dependent loops,
in-place changes, Python branches on values) cannot be traced by all three and does not belong in an equation.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

Scalar = Any
"""A number: `float`, an array, or a CasADi expression."""

Named = Any
"""A named tuple of such numbers: parameters, inputs or outputs, with the names that its model has."""


class Backend(Protocol):
    """The operations of an equation.

    Attributes:
        arrays: NumPy for what is integrated numerically; None where a number is
            an expression, and such equations cannot be traced.
    """

    arrays: Any

    def sin(self, x: Scalar, /) -> Scalar: ...
    def cos(self, x: Scalar, /) -> Scalar: ...
    def tan(self, x: Scalar, /) -> Scalar: ...
    def sqrt(self, x: Scalar, /) -> Scalar: ...
    def atan2(self, y: Scalar, x: Scalar, /) -> Scalar: ...
    def abs(self, x: Scalar, /) -> Scalar: ...
    def where(self, condition: Scalar, x: Scalar, y: Scalar, /) -> Scalar: ...
    def minimum(self, x: Scalar, y: Scalar, /) -> Scalar: ...
    def maximum(self, x: Scalar, y: Scalar, /) -> Scalar: ...
    def detached(self, x: Scalar, /) -> Scalar: ...


class FloatBackend:
    """Plain Python floats: slow, and good for looking at one evaluation by hand."""

    arrays: Any = np
    sin = staticmethod(math.sin)
    cos = staticmethod(math.cos)
    tan = staticmethod(math.tan)
    sqrt = staticmethod(math.sqrt)
    atan2 = staticmethod(math.atan2)
    abs = staticmethod(abs)
    minimum = staticmethod(min)
    maximum = staticmethod(max)

    @staticmethod
    def where(condition: bool, x: float, y: float) -> float:
        return x if condition else y

    @staticmethod
    def detached(x: float) -> float:
        return x


class ArrayBackend:
    """Arrays: a whole record at once by NumPy, or by other functions of the same names."""

    def __init__(self, arrays: Any = np) -> None:
        self.arrays = arrays
        self.sin, self.cos, self.tan, self.sqrt = arrays.sin, arrays.cos, arrays.tan, arrays.sqrt
        self.atan2, self.abs, self.where = arrays.arctan2, arrays.abs, arrays.where
        self.minimum, self.maximum = arrays.minimum, arrays.maximum
        self.detached: Callable[[Scalar], Scalar] = _same


class CasadiBackend:
    """CasADi expressions: export to C and FMU (needs the extra `model`)."""

    def __init__(self) -> None:
        import casadi

        self.arrays: Any = None
        self.sin, self.cos, self.tan, self.sqrt = casadi.sin, casadi.cos, casadi.tan, casadi.sqrt
        self.atan2, self.abs, self.where = casadi.atan2, casadi.fabs, casadi.if_else
        self.minimum, self.maximum = casadi.fmin, casadi.fmax
        self.detached: Callable[[Scalar], Scalar] = _same


def _same(x: Scalar) -> Scalar:
    return x


_DIFFERENTIATED = 2
"""Newton steps that derivatives go through: one makes first derivatives exact, two second ones."""


def newton(residual: Callable[[Scalar], tuple[Scalar, Scalar]], start: Scalar, *, steps: int, xp: Backend) -> Scalar:
    """A fixed number of Newton steps, unrolled so that every backend can trace them.

    Automatic differentiation sees the last two only: at the solution they carry what the implicit function theorem
    says, and the others nothing (`xp.detached` hides a value's origin from differentiation).

    Args:
        residual: returns the residual and its derivative at a point.
        start: first guess.
        steps: how many steps; choose it so that the last two no longer move the answer.
        xp: the operations.
    """
    solver = getattr(xp, "newton", None)  # a back end that can end a loop early may do so
    if solver is not None:
        return solver(residual, start, steps=steps)
    x = start
    for step in range(steps):
        if step == steps - _DIFFERENTIATED:
            x = xp.detached(x)
        value, slope = residual(x)
        x = x - value / slope
    return x
