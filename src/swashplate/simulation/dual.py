"""Numbers that carry their slopes, for equations that are asked a few times: nothing is compiled.

Forward differentiation by operators (Griewank and Walther 2008, sec. 6.1), all directions at once. Rules at kinks are
those of JAX.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import SwashError

Number = Any
"""A float, or a `Dual`."""


def _over(a: float, b: float) -> float:
    """a / b, where b may be zero."""
    if b:
        return a / b
    return math.copysign(math.inf, a) * math.copysign(1.0, b) if a else math.nan


class Dual:
    """A number and its slopes along all directions, (n,)."""

    __slots__ = ("slope", "value")
    __array_ufunc__ = None  # a NumPy scalar in front leaves the operation to this class

    def __init__(self, value: float, slope: Array) -> None:
        self.value, self.slope = value, slope

    def __add__(self, other: Number) -> Dual:
        if type(other) is Dual:
            return Dual(self.value + other.value, self.slope + other.slope)
        return Dual(self.value + other, self.slope)

    __radd__ = __add__

    def __sub__(self, other: Number) -> Dual:
        if type(other) is Dual:
            return Dual(self.value - other.value, self.slope - other.slope)
        return Dual(self.value - other, self.slope)

    def __rsub__(self, other: float) -> Dual:
        return Dual(other - self.value, -self.slope)

    def __mul__(self, other: Number) -> Dual:
        if type(other) is Dual:
            return Dual(self.value * other.value, self.slope * other.value + other.slope * self.value)
        return Dual(self.value * other, self.slope * other)

    __rmul__ = __mul__

    def __truediv__(self, other: Number) -> Dual:
        if type(other) is Dual:
            value = _over(self.value, other.value)
            return Dual(value, (self.slope - other.slope * value) * _over(1.0, other.value))
        return Dual(_over(self.value, other), self.slope * _over(1.0, other))

    def __rtruediv__(self, other: float) -> Dual:
        value = _over(other, self.value)
        return Dual(value, self.slope * -_over(value, self.value))

    def __pow__(self, power: float) -> Dual:
        value = self.value
        if value < 0.0 and power != int(power):
            return Dual(math.nan, self.slope * math.nan)
        return Dual(value**power, self.slope * (power * value ** (power - 1)))

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slope)

    def __pos__(self) -> Dual:
        return self

    __hash__ = None

    def __eq__(self, other: object) -> bool:
        return bool(self.value == value_of(other))

    def __bool__(self) -> bool:
        return bool(self.value)

    def __lt__(self, other: Number) -> bool:
        return self.value < value_of(other)

    def __le__(self, other: Number) -> bool:
        return self.value <= value_of(other)

    def __gt__(self, other: Number) -> bool:
        return self.value > value_of(other)

    def __ge__(self, other: Number) -> bool:
        return self.value >= value_of(other)


def value_of(number: Number) -> float:
    """A number without its slopes."""
    return number.value if type(number) is Dual else number


def _function(value: Callable[[float], float], slope: Callable[[float, float], float]) -> Callable[[Number], Number]:
    """A function of one number; its slope is asked with the argument and the value."""

    def of(x: Number) -> Number:
        if type(x) is not Dual:
            return value(x)
        made = value(x.value)
        return Dual(made, x.slope * slope(x.value, made))

    return of


def _atan2(y: Number, x: Number) -> Number:
    a, b = value_of(y), value_of(x)
    value, squared = math.atan2(a, b), a * a + b * b
    slopes = [n.slope * _over(factor, squared) for n, factor in ((y, b), (x, -a)) if type(n) is Dual]
    return Dual(value, np.asarray(sum(slopes[1:], start=slopes[0]))) if slopes else value


def _extreme(sign: float) -> Callable[[Number, Number], Number]:
    """The larger (1) or the smaller (-1) of two numbers; where they are the same, the mean of their slopes."""

    def of(x: Number, y: Number) -> Number:
        a, b = sign * value_of(x), sign * value_of(y)
        return 0.5 * (x + y) if a == b else x if a > b else y

    return of


class DualBackend:
    """Operations on floats and `Dual` numbers."""

    arrays: Any = None
    sin = staticmethod(_function(math.sin, lambda x, _: math.cos(x)))
    cos = staticmethod(_function(math.cos, lambda x, _: -math.sin(x)))
    tan = staticmethod(_function(math.tan, lambda _, made: 1.0 + made * made))
    sqrt = staticmethod(_function(lambda x: math.sqrt(x) if x >= 0.0 else math.nan, lambda _, made: _over(0.5, made)))
    abs = staticmethod(_function(abs, lambda x, _: (x > 0.0) - (x < 0.0)))
    atan2 = staticmethod(_atan2)
    minimum = staticmethod(_extreme(-1.0))
    maximum = staticmethod(_extreme(1.0))
    detached = staticmethod(value_of)

    @staticmethod
    def where(condition: bool | np.bool_, x: Number, y: Number) -> Number:
        return x if condition else y


DUAL = DualBackend()
CANNOT = (SwashError, ArithmeticError, ValueError, TypeError, AttributeError)
"""What equations raise that cannot take these numbers: sums over arrays, plain floats divided by zero."""


def slopes_of(f: Callable[[list[Dual], list[Dual]], Sequence[Number]], x: Array, w: Array) -> tuple[Array, Array]:
    """Values (m,) of a function of two rows of numbers, and slopes (m, x and w) by both.

    What is not a number of plain floats or these, or divides plain floats by zero, raises what Python raises.
    """
    directions = len(x) + len(w)
    moving = [Dual(value, slope) for value, slope in zip([*x.tolist(), *w.tolist()], np.eye(directions), strict=True)]
    with np.errstate(all="ignore"):
        numbers = f(moving[: len(x)], moving[len(x) :])
    slopes = np.zeros((len(numbers), directions))
    for row, number in zip(slopes, numbers, strict=True):
        if type(number) is Dual:
            row[:] = number.slope
    return np.array([value_of(number) for number in numbers], dtype=np.float64), slopes
