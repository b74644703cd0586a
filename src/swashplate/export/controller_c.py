"""A controller as C: the very step that Python runs, traced by CasADi into one file without allocation.

CasADi (Andersson, Gillis, Horn, Rawlings and Diehl 2019) traces the scalar step and prints it; of the C library only
sin, cos, sqrt and atan2 are called. Needs the extra `model`.
"""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from swashplate.atomic import write_text
from swashplate.control.kinds import TracedStep, kind_of
from swashplate.engine.law import REFERENCES, print_function
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
    return ControllerCode(
        source=_heading(controller, traced, precision) + printed + _ending(traced, precision),
        operations=operations_of(function),
        calls=calls,
        work_bytes=int(function.sz_w()) * size,
        memory_bytes=len(traced.start) * size,
        precision=precision,
    )


def operations_of(function: Any) -> int:
    """Instructions of the trace but reading inputs, writing outputs and constants; loops count by their rounds."""
    import casadi

    copied = {casadi.OP_INPUT, casadi.OP_OUTPUT, casadi.OP_CONST}
    scalar = function.expand()
    return sum(scalar.instruction_id(i) not in copied for i in range(scalar.n_instructions()))


def _heading(controller: Controller, traced: TracedStep, precision: Precision) -> str:
    counts = len(traced.start), len(traced.measured), len(traced.commands)
    lines = textwrap.wrap(", ".join(traced.measured), 100)
    return f"""/* One step of a swashplate controller, to be called at {controller.rate:g} Hz.
 *
 *   void swash_step({precision} memory[{counts[0]}], const {precision} measured[{counts[1]}],
 *                   const {precision} reference[8], {precision} command[{counts[2]}]);
 *
 * vehicle    {traced.about.replace("*/", "* /")}
 * late       {_late(controller)}
 * measured   {f"{chr(10)} *            ".join(lines)}
 *            [SI, radians, forward-right-down and north-east-down]
 * reference  {", ".join(REFERENCES)}
 * command    {", ".join(traced.commands)}
 * memory     {traced.memory}; starts as swash_memory says
 *
 * swash_step keeps its temporaries in a static array: one caller at a time. swash_step_in takes them from its
 * caller, {precision} work[SWASH_WORK], which need not survive between steps; with a memory and a work of its own
 * each caller may interrupt every other.
 */
#define SWASH_WORK {counts[0] + counts[2] + max(int(traced.function.sz_w()), 1)}
"""


def _late(controller: Controller) -> str:
    """From reading to action, as it was designed for."""
    waits = ", ".join(f"{n} {1e3 * d:g} ms" for n, d in controller.delays.items() if d)
    return f"{waits}, computation included" if waits else "designed for commands that act at once"


def _ending(traced: TracedStep, precision: Precision) -> str:
    f, n, m = traced.function, len(traced.start), len(traced.commands)
    suffix = "f" if precision == "float" else ""
    # Dots keep them floating numbers; 17 digits bring a double back as it was.
    start = ",\n  ".join(f"{value!r}{suffix}" for value in traced.start)
    integers = int(f.sz_iw())
    return f"""
const {precision} swash_memory[{n}] = {{
  {start}
}};

void swash_step_in({precision} memory[{n}], const {precision} measured[{len(traced.measured)}],
                   const {precision} reference[8], {precision} command[{m}], {precision} work[SWASH_WORK]) {{
  int iw[{max(integers, 1)}];
  const {precision} *arg[{max(int(f.sz_arg()), 3)}];
  {precision} *res[{max(int(f.sz_res()), 1)}];
  int i;
  arg[0] = memory;
  arg[1] = measured;
  arg[2] = reference;
  res[0] = work;
  swash_traced(arg, res, iw, work + {n + m}, 0);
  for (i = 0; i < {n}; ++i) memory[i] = work[i];
  for (i = 0; i < {m}; ++i) command[i] = work[{n} + i];
}}

void swash_step({precision} memory[{n}], const {precision} measured[{len(traced.measured)}],
                const {precision} reference[8], {precision} command[{m}]) {{
  static {precision} work[SWASH_WORK];
  swash_step_in(memory, measured, reference, command, work);
}}
"""
