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


Residual = Callable[[Scalar], tuple[Scalar, Scalar]]
"""What a root makes zero, and its derivative, at a point."""


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
    def newton(self, residual: Residual, start: Scalar, *, steps: int) -> Scalar: ...


_DIFFERENTIATED = 2
"""Newton steps that derivatives go through: one makes first derivatives exact, two second ones."""


class UnrolledSearch:
    """Newton's method in a fixed number of steps, for a back end that cannot leave a loop early."""

    def detached(self, x: Scalar) -> Scalar:
        """A value whose origin is hidden from differentiation, where there is any."""
        return x

    def newton(self, residual: Residual, start: Scalar, *, steps: int) -> Scalar:
        """A root.

        Automatic differentiation sees the last two steps only: at the solution they carry what the implicit function
        theorem says, and the others nothing.

        Args:
            residual: what the root makes zero.
            start: first guess.
            steps: how many steps; choose it so that the last two no longer move the answer.
        """
        x = start
        for step in range(steps):
            if step == steps - _DIFFERENTIATED:
                x = self.detached(x)
            value, slope = residual(x)
            x = x - value / slope
        return x


class FloatBackend(UnrolledSearch):
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


class ArrayBackend(UnrolledSearch):
    """Arrays: a whole record at once by NumPy, or by other functions of the same names."""

    def __init__(self, arrays: Any = np) -> None:
        self.arrays = arrays
        self.sin, self.cos, self.tan, self.sqrt = arrays.sin, arrays.cos, arrays.tan, arrays.sqrt
        self.atan2, self.abs, self.where = arrays.arctan2, arrays.abs, arrays.where
        self.minimum, self.maximum = arrays.minimum, arrays.maximum


class CasadiBackend(UnrolledSearch):
    """CasADi expressions: export to C and FMU (needs the extra `model`)."""

    def __init__(self) -> None:
        import casadi

        self.arrays: Any = None
        self.sin, self.cos, self.tan, self.sqrt = casadi.sin, casadi.cos, casadi.tan, casadi.sqrt
        self.atan2, self.abs, self.where = casadi.atan2, casadi.fabs, casadi.if_else
        self.minimum, self.maximum = casadi.fmin, casadi.fmax
