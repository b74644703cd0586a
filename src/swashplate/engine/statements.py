"""A traced function as statements in the order in which they are evaluated: what C is printed from (`emit`).

CasADi (Andersson, Gillis, Horn, Rawlings and Diehl 2019) traces the equations and orders the operations. Statements are
split into what is fixed and what moves, and into searches for roots and what comes between them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from swashplate.engine.graph import Expression, Graph
from swashplate.errors import ExportError

Precision = Literal["double", "single"]
FIXED = "c"
ROOTS = ("guess[", "root[")
_MOVING = ("x[", *ROOTS)

BINARY = {"ADD": "+", "SUB": "-", "MUL": "*", "DIV": "/"}
COMPARED = {"LT": "<", "LE": "<=", "EQ": "==", "NE": "!=", "AND": "&&", "OR": "||"}
LIBRARY = {
    **{name.upper(): name for name in ("sqrt", "sin", "cos", "tan", "fabs", "atan2", "pow")},
    "CONSTPOW": "pow",  # by a constant
}
FORMS = {
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
"""How an operation is written, by CasADi's name of it."""


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


@dataclass(frozen=True)
class Statements:
    """A function in its order of evaluation, and what each of its outputs' nonzeros is: (output, place) to text."""

    body: tuple[Statement, ...]
    outputs: dict[tuple[int, int], str]


def _operations() -> dict[int, str]:
    import casadi

    names = {*BINARY, *COMPARED, *LIBRARY, *FORMS, "CONST", "INPUT", "OUTPUT"}
    return {getattr(casadi, f"OP_{name}"): name for name in names}


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
    body: list[Statement] = []
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
            body.append(Statement(f"t{i}", operation, tuple(now[r] for r in reads)))
            now[writes[0]] = f"t{i}"
    return Statements(tuple(_cheaper(body)), outputs)


def _cheaper(body: Sequence[Statement]) -> list[Statement]:
    """What several are divided by is divided by once, and a tangent is made of the sine and cosine that there are.

    A division takes four times what a product takes, a tangent a call more; results change in their last bit.
    """
    shared = {by for by, count in Counter(s.reads[1] for s in body if s.operation == "DIV").items() if count > 1}
    turned = {(s.operation, s.reads): s.name for s in body if s.operation in ("SIN", "COS")}
    later = {s.name: place for place, s in enumerate(body)}
    inverted: set[str] = set()
    cheaper: list[Statement] = []
    for place, s in enumerate(body):
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


def _places(sparsity: Expression) -> list[int]:
    """Where each nonzero of an output stands in the full matrix, row by row (a column vector: its row)."""
    rows, columns = sparsity.get_triplet()
    width = sparsity.size2()
    return [row * width + column for row, column in zip(rows, columns, strict=True)]


def split(code: Statements, *, moving: tuple[str, ...] = _MOVING, fixed: str = FIXED) -> tuple[Statements, Statements]:
    """What nothing `moving` moves, with what the rest needs of it as outputs, and the rest, which reads it as `c[i]`.

    What the rest divides by is inverted once, before.

    Args:
        code: what is split.
        moving: how the texts begin of what changes; the states where not given.
        fixed: the array through which the rest reads the first.
    """
    first: list[Statement] = []
    rest: list[Statement] = []
    dependent: set[str] = set()
    for s in code.body:
        if not any(name in dependent or name.startswith(moving) for name in s.reads):
            first.append(s)
            continue
        dependent.add(s.name)
        over, by = (s.reads[0], s.reads[-1])
        if s.operation == "DIV" and not (by in dependent or by.startswith(moving)):
            inverse = Statement(f"i_{s.name}", "INV", (by,))
            first.append(inverse)
            rest.append(Statement(s.name, "MUL", (over, inverse.name)))
        else:
            rest.append(s)
    computed = {s.name for s in first}
    asked = [*(name for s in rest for name in s.reads), *code.outputs.values()]
    kept = {name: f"{fixed}[{i}]" for i, name in enumerate(dict.fromkeys(name for name in asked if name in computed))}
    return (
        Statements(tuple(first), {(0, i): name for i, name in enumerate(kept)}),
        Statements(
            tuple(replace(s, reads=tuple(kept.get(name, name) for name in s.reads)) for s in rest),
            {place: kept.get(text, text) for place, text in code.outputs.items()},
        ),
    )


@dataclass(frozen=True)
class Search:
    """Roots that are sought in one loop, after those that they depend on.

    Attributes:
        before: statements that can be evaluated once the earlier searches have ended, in order.
        sought: numbers of the roots; none for what comes after the last search.
        inside: statements of the loop.
        start, value, slope: texts of each root sought: the first guess, the residual and its derivative.
    """

    before: tuple[Statement, ...]
    sought: tuple[int, ...]
    inside: tuple[Statement, ...]
    start: tuple[str, ...]
    value: tuple[str, ...]
    slope: tuple[str, ...]


def searches(code: Statements, count: int, *, first: int) -> list[Search]:
    """A function with `count` roots in the order of its searches; outputs `first` and the next two are the roots'."""
    start, value, slope = ([code.outputs[first + k, i] for i in range(count)] for k in range(3))
    needs = _needs(code.body, count)
    rounds = _rounds([*zip(start, value, slope, strict=True)], needs, count)

    def known_after(name: str) -> int:
        """How many rounds of loops come before a text can be evaluated."""
        roots, _ = needs.get(name, (frozenset(), frozenset()))
        return max((rounds[r] for r in roots), default=0)

    ordered = []
    for number in range(max(rounds, default=0) + 1):
        sought = tuple(i for i in range(count) if rounds[i] == number + 1)
        texts = (tuple(t[i] for i in sought) for t in (start, value, slope))
        before = tuple(s for s in code.body if not needs[s.name][1] and known_after(s.name) == number)
        ordered.append(Search(before, sought, tuple(s for s in code.body if needs[s.name][1] & set(sought)), *texts))
    return ordered


_Needs = dict[str, tuple[frozenset[int], frozenset[int]]]


def _needs(body: Sequence[Statement], count: int) -> _Needs:
    """Which roots and which guesses every statement depends on."""
    nothing: frozenset[int] = frozenset()
    known: _Needs = {f"root[{i}]": (frozenset({i}), nothing) for i in range(count)}
    known |= {f"guess[{i}]": (nothing, frozenset({i})) for i in range(count)}
    for s in body:
        of = [known.get(name, (nothing, nothing)) for name in s.reads]
        known[s.name] = (nothing.union(*(a for a, _ in of)), nothing.union(*(b for _, b in of)))
    return known


def _rounds(texts: Sequence[tuple[str, str, str]], needs: _Needs, count: int) -> list[int]:
    """The loop, from 1, in which each root is sought: after those that it depends on."""
    rounds: list[int] = []
    for i in range(count):
        before = frozenset().union(*(needs.get(text, (frozenset(), frozenset()))[0] for text in texts[i]))
        rounds.append(1 + max((rounds[r] for r in before), default=0))
    return rounds
