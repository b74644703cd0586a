"""Equations of motion in C for a step of several stages: what no state moves is computed once for all of them.

Products of a card's numbers, sines of its angles and what the held inputs alone decide are the same in the four stages
of a Runge-Kutta step, and CasADi, which sees one evaluation at a time, cannot know. A root is sought from where the
stage before found it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from swashplate.engine.c_expression import printed, statements
from swashplate.engine.c_loops import looped
from swashplate.engine.c_split import FIXED, split
from swashplate.engine.c_text import Precision

if TYPE_CHECKING:
    from swashplate.export.traced import Traced


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
        code = statements(model.looped.function, precision=precision, inputs=[*given, "guess", "root"])
        first, rest = split(code)
        moving = looped(rest, model.looped.steps, real=real, precision=precision, outputs=["rates"])
    count = 0 if model.looped is None else len(model.looped.steps)
    return Stages(printed(first, real, precision, [FIXED]), moving, len(first.outputs), count)
