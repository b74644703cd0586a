"""A controller as C: the very step that Python runs, traced by CasADi into one file without allocation or loops.

CasADi (Andersson, Gillis, Horn, Rawlings and Diehl 2019) traces the scalar step and prints it; of the C library only
sin, cos, sqrt and atan2 are called. Needs the extra `export`.
"""

from __future__ import annotations

import re
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from swashplate.atomic import write_text
from swashplate.control.autopilot import Autopilot, Memory, Reference, step
from swashplate.control.height_yaw import HeightYawMemory
from swashplate.errors import ControllerError
from swashplate.physics.backend import CasadiBackend
from swashplate.physics.rigid_body import RigidBody
from swashplate.vehicles.coax import CoaxInputs

Precision = Literal["double", "float"]

_OWN = {"fmax(x, y)": "x > y ? x : y", "fmin(x, y)": "x < y ? x : y", "fabs(x)": "x > 0 ? x : -x"}
"""What CasADi takes from the C library, written out."""
_MEMORY = ("height", "heading", "spool", "ahead", "right")


@dataclass(frozen=True)
class ControllerCode:
    """C source of a controller.

    Attributes:
        source: the text of the .c file; it defines `void swash_step(real memory[5], const real measured[13], const real
            reference[8], real command[4])` and `swash_memory`, what the memory starts with.
        operations: arithmetic operations and calls of one step; there are no loops or branches, so it is also the most.
        calls: of them calls of the C library by name.
        work_bytes: of temporary numbers on the stack; the memory between steps comes on top (5 numbers).
        precision: "double" or "float".
    """

    source: str
    operations: int
    calls: dict[str, int]
    work_bytes: int
    precision: Precision

    def save(self, path: str | Path) -> None:
        """Write the .c file."""
        write_text(path, self.source)


def controller_code(controller: Autopilot, *, precision: Precision = "double") -> ControllerCode:
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
    memory, measured, reference = (
        casadi.SX.sym(name, n)
        for name, n in (("memory", len(_MEMORY)), ("measured", len(RigidBody._fields) + 1), ("reference", 8))
    )
    carried = Memory(HeightYawMemory(memory[0], memory[1], memory[2]), memory[3], memory[4])
    body = RigidBody(*(measured[i] for i in range(len(RigidBody._fields))))
    wanted = Reference(*(reference[i] for i in range(len(Reference._fields))))
    after, command = step(carried, body, measured[len(body)], wanted, controller.numbers, CasadiBackend())
    results = casadi.vertcat(*after.motors, after.ahead, after.right, *command)
    function = casadi.Function(
        "swash_traced",
        [memory, measured, reference],
        [results],
    )
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
    return ControllerCode(
        source=_heading(controller, precision) + printed + _ending(controller, precision),
        operations=_operations(function),
        calls={name: count for name, count in calls.items() if count},
        work_bytes=int(function.sz_w()) * (8 if precision == "double" else 4),
        precision=precision,
    )


def _operations(function: Any) -> int:
    """Instructions of the trace but reading inputs, writing outputs and constants."""
    import casadi

    moved = {casadi.OP_INPUT, casadi.OP_OUTPUT, casadi.OP_CONST}
    return sum(function.instruction_id(i) not in moved for i in range(function.n_instructions()))


def _heading(controller: Autopilot, precision: Precision) -> str:
    names = ", ".join([*RigidBody._fields, "voltage"])
    return f"""/* One step of a swashplate controller, to be called at {controller.rate:g} Hz.
 *
 *   void swash_step({precision} memory[5], const {precision} measured[13], const {precision} reference[8],
 *                   {precision} command[4]);
 *
 * vehicle    {controller.vehicle}, mode {controller.mode}, designed on: {controller.model.replace("*/", "* /")}
 * measured   {names}  [SI, radians, forward-right-down and north-east-down]
 * reference  {", ".join(Reference._fields)}
 * command    {", ".join(CoaxInputs._fields)}
 * memory     {", ".join(_MEMORY)}; starts as swash_memory says
 */
"""


def _ending(controller: Autopilot, precision: Precision) -> str:
    start = ", ".join(f"{value:.1f}" for value in controller.memory)
    return f"""
const {precision} swash_memory[{len(_MEMORY)}] = {{{start}}};

void swash_step({precision} memory[{len(_MEMORY)}], const {precision} measured[13], const {precision} reference[8],
                {precision} command[4]) {{
  const {precision} *arg[3];
  {precision} after[{len(_MEMORY) + 4}];
  {precision} *res[1];
  int i;
  arg[0] = memory;
  arg[1] = measured;
  arg[2] = reference;
  res[0] = after;
  swash_traced(arg, res, 0, 0, 0);
  for (i = 0; i < {len(_MEMORY)}; ++i) memory[i] = after[i];
  for (i = 0; i < 4; ++i) command[i] = after[{len(_MEMORY)} + i];
}}
"""
