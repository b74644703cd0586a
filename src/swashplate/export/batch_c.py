"""Many vehicles flown by their own C, in blocks of lanes that fill the processor's vectors, spread over the cores."""

from __future__ import annotations

import ctypes
import os
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.compiled import NATIVE, loaded
from swashplate.engine.c_text import Precision
from swashplate.engine.equations import Equations
from swashplate.export.c_lanes import lane_code

_OPTIONS = (
    *("-O3", NATIVE, "-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math", "-fopenmp-simd"),
    *("-Wno-unknown-warning-option", "-Wno-pass-failed"),  # clang warns of a loop that it leaves as it is
)
"""Nothing that lets a compiler change the order of operations: infinities and NaN stay what they are."""
_PART = 512
"""Vehicles a thread flies before it takes the next: a thread that another program held up then keeps nobody waiting."""


def fly_in_c(
    equations: Equations,
    x0: NDArray[Any],
    rows: NDArray[Any],
    p: NDArray[Any],
    dt: NDArray[Any],
    *,
    keep: int,
    held: bool,
) -> NDArray[Any]:
    """`simulation.batch.fly_batch` in C; arguments as there, and the same numbers to rounding.

    Raises:
        ExportError: without a compiler or CasADi, or for equations that are not printed as C.
    """
    fly, precision = _compiled(equations, str(x0.dtype)), x0.dtype
    start, driving, numbers = (np.ascontiguousarray(table, precision) for table in (x0, rows, p))
    count, n = start.shape[1], (rows.shape[0] - 1) // keep
    states = np.empty((n + 1, *start.shape), precision)
    states[0] = start
    given = [table.ctypes.data for table in (start, driving, numbers)]
    shape = (n * keep, keep, int(held), driving.shape[2], numbers.shape[1])

    def part(first: int) -> None:
        fly(*given, float(dt), *shape, first, min(first + _PART, count), count, states.ctypes.data + states[0].nbytes)

    with ThreadPoolExecutor(_cores()) as threads:
        list(threads.map(part, range(0, count, _PART)))
    return states


def _cores() -> int:
    """Those that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@lru_cache(maxsize=32)
def _compiled(equations: Equations, dtype: str) -> Any:
    precision: Precision = "double" if dtype == "float64" else "single"
    fly = loaded(lane_code(equations, precision), options=_OPTIONS).fly_lanes
    real = ctypes.c_double if precision == "double" else ctypes.c_float
    sizes = [ctypes.c_long] * 2 + [ctypes.c_int] + [ctypes.c_long] * 5
    fly.argtypes, fly.restype = [ctypes.c_void_p] * 3 + [real, *sizes, ctypes.c_void_p], None
    return fly
