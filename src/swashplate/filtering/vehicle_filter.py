"""A filter of constant gain around any vehicle's equations, along a record, and its exact slopes.

CasADi traces the equations once. C printed from the graph runs the filter (`filter_c`), differentiated in print;
without a compiler CasADi's virtual machine runs the same sample.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from swashplate.arrays import Array
from swashplate.compiled import can_compile
from swashplate.engine.equations import CONSTANTS, Equations
from swashplate.engine.graph import Expression, Graph
from swashplate.engine.roots import require_casadi
from swashplate.engine.trace import traced_force, unrolled_rates
from swashplate.filtering.filter_c import Sample, sample_source
from swashplate.filtering.filter_code import Along, Fixed, RecordSeries
from swashplate.filtering.filter_library import FilterLibrary

FORCES = ("ax", "ay", "az")
"""Channels of the specific force, in the order in which a vehicle gives it."""


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
        fixed, slopes = (Fixed(*part) for part in self._parts(start, numbers))
        series, marks, inputs = RecordSeries(readings, rows), np.arange(len(rows)), rows.shape[1] - 4
        errors, states, went = self._library.along(self.dt, fixed, series)
        along = Along(slopes, 0, np.empty((0, len(rows), inputs)), marks)
        return Ran(errors, states, *self._library.filter_slopes(self.dt, fixed, series, went, along))

    def _parts(self, start: Array, numbers: Array) -> Iterator[tuple[Array, Array, Array]]:
        """Where it begins, what is given and the equations' numbers: themselves, and how they move."""
        count = len(self.equations.vehicle.parameter_names) + len(CONSTANTS)
        for of in (0, slice(1, None)):
            yield start[of], numbers[of, count:], numbers[of, :count]

    def _run_virtually(self, start: Array, numbers: Array, rows: Array, readings: Array) -> Ran:
        along, count = _sample(self.equations, self._seen, self.dt).mapaccum(len(rows)), len(start) - 1
        now = np.concatenate([rows, np.concatenate([rows[1:], rows[-1:]]), readings], axis=1).T
        runs = []
        for place in range(max(1, count)):
            slope = (part[place + 1] if count else 0.0 * part[0] for part in (start, numbers))
            x, g = (np.concatenate(pair) for pair in zip((start[0], numbers[0]), slope, strict=True))
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
        slopes = [graph(x[0], w, p[0], *by)[1] for by in zip(x[1:], p[1:], strict=True)]
        return np.stack([np.asarray(part) for part in (graph(x[0], w, p[0], 0.0, 0.0)[0], *slopes)])


@lru_cache(maxsize=16)
def _library(equations: Equations, rows: tuple[int, ...]) -> FilterLibrary:
    """The filter in C, compiled."""
    casadi, vehicle, m = require_casadi(), equations.vehicle, len(rows)
    n = len(vehicle.state_names)
    sizes = (n, m, n + m + n * m, len(vehicle.input_names) + 4, len(vehicle.parameter_names) + len(CONSTANTS), n)
    s, y, g, w, p, k = (casadi.SX.sym(name, size) for name, size in zip("sygwpk", sizes, strict=True))
    shift, bias, gain = casadi.vertsplit(g, [0, n, n + m, n + m + n * m])
    force = traced_force(equations)(s, w, p) if max(rows) >= 2 * n else casadi.SX.zeros(3)
    error = y - casadi.vertcat(s, k + shift, force)[list(rows)] - bias
    results = [error, s + casadi.reshape(gain, m, n).T @ error, shift, casadi.SX(0, 1)]
    correct = casadi.Function("f", [s, y, g, w, p, k], [casadi.densify(part) for part in results], {"cse": True})
    rated = any(n <= place < 2 * n for place in rows)
    return FilterLibrary(sample_source(equations, Sample(correct, range(n), rated=rated, linear=True)), m)


def _measured(
    equations: Equations, rows: tuple[int, ...], x: Expression, w: Expression, p: Expression, shift: Expression | float
) -> Expression:
    """What is measured, in symbols."""
    every = require_casadi().vertcat(x, unrolled_rates(equations)(x, w, p) + shift, traced_force(equations)(x, w, p))
    return every[list(rows)]


@lru_cache(maxsize=16)
def _linear(equations: Equations, rows: tuple[int, ...]) -> Graph:
    """(x, w, p, dx, dp) to the slopes by x of rates and outputs, and how these move."""
    casadi, rates = require_casadi(), unrolled_rates(equations)
    (x, w, p), (dx, dp) = ([casadi.SX.sym("s", rates.size1_in(i)) for i in places] for places in ((0, 1, 2), (0, 2)))
    values = casadi.vertcat(rates(x, w, p), _measured(equations, rows, x, w, p, 0.0))
    slopes = casadi.densify(casadi.jacobian(values, x))
    turned = casadi.jtimes(casadi.vec(slopes), casadi.vertcat(x, p), casadi.vertcat(dx, dp))
    turned = casadi.reshape(casadi.densify(turned), *slopes.shape)
    return casadi.Function("linear", [x, w, p, dx, dp], [slopes, turned], {"cse": True})


@lru_cache(maxsize=16)
def _sample(equations: Equations, rows: tuple[int, ...], dt: float) -> Graph:
    """A sample in symbols: (state, drive and reading, numbers), the first and last with a direction behind, to the next
    state and (error, corrected state) likewise."""
    casadi, rates = require_casadi(), unrolled_rates(equations)
    n, driving, numbers = (rates.size1_in(i) for i in range(3))
    m = len(rows)
    parts = [numbers, n, m, n * m]
    x, dx, g, dg = (casadi.SX.sym("s", size) for size in (n, n, sum(parts), sum(parts)))
    w, then, y = (casadi.SX.sym("w", size) for size in (driving, driving, m))
    p, shift, bias, gain = casadi.vertsplit(g, [0, *np.cumsum(parts).tolist()])
    error = y - _measured(equations, rows, x, w, p, shift) - bias
    corrected = x + casadi.reshape(gain, m, n).T @ error
    following, k = corrected, casadi.SX.zeros(n)
    for share, weight in ((0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)):
        k = rates(corrected + share * dt * k, w + share * (then - w), p) + shift
        following = following + weight * dt / 6.0 * k
    outputs = casadi.vertcat(error, corrected)
    slopes = casadi.jtimes(casadi.vertcat(following, outputs), casadi.vertcat(x, g), casadi.vertcat(dx, dg))
    results = [casadi.vertcat(following, slopes[:n]), casadi.vertcat(outputs, slopes[n:])]
    given = [casadi.vertcat(x, dx), casadi.vertcat(w, then, y), casadi.vertcat(g, dg)]
    return casadi.Function("sample", given, [casadi.densify(part) for part in results], {"cse": True})
