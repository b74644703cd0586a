"""A controller's step as a graph, and what it is told: what `fly` prints beside a vehicle's equations."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.atomic import scratch_folder
from swashplate.compiled import can_compile, loaded
from swashplate.engine.emit import fill_template
from swashplate.engine.graph import Graph
from swashplate.errors import WriteError

_OPTIONS = ("-O1", "-w")
_DOUBLES = ctypes.POINTER(ctypes.c_double)


def runnable(function: Graph) -> Callable[..., list[Array]]:
    """A CasADi function with dense inputs and outputs, as one of arrays to arrays of the shapes that it has."""
    if not can_compile():
        return lambda *given: [np.asarray(part.full()) for part in function.call(list(given))]
    run = getattr(loaded(print_function(function, "double")[0], options=_OPTIONS), function.name())
    sizes = [function.size_in(i) for i in range(function.n_in())]

    def called(*given: Array) -> list[Array]:
        work = np.empty(max(1, int(function.sz_w())))  # each call its own: several threads may run it
        integer_work = np.empty(max(1, int(function.sz_iw())), dtype=np.intc)
        rows = [
            np.asfortranarray(np.reshape(part, size, order="F"), float) for part, size in zip(given, sizes, strict=True)
        ]
        results = [np.empty(function.size_out(i), order="F") for i in range(function.n_out())]
        arg = (_DOUBLES * max(len(rows), int(function.sz_arg())))(*(part.ctypes.data_as(_DOUBLES) for part in rows))
        res = (_DOUBLES * max(len(results), int(function.sz_res())))(
            *(part.ctypes.data_as(_DOUBLES) for part in results)
        )
        run(arg, res, integer_work.ctypes.data_as(ctypes.POINTER(ctypes.c_int)), work.ctypes.data_as(_DOUBLES), 0)
        return results

    return called


REFERENCES = ("x", "y", "z", "psi", "ahead", "right", "roll", "pitch")
"""What a controller is asked for, in the order of the reference row: place [m] and heading [rad] to hold, speed ahead
and to the right [m/s], and a pilot's cyclic commands [-1 to 1] (right and nose down positive)."""

FELT = ("felt_x", "felt_y", "felt_z")
"""The specific force at the centre of gravity among what a simulation tells a controller [m/s^2]."""


def draw_names(count: int) -> tuple[str, ...]:
    """The draws of one sample among what a simulation tells a controller."""
    return tuple(f"draw_{k}" for k in range(count))


@dataclass(frozen=True)
class LawGraph:
    """A step of a controller of one vehicle.

    Attributes:
        function: of CasADi, of (memory, measured, reference) to memory and commands in one column.
        measured: what it is told, in order: of `signals`.
        signals: all that a flight can tell: the vehicle's states, `FELT`, "voltage" and its draws.
        memory: how many numbers it carries.
        draws: how many its own sensors draw at each step.
        fixed: how many numbers at the end of what it carries never change.
    """

    function: Graph = field(repr=False)
    measured: tuple[str, ...]
    signals: tuple[str, ...]
    memory: int
    draws: int
    fixed: int = 0

    @property
    def places(self) -> NDArray[np.int_]:
        """Where in `signals` each measured number stands."""
        return np.array([self.signals.index(name) for name in self.measured], dtype=np.int_)

    @property
    def feels(self) -> bool:
        """Whether it is told the specific force."""
        return any(name in FELT for name in self.measured)


_OWN = {"fmax(x, y)": "x > y ? x : y", "fmin(x, y)": "x < y ? x : y", "fabs(x)": "x > 0 ? x : -x"}
"""What CasADi takes from the C library, written out."""


def print_function(function: Graph, real: str) -> tuple[str, dict[str, int]]:
    """A CasADi function as C by CasADi's own printer, which keeps its loops, and calls of the C library by name.

    Args:
        function: any.
        real: "double" or "float".

    Raises:
        WriteError: where it cannot be written to the folder for temporary files, which CasADi prints into.
    """
    import casadi

    with scratch_folder() as folder:
        generator = casadi.CodeGenerator("traced.c", {"casadi_real": real, "casadi_int": "int"})
        generator.add(function)
        try:
            printed = Path(generator.generate(f"{folder}/")).read_text(encoding="utf-8")
        except (RuntimeError, OSError) as error:  # CasADi says no more than that it has no stream
            raise WriteError(
                "CasADi's code cannot be written there.", where=folder.parent, hint="Check the folder and the disk."
            ) from error
    calls = {name: len(re.findall(rf"(?<![\w]){name}\(", printed)) for name in ("sin", "cos", "sqrt", "atan2")}
    for name, expression in _OWN.items():
        printed = printed.replace(f"return {name};", f"return {expression};")
    if real == "float":  # no constant and no function may lift the arithmetic to double
        printed = re.sub(r"(?<![\w.])(\d+\.\d*(?:e[+-]?\d+)?)(?![\w.])", r"\1f", printed)
        printed = re.sub(r"(?<![\w])(sin|cos|sqrt|atan2)\(", r"\1f(", printed)
    return printed, {name: count for name, count in calls.items() if count}


def law_code(law: LawGraph, inputs: int) -> str:
    """The C function `law` of `templates/fly.c`; its memory and commands are in double precision."""
    f = law.function
    sizes = {"LONGEST": max(1, int(f.sz_w())), "WHOLES": max(1, int(f.sz_iw()))}
    sizes |= {"ARGUMENTS": max(3, int(f.sz_arg())), "RESULTS": max(1, int(f.sz_res()))}
    return fill_template(
        "law.c", {**sizes, "TRACED": print_function(f, "double")[0], "NAME": f.name(), "INPUTS": inputs}
    )
