"""The C of `filter_c`, compiled and loaded, where there is a compiler; otherwise the same by NumPy and CasADi."""

from __future__ import annotations

import ctypes
import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from swashplate.arrays import Array
from swashplate.compiled import NATIVE, can_compile, loaded
from swashplate.filtering.disturbed_model import StochasticModel
from swashplate.filtering.filter_c import filter_source
from swashplate.filtering.filter_code import Along, FilterCode, Fixed, Followed, Following, Pushed, RecordSeries
from swashplate.filtering.filter_virtual import VirtualFilter

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
    "run_along": "ld" + 8 * "*",
    "run_moved": "ld" + 6 * "*" + "ll" + 3 * "*" + "ll" + 2 * "*" + "li*",
    "run_steps": "ldl" + 4 * "*",
    "run_steps_moved": "lld" + 8 * "*",
    "run_rates": "l" + 4 * "*",
    "rates_and_slopes": "l" + 6 * "*",
}
_FOLLOWING = {"run_following": "lld" + 13 * "*"}


class FilterLibrary:
    """The functions of one filter's C.

    Args:
        source: the C. outputs: how many there are. windy: whether its gain can follow.

    Raises:
        ExportError: without a compiler, or where it refuses.
    """

    compiled_by = "C"

    def __init__(self, source: str, outputs: int, *, windy: bool = False) -> None:
        self._c = loaded(source, options=(*_OPTIONS, *_QUIET))
        for name, kinds in (_ARGUMENTS | (_FOLLOWING if windy else {})).items():
            function = getattr(self._c, name)
            function.argtypes, function.restype = [_KINDS[kind] for kind in kinds], None
        self._directions, self._roots = int(self._c.directions()), int(self._c.roots())
        self._outputs = outputs

    def along(self, dt: float, fixed: Fixed, series: RecordSeries) -> tuple[Array, Array, Array]:
        n = len(series.readings)
        out = np.empty((n, self._outputs)), np.empty((n, fixed.start.size)), np.empty((n, 4, self._roots))
        self._c.run_along(n, dt, *map(flat, fixed), *map(flat, series), *out)
        return out

    def filter_slopes(
        self, dt: float, fixed: Fixed, series: RecordSeries, went: Array, along: Along
    ) -> tuple[Array, Array]:
        n, count = len(series.readings), len(along.fixed.start)
        slopes, states = np.empty((count, n, self._outputs)), np.empty((count, len(along.marks), fixed.start.size))
        here = *map(flat, fixed), *map(flat, series), went
        moving, pushed = tuple(map(flat, along.fixed)), flat(along.commands)
        at = np.ascontiguousarray(along.marks, np.dtype("l"))
        for first in range(0, count, self._directions):
            where = first, count, *moving, along.arriving, len(pushed), pushed, slopes, len(at), at, states
            self._c.run_moved(n, dt, *here, *where)
        return slopes, states

    def step(self, dt: float, x: Array, pushed: Pushed, numbers: Array) -> Array:
        after = np.array(x, dtype=np.float64, order="C")
        self._c.run_steps(len(after), dt, int(numbers.ndim == 2), after, *map(flat, pushed), flat(numbers))
        return after

    def step_moved(
        self, dt: float, x: Array, pushed: Pushed, numbers: Array, directions: tuple[Array, Pushed, Array]
    ) -> tuple[Array, Array]:
        after, (dx, d_pushed, d_numbers) = np.array(x, dtype=np.float64, order="C"), directions
        slope = np.array(dx, dtype=np.float64, order="C")
        here = after, *map(flat, pushed), flat(numbers), slope, *map(flat, d_pushed), flat(d_numbers)
        self._c.run_steps_moved(len(after), len(slope), dt, *here)
        return after, slope

    def follow(self, dt: float, begin: Following, series: RecordSeries) -> Followed:
        rows, n, y, joined = len(begin.states), len(series.readings), self._outputs, begin.states.shape[1]
        out = Followed(np.empty((rows, n, y)), np.empty((rows, n, y, y)), np.empty((rows, n, joined)))
        here = flat(series.readings), flat(series.driving.swapaxes(0, 1))
        self._c.run_following(rows, n, dt, *map(flat, begin), *here, *out)
        return out

    def rates(self, x: Array, w: Array, p: Array) -> Array:
        out = np.empty(x.shape)
        self._c.run_rates(math.prod(x.shape[:-1]), *map(flat, (x, w, p)), out)
        return out

    def rates_and_slopes(self, x: Array, w: Array, p: Array) -> tuple[Array, Array, Array]:
        """As `engine.slopes.rates_and_slopes`, with any axes in front; slopes by the voltage are left at zero."""
        front, n, m = x.shape[:-1], x.shape[-1], w.shape[-1]
        results = np.empty((*front, n)), np.empty((*front, n, n)), np.empty((*front, n, m))
        self._c.rates_and_slopes(math.prod(front), *map(flat, (x, w, p)), *results)
        return results


def flat(rows: ArrayLike) -> Array:
    """Numbers as C reads them."""
    return np.ascontiguousarray(rows, dtype=np.float64)


@lru_cache(maxsize=16)
def filter_code(model: StochasticModel) -> FilterCode:
    """A model's filter: in C, or by NumPy where there is no compiler.

    Raises:
        ExportError: for equations that CasADi cannot trace or that are not printed as C, or a compiler that refuses.
        MissingLibraryError: without CasADi.
    """
    if can_compile():
        return FilterLibrary(filter_source(model), model.n_outputs, windy=model.windy)
    return VirtualFilter(model)
