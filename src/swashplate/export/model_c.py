"""A model as self-contained C99: equations, their Jacobians, one Runge-Kutta step, and a header that explains them.

Equations of motion in C for a step of several stages: what no state moves is computed once for all of them.

Products of a card's numbers, sines of its angles and what the held inputs alone decide are the same in the four stages
of a Runge-Kutta step, and CasADi, which sees one evaluation at a time, cannot know. A root is sought from where the
stage before found it.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

from swashplate.engine.emit import (
    REAL,
    comment_text,
    fill_template,
    print_array,
    print_graph,
    print_searches,
    print_statements,
)
from swashplate.engine.statements import FIXED, Precision, split, statements
from swashplate.export.traced import Traced, Variable, late_notes


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
        ExportError: as `statements`.
    """
    given = ("x", "u", "s", "p")
    if model.looped is None:
        first, rest = split(statements(model.rates, precision=precision, inputs=given))
        moving = print_statements(rest, real, precision, ["rates"])
    else:
        code = statements(model.looped.function, precision=precision, inputs=[*given, "guess", "root"])
        first, rest = split(code)
        moving = print_searches(rest, model.looped.steps, real=real, precision=precision, outputs=["rates"])
    count = 0 if model.looped is None else len(model.looped.steps)
    return Stages(print_statements(first, real, precision, [FIXED]), moving, len(first.outputs), count)


_KINDS = ("state", "input", "surrounding", "parameter", "output")


@dataclass(frozen=True)
class ModelCode:
    """C source of a model.

    Attributes:
        name: what every name in it begins with.
        precision: of every number.
        header, source: the texts of NAME.h and NAME.c.
        example: a program that flies it for ten seconds, NAME_example.c.
    """

    name: str
    precision: Precision
    header: str
    source: str
    example: str

    def files(self) -> dict[str, str]:
        """Texts by file name."""
        return {
            f"{self.name}.h": self.header,
            f"{self.name}.c": self.source,
            f"{self.name}_example.c": self.example,
        }


def model_code(model: Traced, *, precision: Precision = "double") -> ModelCode:
    """C of a traced model.

    Args:
        model: what to print.
        precision: "double", or "single" for processors without double precision.
    """
    blanks = _blanks(model, precision)
    equations = {**_equations(model, precision), **_functions(model, precision), "ARRAYS": _arrays(model, precision)}
    return ModelCode(
        model.name,
        precision,
        fill_template(
            "model.h", blanks | {"GUARD": f"{model.name.upper()}_H", "ENUMS": _enums(model), "HEADING": _heading(model)}
        ),
        fill_template("model.c", blanks | equations),
        fill_template("model_example.c", blanks | {"SHOWN": min(len(model.states), 12)}),
    )


def frame_code(model: Traced, told: object) -> str:
    """C of NAME_frame alone, in double precision: some steps and what is told of where they lead, without any header.

    Args:
        model: what to print; its Jacobians are not needed.
        told: a CasADi function of states, rates and gravity.
    """
    names = ("x", "rates", "g")
    text = print_graph(told, real=f"{model.name}_real", precision="double", inputs=names, outputs=["told"])
    return fill_template(
        "model_frame.c", _blanks(model, "double") | _equations(model, "double") | {"TOLD": _used(text, names)}
    )


def _blanks(model: Traced, precision: Precision) -> dict[str, str]:
    return {
        "NAME": model.name,
        "REAL": f"{model.name}_real",
        "TYPE": REAL[precision],
        **{f"N_{kind.upper()}S": str(len(variables)) for kind, variables in _variables(model).items()},
    }


def _variables(model: Traced) -> dict[str, tuple[Variable, ...]]:
    return {kind: getattr(model, f"{kind}s") for kind in _KINDS}


_GIVEN = ("x", "u", "s", "p")


def _used(text: str, names: Sequence[str]) -> str:
    """With a nod to what it does not read: strict compilers ask for it."""
    return text + "".join(f"  (void){name};\n" for name in names if not re.search(rf"\b{name}\b", text))


def _equations(model: Traced, precision: Precision) -> dict[str, str]:
    """The bodies of `fixed` and `moving`."""
    staged = stages(model, real=f"{model.name}_real", precision=precision)
    return {
        "FIXED": _used(staged.fixed, (*_GIVEN[1:], "c")),
        "MOVING": _used(staged.moving, (*_GIVEN, "c", "root", "known")),
        "N_CONSTANTS": str(max(1, staged.constants)),
        "N_ROOTS": str(max(1, staged.roots)),
    }


def _functions(model: Traced, precision: Precision) -> dict[str, str]:
    """The bodies of what is one evaluation of its own."""

    def single(function: object, outputs: Sequence[str]) -> str:
        text = print_graph(function, real=f"{model.name}_real", precision=precision, inputs=_GIVEN, outputs=outputs)
        return _used(text, _GIVEN)

    return {"OUTPUTS": single(model.readings, ["outputs"]), "JACOBIANS": single(model.jacobians, ["A", "B"])}


def _enums(model: Traced) -> str:
    enums = []
    for kind, variables in _variables(model).items():
        if not variables:
            continue
        lines = []
        for place, v in enumerate(variables):
            limits = f", {v.limits[0]:.6g} to {v.limits[1]:.6g}" if v.limits else ""
            meaning = comment_text(f"[{v.unit or '?'}{limits}] {v.meaning}")
            lines.append(f"  {model.name}_{kind}_{v.name}{' = 0' if place == 0 else ''}, /* {meaning} */")
        enums.append(f"enum {model.name}_{kind} {{\n" + "\n".join(lines).replace(", /*", ", /*") + "\n};")
    return "\n\n".join(_without_last_comma(text) for text in enums)


def _without_last_comma(enum: str) -> str:
    """C90 compilers, which some autopilots' makefiles ask for, refuse a comma before the closing brace."""
    head, _, tail = enum.rpartition(", /*")
    return f"{head} /*{tail}"


def _arrays(model: Traced, precision: Precision) -> str:
    real = f"{model.name}_real"
    parts = (("states", "start_x"), ("inputs", "start_u"), ("surroundings", "start_s"), ("parameters", "start_p"))
    return "\n".join(
        print_array(f"{model.name}_{name}", [v.start for v in getattr(model, kind)], precision, kind=real)
        for kind, name in parts
    )


def _heading(model: Traced) -> str:
    lines = [
        comment_text(f"{model.name}: {model.title}"),
        comment_text(f"Trust: {model.trust}") if model.trust else "",
        comment_text(f"Starts: {model.about}"),
        *(comment_text(line) for line in model.origin),
        *(comment_text(note) for note in late_notes(model)),
        "",
        "Written by swashplate from the equations that it simulates with. SI units, radians; body axes",
        "forward-right-down, local axes north-east-down. No allocation, no static variables that change.",
    ]
    wrapped = (part for line in lines for part in (textwrap.wrap(line, 112) or [""]))
    return "/*\n" + "".join(f" * {part}".rstrip() + "\n" for part in wrapped) + " */"
