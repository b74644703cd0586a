"""Names of what CasADi computes with: it tells a type checker nothing about them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

Expression: TypeAlias = Any
"""A scalar or a matrix of expressions (SX, MX) or of numbers (DM)."""

Row: TypeAlias = Sequence[Any]
"""Of scalars: numbers or expressions."""

Graph: TypeAlias = Any
"""A function of expressions (casadi.Function)."""
