"""A traced function on arrays: its statements one after the other, each for all rows at once.

CasADi's virtual machine takes a statement of one row in a few nanoseconds, and asks for the next row anew. NumPy takes
one statement for some hundred rows in the time of a few, and compiles nothing. JAX computes the same on a card.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.graph import Graph
from swashplate.engine.statements import Statements, statements

_ROWS = 512
"""Rows at a time: what a statement reads and writes then stays in a core's cache."""


class OnArrays:
    """A CasADi function (traced on SX) of columns, as a function of arrays whose first axis are the rows.

    Args:
        function: dense or sparse outputs; entries that are no nonzeros are zero.

    Raises:
        ExportError: for an operation that the equations of this package do not use.
    """

    def __init__(self, function: Graph) -> None:
        self._names = [f"a{i}" for i in range(function.n_in())]
        self._shapes = [function.size_out(i) for i in range(function.n_out())]
        self._code = statements(function, precision="double", inputs=self._names)
        self._steps = in_order(self._code, operations(np))

    def __call__(self, *columns: Array) -> tuple[Array, ...]:
        """Results (rows, outputs) of a column, (rows, outputs, columns) of a matrix.

        Args:
            columns: (rows, size) of each argument, or (size,) for the same in all rows.
        """
        n = max([len(part) for part in columns if part.ndim == 2], default=1)
        results = [np.zeros((n, *shape)) for shape in self._shapes]
        with np.errstate(all="ignore"):  # a branch that is not taken may divide by zero
            for first in range(0, n, _ROWS):
                here = slice(first, first + _ROWS)
                known: dict[str, Any] = {}
                for name, part in zip(self._names, columns, strict=True):
                    rows = part[here].T.copy() if part.ndim == 2 else part
                    known.update((f"{name}[{i}]", rows[i]) for i in range(part.shape[-1]))
                self._run(known, results, here)
        return tuple(part[..., 0] if part.shape[2] == 1 else part for part in results)

    def _run(self, known: dict[str, Any], results: list[Array], here: slice) -> None:
        for name, function, reads, spent in self._steps:
            known[name] = function(*[known[read] if isinstance(read, str) else read for read in reads])
            for one in spent:
                del known[one]
        for (place, entry), text in self._code.outputs.items():
            width = self._shapes[place][1]
            results[place][here, entry // width, entry % width] = value_of(known, text)


Step = tuple[str, Callable[..., Any], list[Any], list[str]]
"""The constant that is made, by what, of which constants or numbers, and which constants nobody reads any more."""


def in_order(code: Statements, wide: dict[str, Callable[..., Any]]) -> list[Step]:
    """The statements as calls, with numbers in place of their texts."""
    computed = {statement.name for statement in code.body}
    last: dict[str, int] = {}
    for i, statement in enumerate(code.body):
        last.update(dict.fromkeys(statement.reads, i))
    passing = computed - set(code.outputs.values())
    steps: list[Step] = []
    for i, statement in enumerate(code.body):
        spent = [name for name in dict.fromkeys(statement.reads) if last[name] == i and name in passing]
        reads = [text if text in computed or "[" in text else float(text.strip("()")) for text in statement.reads]
        steps.append((statement.name, wide[statement.operation], reads, spent))
    return steps


def value_of(known: dict[str, Any], text: str) -> Any:
    """A constant, or the number that a text says."""
    return known[text] if text in known else float(text.strip("()"))


def operations(xp: Any) -> dict[str, Callable[..., Any]]:
    """What each statement does with the arrays of `numpy` or of `jax.numpy`."""
    return {
        "ADD": lambda a, b: a + b,
        "SUB": lambda a, b: a - b,
        "MUL": lambda a, b: a * b,
        "DIV": lambda a, b: a / b,
        "POW": lambda a, b: a**b,
        "CONSTPOW": lambda a, b: a**b,
        "NEG": lambda a: -a,
        "SQ": lambda a: a * a,
        "TWICE": lambda a: a + a,
        "INV": lambda a: 1.0 / a,
        "ASSIGN": lambda a: a,
        "SQRT": xp.sqrt,
        "SIN": xp.sin,
        "COS": xp.cos,
        "TAN": xp.tan,
        "FABS": xp.abs,
        "ATAN2": xp.arctan2,
        "SIGN": xp.sign,
        "FMIN": xp.minimum,
        "FMAX": xp.maximum,
        "LT": lambda a, b: xp.where(a < b, 1.0, 0.0),
        "LE": lambda a, b: xp.where(a <= b, 1.0, 0.0),
        "EQ": lambda a, b: xp.where(a == b, 1.0, 0.0),
        "NE": lambda a, b: xp.where(a != b, 1.0, 0.0),
        "AND": lambda a, b: xp.where((a != 0) & (b != 0), 1.0, 0.0),
        "OR": lambda a, b: xp.where((a != 0) | (b != 0), 1.0, 0.0),
        "NOT": lambda a: xp.where(a == 0, 1.0, 0.0),
        "IF_ELSE_ZERO": lambda a, b: xp.where(a != 0, b, 0.0),
    }


def columns_of(names: Sequence[str], columns: Sequence[Any]) -> dict[str, Any]:
    """What statements read of their arguments, by the texts that they have for them."""
    return {f"{name}[{i}]": part[i] for name, part in zip(names, columns, strict=True) for i in range(part.shape[0])}
