"""What leaves the house: the exported C step (as `swash export --format c` writes it).

Held against `simulate` of `benchmarks.single` and `benchmarks.helicopter`, which fly the same equations.
"""

from __future__ import annotations

import ctypes
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.timing import Result, best_rate
from swashplate.compiler import shared_library
from swashplate.export.model_c import model_code
from swashplate.export.traced import trace_vehicle
from swashplate.models.catalogue import vehicle as load_vehicle
from swashplate.simulation.trim import trim

STEP_TARGET = 1_000_000.0
"""Steps per second on one core."""
DT = 0.01
_LOOP = """
#include "NAME.h"
void fly(double *x, const double *u, const double *s, const double *p, int n);
void fly(double *x, const double *u, const double *s, const double *p, int n) {
  int i;
  for (i = 0; i < n; ++i) NAME_step(x, u, s, p, 0.01);
}
"""


def step(name: str, *, steps: int, repeats: int, **options: object) -> Result:
    """The exported Runge-Kutta step of a packaged vehicle, double precision, gcc -O2, called in a loop in C.

    `options` as the flight has them that it is held against.
    """
    vehicle = load_vehicle(name, **options)
    model = trace_vehicle(vehicle, trim(vehicle), name=name)
    kinds = ("states", "inputs", "surroundings", "parameters")
    start, *given = (np.array([v.start for v in getattr(model, kind)]) for kind in kinds)
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        for file, text in {**model_code(model).files(), "loop.c": _LOOP.replace("NAME", name)}.items():
            (here / file).write_text(text, encoding="utf-8")
        library = shared_library([here / f"{name}.c", here / "loop.c"], here / "step.so")
        fly = ctypes.CDLL(str(library)).fly
        row = np.ctypeslib.ndpointer(dtype=np.float64, flags="C_CONTIGUOUS")
        fly.argtypes, fly.restype = [row, row, row, row, ctypes.c_int], None

        def run() -> None:
            fly(start.copy(), *given, steps)

        rate = best_rate(run, steps, repeats=repeats)
    return Result(f"exported C step, {name}", rate, STEP_TARGET, f"{start.size} states, float64, one core")
