"""Equations of motion in C for a step of several stages: what no state moves is computed once for all of them.

Products of a card's numbers, sines of its angles and what the held inputs alone decide are the same in the four stages
of a Runge-Kutta step, and CasADi, which sees one evaluation at a time, cannot know. A root is sought from where the
stage before found it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from swashplate.export.c_expression import Statement, Statements, printed, statements
from swashplate.export.c_loops import looped
from swashplate.export.c_text import Precision

if TYPE_CHECKING:
    from swashplate.export.traced import Traced

_FIXED = "c"
ROOTS = ("guess[", "root[")
_MOVING = ("x[", *ROOTS)


@dataclass(frozen=True)
class Stages:
    """The rates of a model as the bodies of two C functions.

    Attributes:
        fixed: reads u, s and p, and writes the array c of `constants` numbers.
        moving: reads x, u, s, p and c, and writes `rates`; it reads and writes the array root of `roots` numbers, which
            are guesses where `known` is not zero.
    """

    fixed: str
    moving: str
    constants: int
    roots: int


def stages(model: Traced, *, real: str, precision: Precision) -> Stages:
    """Print the rates of a traced model.

    Raises:
        ExportError: as `c_expression.statements`.
    """
    given = ("x", "u", "s", "p")
    if model.looped is None:
        first, rest = split(statements(model.rates, precision=precision, inputs=given))
        moving = printed(rest, real, precision, ["rates"])
    else:
        found = statements(model.looped.function, precision=precision, inputs=[*given, "guess", "root"])
        first, rest = split(found)
        moving = looped(rest, model.looped.steps, real=real, precision=precision, outputs=["rates"])
    count = 0 if model.looped is None else len(model.looped.steps)
    return Stages(printed(first, real, precision, [_FIXED]), moving, len(first.outputs), count)


def split(
    found: Statements, *, moving: tuple[str, ...] = _MOVING, fixed: str = _FIXED
) -> tuple[Statements, Statements]:
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
    for s in found.body:
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
    asked = [*(name for s in rest for name in s.reads), *found.outputs.values()]
    kept = {name: f"{fixed}[{i}]" for i, name in enumerate(dict.fromkeys(name for name in asked if name in made))}
    return (
        Statements(tuple(first), {(0, i): name for i, name in enumerate(kept)}),
        Statements(
            tuple(Statement(s.name, s.operation, _renamed(s.reads, kept)) for s in rest),
            {place: kept.get(text, text) for place, text in found.outputs.items()},
        ),
    )


def _renamed(reads: Sequence[str], kept: dict[str, str]) -> tuple[str, ...]:
    return tuple(kept.get(name, name) for name in reads)
