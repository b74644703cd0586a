"""A controller as C: the very step that Python runs, traced by CasADi into one file without allocation.

CasADi (Andersson, Gillis, Horn, Rawlings and Diehl 2019) traces the scalar step and prints it; of the C library only
sin, cos, sqrt and atan2 are called. Needs the extra `model`.
"""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from swashplate.atomic import write_text
from swashplate.control.kinds import kind_of
from swashplate.engine.emit import comment_text, fill_template, print_array
from swashplate.engine.graph import Graph
from swashplate.engine.law import REFERENCES, print_function
from swashplate.export.origin import digest, program_and_commit
from swashplate.extras import library
from swashplate.simulation.controller import Controller

Precision = Literal["double", "float"]


@dataclass(frozen=True)
class ControllerCode:
    """C source of a controller.

    Attributes:
        source: the text of the .c file; it defines `void swash_step(real memory[], const real measured[], const real
            reference[8], real command[])` and `swash_memory`, what the memory starts with.
        operations: arithmetic operations and calls of one step; nothing branches, so it is also the most.
        calls: calls of the C library by name, as they stand in the text.
        work_bytes: of temporary numbers.
        memory_bytes: between steps.
        precision: "double" or "float".
    """

    source: str
    operations: int
    calls: dict[str, int]
    work_bytes: int
    memory_bytes: int
    precision: Precision

    def save(self, path: str | Path) -> None:
        """Write the .c file."""
        write_text(path, self.source)


def controller_code(controller: Controller, *, precision: Precision = "double") -> ControllerCode:
    """The C source of one step of a controller, with its numbers as constants.

    Args:
        controller: what to print.
        precision: of every number in it.

    Raises:
        ControllerError: where this kind of controller has no C.
        MissingLibraryError: where CasADi is not installed.
    """
    library("casadi", what="C code")
    traced = kind_of(controller).traced(controller)
    function = traced.function
    printed, calls = print_function(function, precision)
    size = 8 if precision == "double" else 4
    memory, measured, commands = len(traced.start), len(traced.measured), len(traced.commands)
    work = int(function.sz_w())
    blanks = {
        "RATE": f"{controller.rate:g}",
        "REAL": precision,
        "MADE": f"by {program_and_commit()}; controller {digest(printed + repr(traced.start))}",
        "VEHICLE": comment_text(traced.about),
        "LATE": _late(controller),
        "MEASURED_NAMES": "\n *            ".join(textwrap.wrap(", ".join(traced.measured), 100)),
        "REFERENCE_NAMES": ", ".join(REFERENCES),
        "COMMAND_NAMES": ", ".join(traced.commands),
        "MEMORY_NAMES": traced.memory,
        "MEMORY": memory,
        "MEASURED": measured,
        "COMMANDS": commands,
        "AFTER": memory + commands,
        "WORK": memory + commands + max(work, 1),
        "WHOLES": max(int(function.sz_iw()), 1),
        "ARGUMENTS": max(int(function.sz_arg()), 3),
        "RESULTS": max(int(function.sz_res()), 1),
        "TRACED": printed,
        "START": print_array(
            "swash_memory", traced.start, "double" if precision == "double" else "single", kind=precision
        ),
    }
    return ControllerCode(
        source=fill_template("controller.c", blanks),
        operations=operations_of(function),
        calls=calls,
        work_bytes=work * size,
        memory_bytes=memory * size,
        precision=precision,
    )


def operations_of(function: Graph) -> int:
    """Instructions of the trace but reading inputs, writing outputs and constants; loops count by their rounds."""
    import casadi

    copied = {casadi.OP_INPUT, casadi.OP_OUTPUT, casadi.OP_CONST}
    scalar = function.expand()
    return sum(scalar.instruction_id(i) not in copied for i in range(scalar.n_instructions()))


def _late(controller: Controller) -> str:
    """From reading to action, as it was designed for."""
    waits = ", ".join(f"{n} {1e3 * d:g} ms" for n, d in controller.delays.items() if d)
    return f"{waits}, computation included" if waits else "designed for commands that act at once"
