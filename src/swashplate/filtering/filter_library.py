"""The C of `filter_c`, compiled and loaded, where there is a compiler; otherwise the same by NumPy and CasADi."""

from __future__ import annotations

import ctypes
import math
from functools import cached_property, lru_cache, partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swashplate.arrays import Array
from swashplate.compiled import NATIVE, can_compile, loaded
from swashplate.engine.equations import Equations
from swashplate.engine.graph import Graph
from swashplate.engine.on_arrays import OnArrays
from swashplate.engine.roots import require_casadi
from swashplate.engine.trace import unrolled_rates
from swashplate.filtering.disturbed_model import N_DISTURBANCES, FilterState, StochasticModel
from swashplate.filtering.filter_c import correction, filter_source
from swashplate.filtering.filter_code import Along, FilterCode, Fixed, Followed, Following, Onward, Pushed, RecordSeries
from swashplate.filtering.following import followed

_FRACTIONS, _WEIGHTS = (0.0, 0.5, 0.5, 1.0), (1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0)
_STRETCH = 512
"""Samples whose slopes are held at a time."""


class VirtualFilter:
    """`filter_code.FilterCode` by NumPy and CasADi: the same equations as `filter_c`, without a C compiler.

    The states that a run went through are known when its slopes are asked for. So the slopes of the equations at all
    samples are taken side by side (`engine/on_arrays.py`), and what goes along the record only multiplies matrices.

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
        self._ends = np.cumsum([self._n, model.n_gusts])

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

    def ahead(
        self,
        dt: float,
        starts: NDArray[np.intp],
        onward: Onward,
        driving: Array,
        count: int,
        kicks: Array | None = None,
    ) -> Array:
        state, out = FilterState(*np.split(onward.states, self._ends, axis=1)), np.empty((len(starts), count, self._n))
        for k in range(count):
            after = self.step(dt, state.x, self._acting(state, driving[starts + k]), onward.numbers)
            state = FilterState(after, onward.fade * state.gust, state.drift)
            state = state if kicks is None else self._model.displace(state, kicks[:, k])
            out[:, k] = state.x
        return out

    def ahead_moved(
        self,
        dt: float,
        starts: NDArray[np.intp],
        onward: Onward,
        driving: Array,
        steps: NDArray[np.intp],
        directions: tuple[Onward, int, Array],
    ) -> tuple[Array, Array]:
        to, arriving, commands = directions
        state, way = (FilterState(*np.split(rows, self._ends, axis=-1)) for rows in (onward.states, to.states))
        d_driving, reached, slopes = np.zeros((len(to.fade), *driving[starts].shape)), [], []
        for k in range(steps[-1]):
            d_driving[arriving : arriving + len(commands), :, : self._m] = commands[:, starts + k]
            pushed, d_pushed = self._acting(state, driving[starts + k]), self._acting(way, d_driving)
            planes, further = self._planes(dt, state.x, pushed, onward.numbers, to.numbers)
            at = np.concatenate([way.x, d_pushed.driving, d_pushed.push], axis=2).transpose(1, 2, 0)
            fading = onward.fade * way.gust + to.fade[:, None] * state.gust
            way = FilterState((planes @ at + further).transpose(2, 0, 1), fading, way.drift)
            state = FilterState(self.step(dt, state.x, pushed, onward.numbers), onward.fade * state.gust, state.drift)
            if k + 1 in steps:
                reached.append(state.x)
                slopes.append(way.x)
        return np.stack(reached, axis=1), np.stack(slopes, axis=2)

    def _acting(self, state: FilterState, driving: Array) -> Pushed:
        """What drives with the wind of a state, and its pushes: gusts and drifts together."""
        wind, w = state.gust[..., N_DISTURBANCES:], driving.copy()
        w[..., self._m : self._m + wind.shape[-1]] += wind
        return Pushed(w, state.gust[..., :N_DISTURBANCES] + state.drift)

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
    "run_rates": "l" + 4 * "*",
    "rates_and_slopes": "l" + 6 * "*",
    "run_ahead": "lldi" + 4 * "*" + "l" + 2 * "*",
    "run_ahead_moved": "ldi" + 4 * "*" + "l" + 3 * "*" + "lll*li" + 2 * "*",
    "run_following": "lld" + 13 * "*",
}
"""By function, where the source has it."""


class FilterLibrary:
    """The functions of one filter's C.

    Args:
        source: the C. outputs: how many there are.

    Raises:
        ExportError: without a compiler, or where it refuses.
    """

    compiled_by = "C"

    def __init__(self, source: str, outputs: int) -> None:
        self._c = loaded(source, options=(*_OPTIONS, *_QUIET))
        for name in filter(partial(hasattr, self._c), _ARGUMENTS):
            function, kinds = getattr(self._c, name), _ARGUMENTS[name]
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
        at = longs(along.marks)
        for first in range(0, count, self._directions):
            where = first, count, *moving, along.arriving, len(pushed), pushed, slopes, len(at), at, states
            self._c.run_moved(n, dt, *here, *where)
        return slopes, states

    def step(self, dt: float, x: Array, pushed: Pushed, numbers: Array) -> Array:
        after = np.array(x, dtype=np.float64, order="C")
        self._c.run_steps(len(after), dt, int(numbers.ndim == 2), after, *map(flat, pushed), flat(numbers))
        return after

    def ahead(
        self,
        dt: float,
        starts: NDArray[np.intp],
        onward: Onward,
        driving: Array,
        count: int,
        kicks: Array | None = None,
    ) -> Array:
        given, n = tuple(map(flat, onward)), _states_of(onward)
        states, kicked = np.empty((len(starts), count, n)), flat([] if kicks is None else kicks)
        self._c.run_ahead(len(starts), count, dt, longs(starts), *given, flat(driving), kicked.size, kicked, states)
        return states

    def ahead_moved(
        self,
        dt: float,
        starts: NDArray[np.intp],
        onward: Onward,
        driving: Array,
        steps: NDArray[np.intp],
        directions: tuple[Onward, int, Array],
    ) -> tuple[Array, Array]:
        to, arriving, commands = directions
        rows, count, marks, n = len(starts), len(to.fade), len(steps), _states_of(onward)
        states, slopes = np.empty((rows, marks, n)), np.empty((count, rows, marks, n))
        given = *map(flat, onward), flat(driving), count, *map(flat, to)
        moving = arriving, len(commands), len(driving), flat(commands)
        self._c.run_ahead_moved(rows, dt, longs(starts), *given, *moving, marks, longs(steps), states, slopes)
        return states, slopes

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


def _states_of(onward: Onward) -> int:
    """How many of the joined states are the vehicle's."""
    return onward.states.shape[1] - onward.fade.size - N_DISTURBANCES


def longs(places: NDArray[np.intp]) -> NDArray[np.int_]:
    """Places as C reads them."""
    return np.ascontiguousarray(places, np.dtype("l"))


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
        return FilterLibrary(filter_source(model), model.n_outputs)
    return VirtualFilter(model)
