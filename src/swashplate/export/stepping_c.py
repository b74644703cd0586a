"""A vehicle stepped by its own exported C, compiled on this machine."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.compiled import loaded
from swashplate.engine.equations import SURROUNDINGS
from swashplate.engine.graph import Graph
from swashplate.engine.roots import require_casadi
from swashplate.export.model_c import frame_code
from swashplate.export.traced import trace_vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import CasadiBackend
from swashplate.physics.environment import Environment
from swashplate.simulation.stepping import NativeFrame, motion_row
from swashplate.simulation.trim import Trim

_OPTIONS = ("-O1",)
"""-O2 takes 2.5 times as long to compile and is no faster (measured)."""
_POINTER = ctypes.POINTER(ctypes.c_double)


class CompiledEngine:
    """What moves a `Stepping` (`simulation.stepping.SteppingEngine`), in C.

    The library is kept in the user's cache folder under the digest of its source, compiler and options.

    Args:
        moved: a vehicle of `tumbling`.
        environment: its air and gravity; wind and voltage come with each frame.

    Attributes:
        native: its C.

    Raises:
        ExportError: without a compiler, or where it refuses the source.
        MissingLibraryError: without CasADi.
    """

    def __init__(self, vehicle: Vehicle, environment: Environment) -> None:
        row, inputs = np.zeros(len(vehicle.state_names)), np.zeros(len(vehicle.input_names))
        start = Trim(row, inputs, vehicle.state_names, vehicle.input_names, environment, 0.0, 0.0, 0.0, 0.0)
        model = trace_vehicle(vehicle, start, name="body", jacobians=False)
        self._frame = loaded(frame_code(model, _told(row.size)), options=_OPTIONS).body_frame
        self._frame.argtypes = [_POINTER] * 5 + [ctypes.c_double, ctypes.c_int, _POINTER]
        self._frame.restype = None
        names = [v.name for v in model.surroundings]
        self._moving = [(k, SURROUNDINGS.index(name)) for k, name in enumerate(names) if name in SURROUNDINGS]
        self._state, self._inputs = row, inputs
        self._around = np.array([v.start for v in model.surroundings])
        self._told, numbers = np.zeros(row.size + 5), np.array([v.start for v in model.parameters])
        rows = (self._state, self._inputs, self._around, numbers, np.array([float(environment.gravity)]), self._told)
        self.native = NativeFrame(ctypes.cast(self._frame, ctypes.c_void_p).value or 0, rows)
        *self._given, self._answer = (row.ctypes.data_as(_POINTER) for row in rows)

    def place(self, row: Array) -> None:
        self._state[:] = row

    def advance(self, inputs: Sequence[float], around: Array, step: float, steps: int) -> list[float]:
        self._inputs[:] = inputs
        for row, given in self._moving:
            self._around[row] = around[given]
        self._frame(*self._given, step, steps, self._answer)
        return self._told.tolist()


def _told(states: int) -> Graph:
    """`motion_row` as a CasADi function of a state row of `tumbling`, its rates and gravity."""
    casadi = require_casadi()
    x, rates, g = (casadi.SX.sym(name, size) for name, size in (("x", states), ("rates", states), ("g", 1)))
    row = motion_row([x[k] for k in range(states)], [rates[k] for k in range(states)], g, CasadiBackend())
    return casadi.Function("f", [x, rates, g], [casadi.vertcat(*row)], {"cse": True})
