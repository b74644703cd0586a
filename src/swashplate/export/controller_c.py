"""A controller as C: the very step that Python runs, traced by CasADi into one file without allocation.

CasADi (Andersson, Gillis, Horn, Rawlings and Diehl 2019) traces the scalar step and prints it; of the C library only
sin, cos, sqrt and atan2 are called. Needs the extra `export`.
"""

from __future__ import annotations

import re
import tempfile
import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from swashplate.atomic import write_text
from swashplate.control.autopilot import Autopilot, Memory, Reference, step
from swashplate.control.height_yaw import HeightYawMemory
from swashplate.control.lqg import Lqg
from swashplate.errors import ControllerError
from swashplate.export.lqg_c import lqg_function, measured_names
from swashplate.physics.backend import CasadiBackend
from swashplate.physics.rigid_body import RigidBody
from swashplate.vehicles.coax import CoaxInputs

Precision = Literal["double", "float"]

_OWN = {"fmax(x, y)": "x > y ? x : y", "fmin(x, y)": "x < y ? x : y", "fabs(x)": "x > 0 ? x : -x"}
"""What CasADi takes from the C library, written out."""


@dataclass(frozen=True)
class _Traced:
    """A step as a CasADi function of (memory, measured, reference) to (memory, command), and what its rows hold."""

    function: Any
    start: tuple[float, ...]
    memory: str
    measured: tuple[str, ...]
    commands: tuple[str, ...]
    about: str


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


def controller_code(controller: Autopilot | Lqg, *, precision: Precision = "double") -> ControllerCode:
    """The C source of one step of a controller, with its numbers as constants.

    Args:
        controller: what to print.
        precision: of every number in it.

    Raises:
        ControllerError: where CasADi is not installed.
    """
    try:
        import casadi
    except ImportError:
        raise ControllerError(
            "needs CasADi.", channel="C code", hint="Install swashplate with the extra 'export'."
        ) from None
    traced = _lqg(controller) if isinstance(controller, Lqg) else _autopilot(controller)
    function = traced.function
    with tempfile.TemporaryDirectory() as folder:
        made = casadi.CodeGenerator("controller.c", {"casadi_real": precision, "casadi_int": "int"})
        made.add(function)
        printed = Path(made.generate(folder + "/")).read_text(encoding="utf-8")
    calls = {name: len(re.findall(rf"(?<![\w]){name}\(", printed)) for name in ("sin", "cos", "sqrt", "atan2")}
    for name, own in _OWN.items():
        printed = printed.replace(f"return {name};", f"return {own};")
    if precision == "float":  # no constant and no function may lift the arithmetic to double
        printed = re.sub(r"(?<![\w.])(\d+\.\d*(?:e[+-]?\d+)?)(?![\w.])", r"\1f", printed)
        printed = re.sub(r"(?<![\w])(sin|cos|sqrt|atan2)\(", r"\1f(", printed)
    size = 8 if precision == "double" else 4
    return ControllerCode(
        source=_heading(controller, traced, precision) + printed + _ending(traced, precision),
        operations=_operations(function),
        calls={name: count for name, count in calls.items() if count},
        work_bytes=int(function.sz_w()) * size,
        memory_bytes=len(traced.start) * size,
        precision=precision,
    )


def _autopilot(controller: Autopilot) -> _Traced:
    import casadi

    names = ("height", "heading", "spool", "ahead", "right")
    memory, measured, reference = (
        casadi.SX.sym(name, n)
        for name, n in (("memory", len(names)), ("measured", len(RigidBody._fields) + 1), ("reference", 8))
    )
    carried = Memory(HeightYawMemory(memory[0], memory[1], memory[2]), memory[3], memory[4])
    body = RigidBody(*(measured[i] for i in range(len(RigidBody._fields))))
    wanted = Reference(*(reference[i] for i in range(len(Reference._fields))))
    after, command = step(carried, body, measured[len(body)], wanted, controller.numbers, CasadiBackend())
    results = casadi.vertcat(*after.motors, after.ahead, after.right, *command)
    return _Traced(
        casadi.Function("swash_traced", [memory, measured, reference], [results]),
        tuple(controller.memory.tolist()),
        ", ".join(names),
        (*RigidBody._fields, "voltage"),
        CoaxInputs._fields,
        f"{controller.vehicle}, mode {controller.mode}, designed on: {controller.model}",
    )


def _lqg(controller: Lqg) -> _Traced:
    vehicle = controller.vehicle
    return _Traced(
        lqg_function(controller),
        tuple(controller.inner_memory.tolist()),
        "estimates, their covariance, commands given, counts, integrals and speeds",
        measured_names(controller),
        vehicle.input_names,
        f"{vehicle.name}, LQG, designed on: {vehicle.card.title}",
    )


def _operations(function: Any) -> int:
    """Instructions of the trace but reading inputs, writing outputs and constants; loops count by their rounds."""
    import casadi

    moved = {casadi.OP_INPUT, casadi.OP_OUTPUT, casadi.OP_CONST}
    scalar = function.expand()
    return sum(scalar.instruction_id(i) not in moved for i in range(scalar.n_instructions()))


def _heading(controller: Autopilot | Lqg, traced: _Traced, precision: Precision) -> str:
    counts = len(traced.start), len(traced.measured), len(traced.commands)
    lines = textwrap.wrap(", ".join(traced.measured), 100)
    return f"""/* One step of a swashplate controller, to be called at {controller.rate:g} Hz.
 *
 *   void swash_step({precision} memory[{counts[0]}], const {precision} measured[{counts[1]}],
 *                   const {precision} reference[8], {precision} command[{counts[2]}]);
 *
 * vehicle    {traced.about.replace("*/", "* /")}
 * measured   {f"{chr(10)} *            ".join(lines)}
 *            [SI, radians, forward-right-down and north-east-down]
 * reference  {", ".join(Reference._fields)}
 * command    {", ".join(traced.commands)}
 * memory     {traced.memory}; starts as swash_memory says
 *
 * swash_step keeps its temporaries in a static array: one caller at a time. swash_step_in takes them from its
 * caller, {precision} work[SWASH_WORK], which need not survive between steps; with a memory and a work of its own
 * each caller may interrupt every other.
 */
#define SWASH_WORK {counts[0] + counts[2] + max(int(traced.function.sz_w()), 1)}
"""


def _ending(traced: _Traced, precision: Precision) -> str:
    f, n, m = traced.function, len(traced.start), len(traced.commands)
    suffix = "f" if precision == "float" else ""
    # Dots keep them floating numbers; 17 digits bring a double back as it was.
    start = ",\n  ".join(f"{value!r}{suffix}" for value in traced.start)
    whole = int(f.sz_iw())
    return f"""
const {precision} swash_memory[{n}] = {{
  {start}
}};

void swash_step_in({precision} memory[{n}], const {precision} measured[{len(traced.measured)}],
                   const {precision} reference[8], {precision} command[{m}], {precision} work[SWASH_WORK]) {{
  int iw[{max(whole, 1)}];
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
