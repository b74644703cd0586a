"""A filter along a record without a C compiler: CasADi's virtual machine and NumPy, the same equations as `filter_c`.

The states that a run went through are known when its slopes are asked for. So the slopes of the equations at all
samples are taken side by side (`engine/on_arrays.py`), and what goes along the record only multiplies matrices.
"""

from __future__ import annotations

from functools import cached_property, lru_cache

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.equations import Equations
from swashplate.engine.graph import Graph
from swashplate.engine.on_arrays import OnArrays
from swashplate.engine.roots import require_casadi
from swashplate.engine.trace import unrolled_rates
from swashplate.filtering.disturbed_model import N_DISTURBANCES, StochasticModel
from swashplate.filtering.filter_c import correction
from swashplate.filtering.filter_code import Along, Fixed, Followed, Following, Pushed, RecordSeries
from swashplate.filtering.following import followed

_FRACTIONS, _WEIGHTS = (0.0, 0.5, 0.5, 1.0), (1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0)
_STRETCH = 512
"""Samples whose slopes are held at a time."""


class VirtualFilter:
    """`filter_code.FilterCode` by NumPy and CasADi.

    Args:
        model: whose filter.

    Raises:
        ExportError: for equations that CasADi cannot trace.
        MissingLibraryError: without CasADi.
    """

    compiled_by = "NumPy"

    def __init__(self, model: StochasticModel) -> None:
        self._model = model
        self._n, self._m = len(model.vehicle.state_names), len(model.vehicle.input_names)
        self._rates = OnArrays(unrolled_rates(model.equations))
        self._pushed = np.eye(self._n)[:, model.disturbed]

    # ---- along a record ----------------------------------------------------------------------------------------
    def along(self, dt: float, fixed: Fixed, series: RecordSeries) -> tuple[Array, Array, Array]:
        casadi, n = require_casadi(), len(series.readings)
        rows = (*(part.T for part in series), np.tile(fixed.given[:, None], n))
        parts = self._sample.mapaccum(n)(fixed.start, *rows, np.tile(fixed.numbers[:, None], n))
        following, innovations, corrected = (np.asarray(casadi.DM(part).full()).T for part in parts)
        return innovations, corrected, np.concatenate([fixed.start[None], following[:-1]])

    @cached_property
    def _sample(self) -> Graph:
        """(predicted state, reading, what drives, given, numbers) to the next predicted state, the innovation and
        the corrected state."""
        casadi, model, dt = require_casadi(), self._model, self._model.dt
        correct, rates = correction(model), unrolled_rates(model.equations)
        s, y, g = (casadi.SX.sym(name, correct.size1_in(i)) for i, name in enumerate("syg"))
        row, p = casadi.SX.sym("w", rates.size1_in(1)), casadi.SX.sym("p", rates.size1_in(2))
        nu, corrected, acting, rest = correct(s, y, g)
        wind = acting[N_DISTURBANCES:] if model.windy else casadi.SX.zeros(2)
        w = row + casadi.vertcat(casadi.SX.zeros(self._m), wind, 0.0, 0.0)
        push = casadi.mtimes(casadi.DM(self._pushed), acting[:N_DISTURBANCES])
        x = total = corrected[: self._n]
        k = casadi.SX.zeros(self._n)
        for fraction, weight in zip(_FRACTIONS, _WEIGHTS, strict=True):
            k = rates(x + fraction * dt * k, w, p) + push
            total = total + weight * dt * k
        return casadi.Function("sample", [s, y, row, g, p], [casadi.vertcat(total, rest), nu, corrected])

    def filter_slopes(
        self, dt: float, fixed: Fixed, series: RecordSeries, went: Array, along: Along
    ) -> tuple[Array, Array]:
        model, directions, arriving, commands, marks = self._model, *along
        n, count, y, joined = len(went), len(directions.start), model.n_outputs, fixed.start.size
        slopes, states = np.empty((count, n, y)), np.empty((count, len(marks), joined))
        ends = np.cumsum([y, joined, model.n_gusts]).tolist()
        ds = directions.start.T
        for first in range(0, n, _STRETCH):
            here = slice(first, min(first + _STRETCH, n))
            by_state, by_given, (corrected, acting) = self._corrected(
                went[here], series.readings[here], fixed, directions
            )
            w = series.driving[here].copy()
            w[:, self._m : self._m + model.n_gusts - N_DISTURBANCES] += acting[:, N_DISTURBANCES:]
            pushed = Pushed(w, acting[:, :N_DISTURBANCES])
            planes, further = self._planes(dt, corrected[:, : self._n], pushed, fixed.numbers, directions.numbers)
            for k, i in enumerate(range(here.start, here.stop)):
                change = by_state[k] @ ds + by_given[k]
                d_nu, d_corrected, d_acting, d_rest = np.split(change, ends)
                slopes[:, i] = d_nu.T
                states[:, marks == i] = d_corrected.T[:, None]
                d_w = np.zeros((self._m + 4, count))
                d_w[: self._m, arriving : arriving + len(commands)] = commands[:, i].T
                d_w[self._m : self._m + model.n_gusts - N_DISTURBANCES] = d_acting[N_DISTURBANCES:]
                at = np.concatenate([d_corrected[: self._n], d_w, d_acting[:N_DISTURBANCES]])
                ds = np.concatenate([planes[k] @ at + further[k], d_rest])
        return slopes, states

    def _corrected(
        self, states: Array, readings: Array, fixed: Fixed, directions: Fixed
    ) -> tuple[Array, Array, tuple[Array, Array]]:
        """Slopes of a correction's results by the predicted state (rows, results, joined) and along the directions of
        what is given (rows, results, count); the corrected states and what acts."""
        _, corrected, acting, _, by_state = self._correction(states, readings, fixed.given)
        by_given = [self._given_moved(states, readings, fixed.given, given)[0] for given in directions.given]
        return by_state, np.stack(by_given, axis=2), (corrected, acting)

    @cached_property
    def _correction(self) -> OnArrays:
        casadi, correct = require_casadi(), correction(self._model)
        s, y, g = (casadi.SX.sym(name, correct.size1_in(i)) for i, name in enumerate("syg"))
        results = correct(s, y, g)
        by_state = casadi.jacobian(casadi.vertcat(*results), s)
        return OnArrays(casadi.Function("correction", [s, y, g], [*results, by_state], {"cse": True}))

    @cached_property
    def _given_moved(self) -> OnArrays:
        casadi, correct = require_casadi(), correction(self._model)
        s, y, g = (casadi.SX.sym(name, correct.size1_in(i)) for i, name in enumerate("syg"))
        dg = casadi.SX.sym("dg", g.size1())
        slopes = casadi.jtimes(casadi.vertcat(*correct(s, y, g)), g, dg)
        return OnArrays(casadi.Function("given", [s, y, g, dg], [slopes], {"cse": True}))

    # ---- steps -------------------------------------------------------------------------------------------------
    def step(self, dt: float, x: Array, pushed: Pushed, numbers: Array) -> Array:
        k, after, push = np.zeros_like(x), np.array(x), pushed.push @ self._pushed.T
        for fraction, weight in zip(_FRACTIONS, _WEIGHTS, strict=True):
            k = self._rates(x + fraction * dt * k, pushed.driving, numbers)[0] + push
            after += weight * dt * k
        return after

    def step_moved(
        self, dt: float, x: Array, pushed: Pushed, numbers: Array, directions: tuple[Array, Pushed, Array]
    ) -> tuple[Array, Array]:
        dx, d_pushed, d_numbers = directions
        planes, further = self._planes(dt, x, pushed, numbers, d_numbers)
        at = np.concatenate([dx, d_pushed.driving, d_pushed.push], axis=2).transpose(1, 2, 0)
        return self.step(dt, x, pushed, numbers), (planes @ at + further).transpose(2, 0, 1)

    def _planes(self, dt: float, x: Array, pushed: Pushed, numbers: Array, along: Array) -> tuple[Array, Array]:
        """Slopes of a step by states, driving and push (rows, states, all three), and along directions of the numbers
        (rows, states, count)."""
        n, w, count = self._n, pushed.driving.shape[1], len(along)
        unit = np.broadcast_to(np.eye(n, n + w + N_DISTURBANCES + count), (len(x), n, n + w + N_DISTURBANCES + count))
        k, by_k, total, push = np.zeros_like(x), np.zeros(unit.shape), unit.copy(), pushed.push @ self._pushed.T
        used = np.flatnonzero(np.any(along != 0.0, axis=0))
        slopes = _slopes(self._model.equations, tuple(used.tolist()))
        for fraction, weight in zip(_FRACTIONS, _WEIGHTS, strict=True):
            rates, by_x, by_w, by_p = slopes(x + fraction * dt * k, pushed.driving, numbers)
            k = rates + push
            by_k = by_x @ (unit + fraction * dt * by_k)
            by_k[:, :, n : n + w] += by_w
            by_k[:, :, n + w : n + w + N_DISTURBANCES] += self._pushed
            if used.size:
                by_k[:, :, n + w + N_DISTURBANCES :] += by_p.reshape(len(x), n, used.size) @ along[:, used].T
            total += weight * dt * by_k
        return total[:, :, : n + w + N_DISTURBANCES], total[:, :, n + w + N_DISTURBANCES :]

    def follow(self, dt: float, begin: Following, series: RecordSeries) -> Followed:
        return followed(self._model, self, begin, series)

    def rates(self, x: Array, w: Array, p: Array) -> Array:
        return self._rates(*(part.reshape(-1, part.shape[-1]) for part in (x, w, p)))[0].reshape(x.shape)

    def rates_and_slopes(self, x: Array, w: Array, p: Array) -> tuple[Array, Array, Array]:
        front, flat = x.shape[:-1], (part.reshape(-1, part.shape[-1]) for part in (x, w, p))
        rates, by_x, by_w, _ = _slopes(self._model.equations, ())(*flat)
        return rates.reshape(*front, -1), by_x.reshape(*front, *by_x.shape[1:]), by_w.reshape(*front, *by_w.shape[1:])


@lru_cache(maxsize=32)
def _slopes(equations: Equations, of_numbers: tuple[int, ...]) -> OnArrays:
    """(x, w, p) to the rates, and their slopes by x, by w and by some of p."""
    casadi, rates = require_casadi(), unrolled_rates(equations)
    x, w, p = (casadi.SX.sym(name, rates.size1_in(i)) for i, name in enumerate("xwp"))
    values = casadi.densify(rates(x, w, p))
    seeds = [casadi.SX(casadi.DM(unit)) for unit in np.eye(p.size1())[list(of_numbers)]]
    by_p = [casadi.jtimes(values, p, seed) for seed in seeds] or [casadi.SX(values.size1(), 1)]
    results = [values, casadi.jacobian(values, x), casadi.jacobian(values, w), casadi.horzcat(*by_p)]
    return OnArrays(casadi.Function("slopes", [x, w, p], results, {"cse": True}))
