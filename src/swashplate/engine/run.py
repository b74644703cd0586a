"""A graph as a function of numbers: compiled where there is a C compiler, otherwise by CasADi's virtual machine."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

import numpy as np

from swashplate.arrays import Array
from swashplate.compiled import can_compile, loaded
from swashplate.engine.graph import Graph
from swashplate.engine.law import print_function

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
        whole = np.empty(max(1, int(function.sz_iw())), dtype=np.intc)
        rows = [
            np.asfortranarray(np.reshape(part, size, order="F"), float) for part, size in zip(given, sizes, strict=True)
        ]
        told = [np.empty(function.size_out(i), order="F") for i in range(function.n_out())]
        arg = (_DOUBLES * max(len(rows), int(function.sz_arg())))(*(part.ctypes.data_as(_DOUBLES) for part in rows))
        res = (_DOUBLES * max(len(told), int(function.sz_res())))(*(part.ctypes.data_as(_DOUBLES) for part in told))
        run(arg, res, whole.ctypes.data_as(ctypes.POINTER(ctypes.c_int)), work.ctypes.data_as(_DOUBLES), 0)
        return told

    return called
