"""A traced function as statements of C99: one constant for each operation, stores at the end.

CasADi (Andersson, Gillis, Horn, Rawlings and Diehl 2019) traces the equations and orders the operations. Its own
printer wraps them in pointer tests and unused arguments that a strict compiler refuses, hence ours.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from typing import Literal

import numpy as np

from swashplate.engine.graph import Expression, Graph
from swashplate.errors import ExportError


@lru_cache(maxsize=16)
def _template(name: str) -> str:
    return resources.files("swashplate.engine").joinpath("templates", name).read_text(encoding="utf-8")


def filled(name: str, blanks: Mapping[str, object]) -> str:
    """A template with its blanks filled.

    Args:
        name: of the file.
        blanks: what stands for @WORD@, by word; @NAME.c@ and @NAME.h@ are templates themselves, with the same blanks.
    """

    def part(blank: re.Match[str]) -> str:
        inner = blank[1].endswith((".c", ".h"))
        return filled(blank[1], blanks).rstrip("\n") if inner else str(blanks[blank[1]])

    return re.sub(r"@([\w.]+)@", part, _template(name))


Precision = Literal["double", "single"]
REAL: dict[Precision, str] = {"double": "double", "single": "float"}

_KEYWORDS = frozenset({
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else",
    "enum", "extern", "float", "for", "goto", "if", "inline", "int", "long", "register",
    "restrict", "return", "short", "signed", "sizeof", "static", "struct", "switch", "typedef", "union",
    "unsigned", "void", "volatile", "while",
})  # fmt: skip


def words(text: str) -> str:
    """Text for a comment or a string of C: printable ASCII that starts and ends nothing.

    Quotes, backslashes, trigraphs and the marks of comments are what could, and are replaced.
    """
    plain = "".join(c if " " <= c <= "~" else " " if c.isspace() else "?" for c in text)
    plain = plain.replace("\\", "|").replace('"', "'")
    for mark in ("*/", "/*", "??", "//"):
        while mark in plain:
            plain = plain.replace(mark, " ".join(mark))
    return " ".join(plain.split())


def identifier(text: str) -> str:
    """A C identifier from a model's name: what is not a letter or a digit becomes `_`.

    Raises:
        ExportError: where nothing is left of it.
    """
    made = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_")
    if not made:
        raise ExportError(f"'{text}' gives no name that C could use.", channel="--name", hint="Give --name heli.")
    return f"model_{made}" if made[0].isdigit() or made in _KEYWORDS else made


def literal(value: float, precision: Precision) -> str:
    """A number as C reads it back to the last bit of its precision.

    Raises:
        ExportError: for a number that is none, or too large for single precision.
    """
    with np.errstate(over="ignore"):
        rounded = float(value) if precision == "double" else np.float32(value)
    if not np.isfinite(rounded):
        raise ExportError(f"a number of the model is {value}: no {precision} in C.", hint="Check the card.")
    text = str(rounded)
    text = text if any(c in text for c in ".e") else f"{text}.0"
    return text if precision == "double" else f"{text}f"


def array(name: str, values: Iterable[float], precision: Precision, *, kind: str) -> str:
    """The definition of a constant array; an empty one gets one zero, since C has no empty arrays."""
    numbers = [literal(value, precision) for value in values] or ["0"]
    lines = [", ".join(numbers[i : i + 6]) for i in range(0, len(numbers), 6)]
    return f"const {kind} {name}[{len(numbers)}] = {{\n  " + ",\n  ".join(lines) + "\n};\n"


FIXED = "c"
ROOTS = ("guess[", "root[")
_MOVING = ("x[", *ROOTS)


def split(code: Statements, *, moving: tuple[str, ...] = _MOVING, fixed: str = FIXED) -> tuple[Statements, Statements]:
    """What nothing `moving` moves, with what the rest needs of it as outputs, and the rest, which reads it as `c[i]`.

    What the rest divides by is inverted once, before.

    Args:
        found: what is split.
        moving: how the texts begin of what changes; the states where not given.
        fixed: the array through which the rest reads the first.
    """
    first: list[Statement] = []
    rest: list[Statement] = []
    moved: set[str] = set()
    for s in code.body:
        if not any(name in moved or name.startswith(moving) for name in s.reads):
            first.append(s)
            continue
        moved.add(s.name)
        over, by = (s.reads[0], s.reads[-1])
        if s.operation == "DIV" and not (by in moved or by.startswith(moving)):
            inverse = Statement(f"i_{s.name}", "INV", (by,))
            first.append(inverse)
            rest.append(Statement(s.name, "MUL", (over, inverse.name)))
        else:
            rest.append(s)
    made = {s.name for s in first}
    asked = [*(name for s in rest for name in s.reads), *code.outputs.values()]
    kept = {name: f"{fixed}[{i}]" for i, name in enumerate(dict.fromkeys(name for name in asked if name in made))}
    return (
        Statements(tuple(first), {(0, i): name for i, name in enumerate(kept)}),
        Statements(
            tuple(Statement(s.name, s.operation, _renamed(s.reads, kept)) for s in rest),
            {place: kept.get(text, text) for place, text in code.outputs.items()},
        ),
    )


def _renamed(reads: Sequence[str], kept: dict[str, str]) -> tuple[str, ...]:
    return tuple(kept.get(name, name) for name in reads)


_BINARY = {"ADD": "+", "SUB": "-", "MUL": "*", "DIV": "/"}
_COMPARED = {"LT": "<", "LE": "<=", "EQ": "==", "NE": "!=", "AND": "&&", "OR": "||"}
_LIBRARY = {
    **{name.upper(): name for name in ("sqrt", "sin", "cos", "tan", "fabs", "atan2", "pow")},
    "CONSTPOW": "pow",  # by a constant
}
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


@dataclass(frozen=True)
class Statement:
    """One operation.

    Attributes:
        name: of the constant that it makes.
        operation: as in the tables above.
        reads: names of constants, or texts of inputs and numbers.
    """

    name: str
    operation: str
    reads: tuple[str, ...]

    def text(self, real: str, precision: Precision) -> str:
        return f"const {real} {self.name} = {_text(self.operation, self.reads, precision)};"


@dataclass(frozen=True)
class Statements:
    """A function in its order of evaluation, and what each of its outputs' nonzeros is: (output, place) to text."""

    body: tuple[Statement, ...]
    outputs: dict[tuple[int, int], str]


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


def statements(function: Graph, *, precision: Precision, inputs: Sequence[str]) -> Statements:
    """A CasADi function, traced on SX, as statements.

    Args:
        function: sparse outputs have entries for their nonzeros only.
        precision: of constants.
        inputs: names of the arrays it reads, in order.

    Raises:
        ExportError: for an operation that the equations of this package do not use.
    """
    known = _operations()
    now: dict[int, str] = {}
    made: list[Statement] = []
    places = [_places(function.sparsity_out(i)) for i in range(function.n_out())]
    outputs: dict[tuple[int, int], str] = {}
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
            outputs[writes[0], places[writes[0]][writes[1]]] = now[reads[0]]
        else:
            made.append(Statement(f"t{i}", operation, tuple(now[r] for r in reads)))
            now[writes[0]] = f"t{i}"
    return Statements(tuple(_cheaper(made)), outputs)


def _cheaper(made: Sequence[Statement]) -> list[Statement]:
    """What several are divided by is divided by once, and a tangent is made of the sine and cosine that there are.

    A division takes four times what a product takes, a tangent a call more; results change in their last bit.
    """
    shared = {by for by, count in Counter(s.reads[1] for s in made if s.operation == "DIV").items() if count > 1}
    turned = {(s.operation, s.reads): s.name for s in made if s.operation in ("SIN", "COS")}
    later = {s.name: place for place, s in enumerate(made)}
    inverted: set[str] = set()
    cheaper: list[Statement] = []
    for place, s in enumerate(made):
        if s.operation == "DIV" and s.reads[1] in shared:
            by = s.reads[1]
            inverse = "i_" + "".join(c if c.isalnum() else "_" for c in by)
            if by not in inverted:
                inverted.add(by)
                cheaper.append(Statement(inverse, "INV", (by,)))
            cheaper.append(Statement(s.name, "MUL", (s.reads[0], inverse)))
        elif s.operation == "TAN" and all(
            (k, s.reads) in turned and later[turned[k, s.reads]] < place for k in ("SIN", "COS")
        ):
            cheaper.append(Statement(s.name, "DIV", (turned["SIN", s.reads], turned["COS", s.reads])))
        else:
            cheaper.append(s)
    return cheaper


def body(function: Graph, *, real: str, precision: Precision, inputs: Sequence[str], outputs: Sequence[str]) -> str:
    """Statements in C that compute a CasADi function.

    Args:
        function: traced on SX; sparse outputs store their nonzeros only.
        real: the type's name.
        precision: of constants and of the C library's functions.
        inputs: names of the arrays it reads, in order.
        outputs: names of the arrays it writes. They may be those it reads: all stores come last.

    Raises:
        ExportError: as `statements`.
    """
    return printed(statements(function, precision=precision, inputs=inputs), real, precision, outputs)


def printed(code: Statements, real: str, precision: Precision, outputs: Sequence[str]) -> str:
    """Statements in C, then stores of the outputs into arrays of these names."""
    lines = [f"  {s.text(real, precision)}" for s in code.body]
    stores = [f"  {outputs[o]}[{place}] = {text};" for (o, place), text in code.outputs.items()]
    return "\n".join([*lines, *stores]) + "\n"


def _places(sparsity: Expression) -> list[int]:
    """Where each nonzero of an output stands in the full matrix, row by row (a column vector: its row)."""
    rows, columns = sparsity.get_triplet()
    width = sparsity.size2()
    return [row * width + column for row, column in zip(rows, columns, strict=True)]
