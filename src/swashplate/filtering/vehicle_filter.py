"""A filter of constant gain around any vehicle's equations, along a record, and its exact slopes.

CasADi traces the equations once. C printed from the graph runs the filter (`engine/templates/record.c`), differentiated
in print; without a compiler CasADi's virtual machine runs the same sample.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.compiled import NATIVE, can_compile, loaded
from swashplate.engine.c_expression import printed, statements
from swashplate.engine.c_loops import looped
from swashplate.engine.c_split import ROOTS
from swashplate.engine.c_tangents import VECTORS, Tangents
from swashplate.engine.equations import Equations
from swashplate.engine.roots import require_casadi
from swashplate.engine.template import filled
from swashplate.engine.trace import traced_force, traced_rates, unrolled_rates

FORCES = ("ax", "ay", "az")
"""Channels of the specific force, in the order in which a vehicle gives it."""

_OPTIONS = ("-O2", NATIVE, "-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math", "-w")
_TABLE = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")
_ARGUMENTS = (ctypes.c_long, ctypes.c_double, *4 * (_TABLE,), ctypes.c_long, ctypes.c_long, *6 * (_TABLE,))


@dataclass(frozen=True)
class Ran:
    """A run along a record of n samples, and its slopes along k directions.

    Attributes:
        errors, states: measured less predicted (n, n_outputs), and the states after each correction (n, n_states).
        errors_moved, states_moved: their slopes, (k, n, ...).
    """

    errors: Array
    states: Array
    errors_moved: Array
    states_moved: Array


class VehicleFilter:
    """The filter of one model's equations and outputs.

    Its numbers are a row: of the equations (`engine.equations.parameter_row`), constants in the rates and in the
    outputs, and the gain from errors to states (n_states, n_outputs), row by row.

    Args:
        equations: of which vehicle.
        outputs: channels that are measured: states, rates ("qdot") and the specific force ("ax", "ay", "az").
        dt: time between samples [s].
    """

    def __init__(self, equations: Equations, outputs: Sequence[str], dt: float) -> None:
        names = equations.vehicle.state_names
        every = (*names, *(f"{name}dot" for name in names), *FORCES)
        self.equations, self.dt, self._seen = equations, dt, tuple(every.index(name) for name in outputs)
        self._library = _library(equations, self._seen) if can_compile() else None

    def run(self, start: Array, numbers: Array, rows: Array, readings: Array) -> Ran:
        """The filter along a record.

        Args:
            start: state predicted for the first sample, and k directions in which it moves, (1 + k, n_states).
            numbers: the filter's row, and how it moves along the same, (1 + k, n_numbers).
            rows: what drives it, straight between samples (n, n_driving). readings: of the outputs (n, n_outputs).
        """
        if self._library is None:
            return self._run_virtually(start, numbers, rows, readings)
        count, own = len(start) - 1, [np.ascontiguousarray(part) for part in (start, numbers, rows, readings)]
        sizes = [(len(rows), width) for width in (readings.shape[1], start.shape[1])]
        tables = [np.empty((*front, *size)) for front in ((), (count,)) for size in sizes]
        for first in range(0, max(1, count), self._library.directions()):
            given = own[0][0], own[1][0], own[2], own[3], first, count, own[0][1:], own[1][1:]
            self._library.run(len(rows), self.dt, *given, *tables)
        return Ran(*tables)

    def _run_virtually(self, start: Array, numbers: Array, rows: Array, readings: Array) -> Ran:
        along, count = _sample(self.equations, self._seen, self.dt).mapaccum(len(rows)), len(start) - 1
        now = np.concatenate([rows, np.concatenate([rows[1:], rows[-1:]]), readings], axis=1).T
        runs = []
        for place in range(max(1, count)):
            moved = (part[place + 1] if count else 0.0 * part[0] for part in (start, numbers))
            x, g = (np.concatenate(pair) for pair in zip((start[0], numbers[0]), moved, strict=True))
            runs.append(np.asarray(along(x, now, np.repeat(g[:, None], len(rows), axis=1))[1]).T)
        ends = np.cumsum([readings.shape[1], start.shape[1], readings.shape[1]])
        errors, states, errors_moved, states_moved = np.split(np.stack(runs), ends, axis=2)
        return Ran(errors[0], states[0], errors_moved[:count], states_moved[:count])

    def linear(self, x: Array, w: Array, p: Array) -> Array:
        """Slopes by the state of its rates and of the outputs, and how these move.

        Args:
            x, p: state and the equations' numbers, and k directions in which they move, first axis 1 + k.
            w: what drives (n_driving,).

        Returns:
            Shape (1 + k, n_states + n_outputs, n_states).
        """
        graph = _linear(self.equations, self._seen)
        moved = [graph(x[0], w, p[0], *by)[1] for by in zip(x[1:], p[1:], strict=True)]
        return np.stack([np.asarray(part) for part in (graph(x[0], w, p[0], 0.0, 0.0)[0], *moved)])


@lru_cache(maxsize=16)
def _library(equations: Equations, seen: tuple[int, ...]) -> Any:
    """The filter in C, compiled."""
    library = loaded(filter_source(equations, seen), options=_OPTIONS)
    library.run.argtypes, library.run.restype = _ARGUMENTS, None
    return library


def filter_source(equations: Equations, seen: Sequence[int]) -> str:
    """C of `run` for a vehicle's equations (`templates/record.c`).

    Args:
        equations: of which vehicle.
        seen: places of the outputs among states, rates and force.

    Raises:
        ExportError: for equations that CasADi cannot trace or that are not printed as C.
        MissingLibraryError: without CasADi.
    """
    vehicle, rates = equations.vehicle, traced_rates(equations)
    n = len(vehicle.state_names)
    code = statements(rates.function, precision="double", inputs=["x", "w", "p", *(name[:-1] for name in ROOTS)])
    moving, feeling = (Tangents({"x": ("dx", None), "p": ("dp", None)}) for _ in range(2))
    if rates.steps:
        plain = looped(code, rates.steps, real="double", precision="double", outputs=["k"])
        lines, stored = moving.rooted(code, len(rates.steps))
    else:
        plain, lines, stored = printed(code, "double", "double", ["k"]), moving.body(code.body), code
    felt: list[str] = []
    if max(seen) >= 2 * n:
        force = statements(traced_force(equations), precision="double", inputs=["x", "w", "p"])
        felt = [*feeling.body(force.body), *feeling.stores(force, {0: "f"})]
    return filled(
        "record.c",
        {
            "VECTORS": VECTORS,
            "STATES": n,
            "DRIVING": len(vehicle.input_names) + 4,
            "NUMBERS": len(vehicle.parameter_names) + 2,
            "OUTPUTS": len(seen),
            "ROOTS": max(1, len(rates.steps)),
            "ROOTED": int(bool(rates.steps)),
            "RATED": int(any(n <= place < 2 * n for place in seen)),
            "SEEN": ", ".join(map(str, seen)),
            "MOVING": plain,
            "MOVING_MOVED": "\n".join([*lines, *moving.stores(stored, {0: "k"}), ""]),
            "FORCE_MOVED": "\n".join([*felt, ""]),
        },
    )


def _told(equations: Equations, seen: tuple[int, ...], x: Any, w: Any, p: Any, shift: Any) -> Any:
    """What is measured, in symbols."""
    every = require_casadi().vertcat(x, unrolled_rates(equations)(x, w, p) + shift, traced_force(equations)(x, w, p))
    return every[list(seen)]


@lru_cache(maxsize=16)
def _linear(equations: Equations, seen: tuple[int, ...]) -> Any:
    """(x, w, p, dx, dp) to the slopes by x of rates and outputs, and how these move."""
    casadi, rates = require_casadi(), unrolled_rates(equations)
    (x, w, p), (dx, dp) = ([casadi.SX.sym("s", rates.size1_in(i)) for i in places] for places in ((0, 1, 2), (0, 2)))
    values = casadi.vertcat(rates(x, w, p), _told(equations, seen, x, w, p, 0.0))
    slopes = casadi.densify(casadi.jacobian(values, x))
    moved = casadi.jtimes(casadi.vec(slopes), casadi.vertcat(x, p), casadi.vertcat(dx, dp))
    moved = casadi.reshape(casadi.densify(moved), *slopes.shape)
    return casadi.Function("linear", [x, w, p, dx, dp], [slopes, moved], {"cse": True})


@lru_cache(maxsize=16)
def _sample(equations: Equations, seen: tuple[int, ...], dt: float) -> Any:
    """A sample in symbols: (state, drive and reading, numbers), the first and last with a direction behind, to the next
    state and (error, corrected state) likewise."""
    casadi, rates = require_casadi(), unrolled_rates(equations)
    n, driving, numbers = (rates.size1_in(i) for i in range(3))
    m = len(seen)
    parts = [numbers, n, m, n * m]
    x, dx, g, dg = (casadi.SX.sym("s", size) for size in (n, n, sum(parts), sum(parts)))
    w, then, y = (casadi.SX.sym("w", size) for size in (driving, driving, m))
    p, shift, bias, gain = casadi.vertsplit(g, [0, *np.cumsum(parts).tolist()])
    error = y - _told(equations, seen, x, w, p, shift) - bias
    corrected = x + casadi.reshape(gain, m, n).T @ error
    following, k = corrected, casadi.SX.zeros(n)
    for share, weight in ((0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)):
        k = rates(corrected + share * dt * k, w + share * (then - w), p) + shift
        following = following + weight * dt / 6.0 * k
    told = casadi.vertcat(error, corrected)
    moved = casadi.jtimes(casadi.vertcat(following, told), casadi.vertcat(x, g), casadi.vertcat(dx, dg))
    results = [casadi.vertcat(following, moved[:n]), casadi.vertcat(told, moved[n:])]
    given = [casadi.vertcat(x, dx), casadi.vertcat(w, then, y), casadi.vertcat(g, dg)]
    return casadi.Function("sample", given, [casadi.densify(part) for part in results], {"cse": True})
