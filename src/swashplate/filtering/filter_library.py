"""The C of `filter_c`, compiled and loaded, where there is a compiler."""

from __future__ import annotations

import ctypes
import math
from functools import lru_cache
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.compiled import NATIVE, can_compile, loaded
from swashplate.errors import SwashError
from swashplate.filtering.disturbed_model import StochasticModel
from swashplate.filtering.filter_c import filter_source

_OPTIONS = ("-O2", NATIVE, "-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math")
_QUIET = (
    "-Wno-unused-variable",
    "-Wno-unused-but-set-variable",
    "-Wno-psabi",
    "-Wno-missing-braces",
    "-Wno-unknown-warning-option",
)
_KINDS = {
    "l": ctypes.c_long,
    "d": ctypes.c_double,
    "*": np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS"),
    "i": np.ctypeslib.ndpointer(ctypes.c_long, flags="C_CONTIGUOUS"),
}
_ARGUMENTS = {
    "run_along": "ld" + 9 * "*",
    "run_moved": "ld" + 7 * "*" + "ll" + 3 * "*" + "ll" + 2 * "*",
    "run_ahead": "lld" + 5 * "*" + "i*",
    "rates_and_slopes": "l" + 6 * "*",
}


class FilterLibrary:
    """The functions of one model's C; their arguments are as its text has them.

    Args:
        model: whose filter.

    Raises:
        ExportError: for equations that cannot be printed as C, and without a compiler.
        MissingLibraryError: without CasADi.
    """

    def __init__(self, model: StochasticModel) -> None:
        self._c = loaded(filter_source(model), options=(*_OPTIONS, *_QUIET))
        for name, kinds in _ARGUMENTS.items():
            function = getattr(self._c, name)
            function.argtypes, function.restype = [_KINDS[kind] for kind in kinds], None
        self.run_along, self.run_moved, self.run_ahead = self._c.run_along, self._c.run_moved, self._c.run_ahead
        self.directions, self.roots = int(self._c.directions()), int(self._c.roots())

    def rates_and_slopes(self, x: Array, w: Array, p: Array) -> tuple[Array, Array, Array]:
        """As `dynamics.rates_and_slopes`, with any axes in front; slopes by the voltage are left at zero."""
        front, n, m = x.shape[:-1], x.shape[-1], w.shape[-1]
        results = np.empty((*front, n)), np.empty((*front, n, n)), np.empty((*front, n, m))
        self._c.rates_and_slopes(math.prod(front), *map(flat, (x, w, p)), *results)
        return results


def flat(rows: Any) -> Array:
    """Numbers as C reads them."""
    return np.ascontiguousarray(rows, dtype=np.float64)


@lru_cache(maxsize=16)
def filter_library(model: StochasticModel) -> FilterLibrary | None:
    """A model's filter in C; None where it cannot be had here: then it is XLA's."""
    if not can_compile():
        return None
    try:
        return FilterLibrary(model)
    except (SwashError, OSError):  # no C of these equations, a compiler that refuses, a library that does not load
        return None
