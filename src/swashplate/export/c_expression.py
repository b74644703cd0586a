"""A traced function as statements of C99: one constant for each operation, stores at the end.

CasADi (Andersson, Gillis, Horn, Rawlings and Diehl 2019) traces the equations and orders the operations. Its own
printer wraps them in pointer tests and unused arguments that a strict compiler refuses, hence ours.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from swashplate.errors import ExportError
from swashplate.export.c_text import Precision, literal

_BINARY = {"ADD": "+", "SUB": "-", "MUL": "*", "DIV": "/"}
_COMPARED = {"LT": "<", "LE": "<=", "EQ": "==", "NE": "!=", "AND": "&&", "OR": "||"}
_LIBRARY = {"SQRT": "sqrt", "SIN": "sin", "COS": "cos", "TAN": "tan", "FABS": "fabs", "ATAN2": "atan2"}
_OWN = {
    "NEG": "-{0}",
    "SQ": "{0} * {0}",
    "TWICE": "{0} + {0}",
    "INV": "1 / {0}",
    "FMIN": "{0} < {1} ? {0} : {1}",
    "FMAX": "{0} > {1} ? {0} : {1}",
    "NOT": "{0} == 0",
    "IF_ELSE_ZERO": "{0} != 0 ? {1} : 0",
    "SIGN": "{0} > 0 ? 1 : {0} < 0 ? -1 : 0",
    "ASSIGN": "{0}",
}


def _operations() -> dict[int, str]:
    import casadi

    names = {*_BINARY, *_COMPARED, *_LIBRARY, *_OWN, "CONST", "INPUT", "OUTPUT"}
    return {getattr(casadi, f"OP_{name}"): name for name in names}


def _text(operation: str, of: Sequence[str], precision: Precision) -> str:
    if operation in _BINARY:
        return f"{of[0]} {_BINARY[operation]} {of[1]}"
    if operation in _COMPARED:
        return f"{of[0]} {_COMPARED[operation]} {of[1]} ? 1 : 0"
    if operation in _LIBRARY:
        return f"{_LIBRARY[operation]}{'f' if precision == 'single' else ''}({', '.join(of)})"
    return _OWN[operation].format(*of)


def body(function: Any, *, real: str, precision: Precision, inputs: Sequence[str], outputs: Sequence[str]) -> str:
    """Statements that compute a CasADi function.

    Args:
        function: traced on SX; sparse outputs store their nonzeros only.
        real: the type's name.
        precision: of constants and of the C library's functions.
        inputs: names of the arrays it reads, in order.
        outputs: names of the arrays it writes. They may be those it reads: all stores come last.

    Raises:
        ExportError: for an operation that the equations of this package do not use.
    """
    known = _operations()
    now: dict[int, str] = {}
    lines: list[str] = []
    places = [_places(function.sparsity_out(i)) for i in range(function.n_out())]
    stores: list[str] = []
    for i in range(function.n_instructions()):
        operation = known.get(function.instruction_id(i))
        if operation is None:
            raise ExportError(
                f"the equations use an operation (number {function.instruction_id(i)}) that is not printed as C."
            )
        reads, writes = function.instruction_input(i), function.instruction_output(i)
        if operation == "INPUT":
            now[writes[0]] = f"{inputs[reads[0]]}[{reads[1]}]"
        elif operation == "CONST":
            text = literal(function.instruction_constant(i), precision)
            now[writes[0]] = f"({text})" if text.startswith("-") else text
        elif operation == "OUTPUT":
            stores.append(f"  {outputs[writes[0]]}[{places[writes[0]][writes[1]]}] = {now[reads[0]]};")
        else:
            lines.append(f"  const {real} t{i} = {_text(operation, [now[r] for r in reads], precision)};")
            now[writes[0]] = f"t{i}"
    return "\n".join([*lines, *stores]) + "\n"


def _places(sparsity: Any) -> list[int]:
    """Where each nonzero of an output stands in the full matrix, row by row (a column vector: its row)."""
    rows, columns = sparsity.get_triplet()
    width = sparsity.size2()
    return [row * width + column for row, column in zip(rows, columns, strict=True)]
