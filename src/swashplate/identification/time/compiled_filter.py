"""The filter along a record by a C compiler's code, where there is one: the same numbers as `record_filter`'s, sooner.

Chosen by measurement (decision 139). Without a C compiler or CasADi, and for equations that cannot be printed as C, the
filter is XLA's.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import IMAGINARY, Array
from swashplate.engine.equations import CONSTANTS
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import N_DISTURBANCES, FilterGain, FilterState, StochasticModel
from swashplate.filtering.filter_library import FilterLibrary, filter_library, flat
from swashplate.identification.time.beginning import Begun, FilterNumbers, first_state, numbers_and_constants


class FilterRun(NamedTuple):
    """Innovations (n, n_outputs) and the states after each reading; in C, the roots that the steps found."""

    innovations: Array
    states: FilterState
    roots: Array | None = None


class CompiledFilter:
    """C of one model's filter; arguments are those of the functions of `record_filter`.

    Args:
        model: whose filter. library: its C.
    """

    def __init__(self, model: StochasticModel, library: FilterLibrary) -> None:
        self.model = model
        self._c = library
        self._n = len(model.vehicle.state_names)
        self._ends = np.cumsum([self._n, model.n_gusts, N_DISTURBANCES])

    def along(self, begin: Begun, numbers: FilterNumbers, series: tuple[Array, Array, Array]) -> FilterRun:
        """`record_filter.along`, and the roots."""
        n, dt = len(series[0]), self.model.dt
        start = _row(first_state(self.model, begin.x, numbers.nuisance))
        innovations, states = np.empty((n, self.model.n_outputs)), np.empty((n, start.size))
        roots = np.empty((n, 4, self._c.roots))
        fixed = start, self._given(begin.gain, numbers), numbers_and_constants(self.model.vehicle, numbers.parameters)
        self._c.run_along(n, dt, *fixed, *map(flat, series), innovations, states, roots)
        return FilterRun(innovations, self._state(states), roots)

    def moved(
        self,
        begin: Begun,
        begin_moved: Begun,
        numbers: FilterNumbers,
        directions: FilterNumbers,
        series: tuple[Array, Array, Array],
        roots: Array,
        late: tuple[int, Array],
    ) -> Array:
        """`record_filter.moved`."""
        count, (n, m), vehicle = len(directions.parameters), series[0].shape, self.model.vehicle
        start = _row(first_state(self.model, begin.x, numbers.nuisance))
        moved = _row(first_state(self.model, begin_moved.x, directions.nuisance))
        fixed = start, self._given(begin.gain, numbers), numbers_and_constants(vehicle, numbers.parameters)
        places = [vehicle.parameter_names.index(a) if a in vehicle.parameter_names else None for a in CONSTANTS]
        still = np.zeros(count)
        around = [still if place is None else directions.parameters[:, place] for place in places]
        given_moved = self._given_moved(begin_moved.gain, numbers, directions)
        moving = moved, given_moved, np.column_stack([directions.parameters, *around])
        out, pushed = np.empty((count, n, m)), flat(late[1])
        for first in range(0, count, self._c.directions):
            given = *fixed, *map(flat, series), roots
            self._c.run_moved(
                n, self.model.dt, *given, first, count, *map(flat, moving), late[0], len(pushed), pushed, out
            )
        return out

    def ahead_of(
        self,
        states: FilterState,
        numbers: FilterNumbers,
        commands: Array,
        voltage: Array,
        starts: NDArray[np.intp],
        ahead: int,
    ) -> Array:
        """`record_filter.ahead_of`."""
        ahead_states = np.empty((len(starts), ahead, self._n))
        nothing = np.zeros((self._ends[-1] + self.model.n_line) * self.model.n_outputs + len(numbers.nuisance))
        given = np.concatenate([nothing, self._passing(np.asarray(numbers.noise))])
        told = _row(states), given, numbers_and_constants(self.model.vehicle, numbers.parameters), commands, voltage
        where = np.ascontiguousarray(starts, np.dtype("l"))
        self._c.run_ahead(len(starts), ahead, self.model.dt, *map(flat, told), where, ahead_states)
        return ahead_states

    def _state(self, rows: Array) -> FilterState:
        x, gust, drift, line = np.split(rows, self._ends, axis=-1)
        return FilterState(x, gust, drift, line if self.model.lined else ())

    def _given(self, gain: FilterGain, numbers: FilterNumbers) -> Array:
        return np.concatenate([_gain(gain).ravel(), numbers.nuisance, self._passing(numbers.noise)])

    def _given_moved(self, gain: FilterGain, numbers: FilterNumbers, directions: FilterNumbers) -> Array:
        rows, count = _gain(gain), len(directions.noise)
        passing = np.imag(self._passing(numbers.noise + 1j * IMAGINARY * directions.noise)) / IMAGINARY
        return np.concatenate([rows.reshape(count, -1), directions.nuisance, passing], axis=1)

    def _passing(self, noise: Array) -> Array:
        """What is left of gusts after a sample, and how the line turns (..., numbers)."""
        named = Noise(*np.moveaxis(noise, -1, 0))
        parts = [self.model.fade(named, np)]
        if self.model.lined:
            parts.append(self.model.line_turn(named, np).reshape(*noise.shape[:-1], -1))
        return np.concatenate(parts, axis=-1)


def _row(state: FilterState) -> Array:
    return np.concatenate([np.asarray(part) for part in state if not isinstance(part, tuple)], axis=-1)


def _gain(gain: FilterGain) -> Array:
    """The joined gain (..., joined, outputs)."""
    parts = (gain.state, gain.gust, gain.drift, gain.line)
    return np.concatenate([np.asarray(part) for part in parts if not isinstance(part, tuple)], axis=-2)


@lru_cache(maxsize=16)
def compiled_filter(model: StochasticModel) -> CompiledFilter | None:
    """A model's filter in C; None where it cannot be had here."""
    library = filter_library(model)
    return None if library is None else CompiledFilter(model, library)
