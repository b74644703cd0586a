"""Ties between parameters: a small arithmetic grammar that is parsed and walked, never evaluated as code.

expression = number | name | expression (+ - * /) expression | -expression | (expression)
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable, Mapping
from typing import Any

from swashplate.errors import ExpressionError

_OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
}
_LONGEST = 500
_DEEPEST = 50


class Expression:
    """A parsed expression.

    Attributes:
        text: as the user wrote it.
        names: the parameters that it uses.
    """

    def __init__(self, text: str) -> None:
        if len(text) > _LONGEST:
            raise ExpressionError(f"an expression of {len(text)} characters is too long (at most {_LONGEST}).")
        try:
            tree = ast.parse(text.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            raise _refused(text) from None
        _check(tree, text)
        self.text = text.strip()
        self.names = frozenset(node.id for node in ast.walk(tree) if isinstance(node, ast.Name))
        self._tree = tree

    def __call__(self, values: Mapping[str, Any]) -> Any:
        """The expression's value for the parameters' values (numbers or traced numbers).

        Raises:
            ExpressionError: where a plain number is divided by zero.
        """
        try:
            return _walk(self._tree, values)
        except ZeroDivisionError:
            zeros = sorted(name for name in self.names if values.get(name) == 0.0)
            raise ExpressionError(
                f"'{self.text}' divides by zero{(' (' + ', '.join(zeros) + ' = 0)') if zeros else ''}.",
                hint="Change the value or the expression.",
            ) from None

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Expression) and self.text == other.text

    def __hash__(self) -> int:
        return hash(self.text)

    def __repr__(self) -> str:
        return f"Expression({self.text!r})"


def _refused(text: str) -> ExpressionError:
    return ExpressionError(
        f"'{text.strip()}' is not an expression of numbers, parameter names, + - * / and brackets.",
        hint="An example: 'a_beta_u = a_alpha_v' or 'Lw = 2 * Mu'.",
    )


def _check(node: ast.expr, text: str, depth: int = 0) -> None:
    if depth > _DEEPEST:
        raise ExpressionError(f"an expression of more than {_DEEPEST} operations inside each other is too deep.")
    match node:
        case ast.Name():
            return
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            if abs(value) > sys.float_info.max:
                raise _refused(text)
        case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=operand):
            _check(operand, text, depth + 1)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            _check(left, text, depth + 1)
            _check(right, text, depth + 1)
        case _:
            raise _refused(text)


def _walk(node: ast.expr, values: Mapping[str, Any]) -> Any:
    match node:
        case ast.Name(id=name):
            return values[name]
        case ast.Constant(value=value):
            return float(value)  # pyrefly: ignore[bad-argument-type]
        case ast.UnaryOp(op=op, operand=operand):
            inner = _walk(operand, values)
            return -inner if isinstance(op, ast.USub) else inner
        case ast.BinOp(left=left, op=op, right=right):
            return _OPERATORS[type(op)](_walk(left, values), _walk(right, values))
    raise AssertionError("checked when parsed")


def parse_tie(text: str) -> tuple[str, Expression]:
    """`"name = expression"` as the tied name and what it is tied to."""
    name, equals, right = text.partition("=")
    if not equals or not name.strip().isidentifier():
        raise ExpressionError(f"'{text}' is not of the form 'name = expression'.")
    return name.strip(), Expression(right)
