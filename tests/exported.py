"""Exported C, compiled and called from Python."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from swashplate.compiler import shared_library
from swashplate.export.model_c import ModelCode

FLY = """#include "NAME.h"
void fly(const NAME_real *rows, NAME_real *states, int n, NAME_real dt, const NAME_real *s, const NAME_real *p);
void fly(const NAME_real *rows, NAME_real *states, int n, NAME_real dt, const NAME_real *s, const NAME_real *p) {
  int i, k;
  for (k = 1; k < n; ++k) {
    NAME_real *x = states + k * NAME_n_states;
    for (i = 0; i < NAME_n_states; ++i) x[i] = x[i - NAME_n_states];
    NAME_step(x, rows + (k - 1) * NAME_n_inputs, s, p, dt);
  }
}
"""


@dataclass(frozen=True)
class Compiled:
    """Functions of the exported library, on float64 rows."""

    library: ctypes.CDLL
    name: str
    kind: type

    def call(self, function: str, *rows: np.ndarray, out: tuple[int, ...]) -> list[np.ndarray]:
        """`NAME_function(rows..., results...)`."""
        given = [np.ascontiguousarray(row, dtype=self.kind) for row in rows]
        results = [np.full(size, np.nan, dtype=self.kind) for size in out]
        pointers = [ctypes.c_void_p(a.ctypes.data) for a in (*given, *results)]
        getattr(self.library, f"{self.name}_{function}")(*pointers)
        return [result.astype(float) for result in results]

    def fly(self, start: np.ndarray, rows: np.ndarray, dt: float, s: np.ndarray, p: np.ndarray) -> np.ndarray:
        """States at every row, shape (n, n_states), inputs held."""
        states = np.zeros((len(rows), start.size), dtype=self.kind)
        states[0] = start
        real = ctypes.c_double if self.kind is np.float64 else ctypes.c_float
        given = [np.ascontiguousarray(a, dtype=self.kind) for a in (rows, s, p)]
        pointer: Callable[[np.ndarray], ctypes.c_void_p] = lambda a: ctypes.c_void_p(a.ctypes.data)  # noqa: E731
        arguments = (pointer(given[0]), pointer(states), len(rows), real(dt), pointer(given[1]), pointer(given[2]))
        self.library.fly(*arguments)
        return states.astype(float)


def compiled(code: ModelCode, folder: Path) -> Compiled:
    """The exported C with a loop around its step, compiled as strictly as the package does."""
    for name, text in {**code.files(), "fly.c": FLY.replace("NAME", code.name)}.items():
        (folder / name).write_text(text, encoding="utf-8")
    library = shared_library([folder / f"{code.name}.c", folder / "fly.c"], folder / "model.so", options=["-O0"])
    kind = np.float64 if code.precision == "double" else np.float32
    return Compiled(ctypes.CDLL(str(library)), code.name, kind)
