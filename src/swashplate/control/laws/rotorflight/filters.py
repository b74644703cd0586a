"""Rotorflight's filters, one step each, on arrays (common/filter.c): what each keeps is one column a number.

First order by the bilinear transform (`order1`), a differentiator with a bandwidth (`difFilter`), and one pole by the
backward difference (`pt1`). A corner of 0 Hz is no filter; of the differentiator it is no output.
"""

from __future__ import annotations

import math

from swashplate.engine.symbols import ArrayFunctions, Operand, Symbols
from swashplate.physics.backend import Scalar

_HIGHEST = 0.475
"""Of the rate: the highest corner that a low-pass is given; half of it for high-passes and differentiators."""
_TWO_POLES = 1.553773974


def _warped(hertz: Scalar, dt: Scalar, highest: float, xp: ArrayFunctions) -> Operand:
    return xp.tan(math.pi * xp.minimum(hertz * dt, highest))


def low_pass(kept: Symbols, value: Symbols, hertz: Scalar, dt: Scalar, xp: ArrayFunctions) -> tuple[Operand, Operand]:
    """First order: filtered (n,), and what it keeps, shape (2, n)."""
    w = _warped(hertz, dt, _HIGHEST, xp)
    after = w / (w + 1.0) * (value + kept[0]) - (w - 1.0) / (w + 1.0) * kept[1]
    after = xp.where(xp.greater(hertz, 0.0), after, value)
    return after, xp.stack([value, after])


def high_pass(kept: Symbols, value: Symbols, hertz: Scalar, dt: Scalar, xp: ArrayFunctions) -> tuple[Operand, Operand]:
    """First order: what is left (n,), and what it keeps, shape (2, n)."""
    w = _warped(hertz, dt, 0.5 * _HIGHEST, xp)
    after = (value - kept[0]) / (w + 1.0) - (w - 1.0) / (w + 1.0) * kept[1]
    after = xp.where(xp.greater(hertz, 0.0), after, value)
    return after, xp.stack([value, after])


def slope(kept: Symbols, value: Symbols, hertz: Scalar, dt: Scalar, xp: ArrayFunctions) -> tuple[Operand, Operand]:
    """The derivative up to a corner (n,), and what it keeps, shape (2, n)."""
    w = _warped(hertz, dt, 0.5 * _HIGHEST, xp)
    after = 2.0 / dt * w / (w + 1.0) * (value - kept[0]) - (w - 1.0) / (w + 1.0) * kept[1]
    after = xp.where(xp.greater(hertz, 0.0), after, 0.0 * value)
    return after, xp.stack([value, after])


def one_pole(now: Symbols, value: Symbols, hertz: Scalar, dt: Scalar, xp: ArrayFunctions) -> Operand:
    """A step from what it keeps to a value."""
    corner = xp.minimum(hertz, _HIGHEST / dt)
    share = corner / (corner + 1.0 / (2.0 * math.pi * dt))
    return now + xp.where(xp.greater(hertz, 0.0), share, 1.0) * (value - now)


def two_poles(kept: Symbols, value: Scalar, hertz: Scalar, dt: Scalar, xp: ArrayFunctions) -> Operand:
    """`pt2` of one signal: what it keeps, shape (2,); the first is the filtered value."""
    second = one_pole(kept[1], value, _TWO_POLES * hertz, dt, xp)
    return xp.stack([one_pole(kept[0], second, _TWO_POLES * hertz, dt, xp), second])
