"""A vehicle stepped by its own exported C, compiled on this machine: half the time of a call of XLA."""

from __future__ import annotations

import ctypes
import hashlib
import os
import tempfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import platformdirs

from swashplate.arrays import Array
from swashplate.export.compiler import compiler, shared_library
from swashplate.export.model_c import frame_code
from swashplate.export.traced import trace_vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.dynamics import SURROUNDINGS
from swashplate.simulation.trim import Trim

_OPTIONS = ("-O1",)
"""-O2 takes 2.5 times as long to compile and is no faster (measured)."""
_POINTER = ctypes.POINTER(ctypes.c_double)


def can_compile() -> bool:
    """Whether this machine has CasADi and a C compiler."""
    return compiler() is not None and find_spec("casadi") is not None


class CompiledEngine:
    """What moves a `Stepping` (`simulation.stepping.SteppingEngine`), in C.

    The library is kept in the user's cache folder under the digest of its source, compiler and options.

    Args:
        moved: a vehicle of `tumbling`.
        environment: its air and gravity; wind and voltage come with each frame.

    Raises:
        ExportError: without a compiler, or where it refuses the source.
        MissingLibraryError: without CasADi.
    """

    def __init__(self, moved: Vehicle, environment: Environment) -> None:
        row, inputs = np.zeros(len(moved.state_names)), np.zeros(len(moved.input_names))
        start = Trim(row, inputs, moved.state_names, moved.input_names, environment, 0.0, 0.0, 0.0, 0.0)
        model = trace_vehicle(moved, start, name="body", jacobians=False)
        self._frame = _loaded(frame_code(model)).body_frame
        self._frame.argtypes = [_POINTER] * 4 + [ctypes.c_double, ctypes.c_int, _POINTER]
        self._frame.restype = None
        names = [v.name for v in model.surroundings]
        self._moving = [(k, SURROUNDINGS.index(name)) for k, name in enumerate(names) if name in SURROUNDINGS]
        self._state, self._inputs = row, inputs
        self._around = np.array([v.start for v in model.surroundings])
        self._told, numbers = np.zeros(2 * row.size), np.array([v.start for v in model.parameters])
        self._rows = (self._state, self._inputs, self._around, numbers)
        self._given = [row.ctypes.data_as(_POINTER) for row in self._rows]
        self._answer = self._told.ctypes.data_as(_POINTER)

    def place(self, row: Array) -> None:
        self._state[:] = row

    def advance(self, inputs: Array, around: Array, step: float, steps: int) -> Array:
        self._inputs[:] = inputs
        for own, given in self._moving:
            self._around[own] = around[given]
        self._frame(*self._given, step, steps, self._answer)
        return self._told


def _loaded(source: str) -> ctypes.CDLL:
    """The library of a source: from the cache, compiled where it is missing or does not load."""
    told = "\0".join((source, compiler() or "", *_OPTIONS))
    folder = Path(platformdirs.user_cache_dir("swashplate")) / "c"
    found = folder / f"{hashlib.sha256(told.encode()).hexdigest()[:32]}.so"
    if found.is_file():
        try:
            return ctypes.CDLL(str(found))
        except OSError:  # damaged: made anew
            found.unlink(missing_ok=True)
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        keeping = tempfile.TemporaryDirectory(dir=folder)
    except OSError:  # nothing can be kept
        keeping = tempfile.TemporaryDirectory()
    with keeping as made:
        text, place = Path(made) / "body.c", Path(made) / "body.so"
        text.write_text(source, encoding="utf-8")
        shared_library([text], place, options=_OPTIONS)
        if Path(made).parent == folder:
            os.replace(place, found)
            place = found
        return ctypes.CDLL(str(place))  # what is loaded stays when its file goes
