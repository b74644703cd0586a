"""A function in two: what does not change from one evaluation to the next, and the rest, which reads it."""

from __future__ import annotations

from collections.abc import Sequence

from swashplate.engine.c_expression import Statement, Statements

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
