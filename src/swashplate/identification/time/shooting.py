"""Windows simulated from their own starts, and how they move, by the filter with a gain of zero.

Without a gain the filter is the simulation: what it is told to expect is what the model would measure. It carries the
slopes of its innovations along; told to read just what it expects, these are the slopes of the outputs, in the axes of
the simulated heading.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swashplate.arrays import Array
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import N_DISTURBANCES, FilterGain, StochasticModel
from swashplate.filtering.filter_code import RecordSeries, driving_rows
from swashplate.filtering.nuisance import Nuisance, commands_by, commands_moved
from swashplate.identification.core.parameters import Layout
from swashplate.identification.time.beginning import (
    Begun,
    FilterNumbers,
    FirstMotion,
    starting_row,
    starting_row_moved,
)
from swashplate.identification.time.kinematics import turned_rows
from swashplate.identification.time.record_filter import FilterRun, Moves, record_filter
from swashplate.physics.backend import ArrayBackend

_XP = ArrayBackend()


@dataclass(frozen=True)
class ShootingPlan:
    """What the simulation of windows depends on: everything but numbers.

    Attributes:
        model: the vehicle's equations and what is measured.
        layout: where a row's parameters go.
        nuisances: what is estimated of each flight.
        drifting: which of these every window moves by a number of its own, behind the corrections of its states.
        length: samples of a window.
        shared: how many entries of the row all windows share.
    """

    model: StochasticModel
    layout: Layout
    nuisances: tuple[str, ...]
    drifting: tuple[str, ...]
    length: int
    shared: int


@dataclass(frozen=True)
class Window:
    """One window of a record.

    Attributes:
        log: which flight it is of.
        first: its first sample in the record.
        inputs: of the whole record: delays reach beyond the window.
        voltage: by sample of the window.
        motion: of its beginning.
    """

    log: int
    first: int
    inputs: Array
    voltage: Array
    motion: FirstMotion


@dataclass(frozen=True)
class FlownWindow:
    """A window as it was simulated at a row.

    Attributes:
        numbers: what it depends on. begin: where it begins.
        commands: as they arrive. command_slopes: their slopes by the delay.
        run: of the filter. outputs: what the model measures (n, outputs).
    """

    numbers: FilterNumbers
    commands: Array
    command_slopes: Array
    begin: Begun
    run: FilterRun
    outputs: Array


class Shooting:
    """All windows of a fit.

    Args:
        plan: of the fit.
        windows: in the order of the row.
        card: parameters of the card.
        scale, own_scale: of the row's shared entries, and of the entries of a window.
    """

    def __init__(
        self,
        plan: ShootingPlan,
        windows: tuple[Window, ...],
        *,
        card: Array,
        scale: Array,
        own_scale: Array,
    ) -> None:
        self._plan, self._windows = plan, windows
        self._filter = record_filter(plan.model)
        self._card, self._scale, self._own_scale = card, scale, own_scale
        self._nuisances = np.array([Nuisance._fields.index(name) for name in plan.nuisances], dtype=np.intp)
        self._drifting = np.array([Nuisance._fields.index(name) for name in plan.drifting], dtype=np.intp)
        self._noise = np.array(Noise(), dtype=np.float64)

    def simulate_windows(self, row: Array) -> list[FlownWindow]:
        """Every window as simulated at a scaled row."""
        return [self._simulate_window(window, *self._parts(row, place)) for place, window in enumerate(self._windows)]

    def output_slopes(self, row: Array, windows: list[FlownWindow]) -> Array:
        """Slopes of the outputs by the shared entries and by the window's own (windows, entries, n, outputs)."""
        shared = row[: self._plan.shared] * self._scale
        return np.array([self._window_slopes(*each, shared) for each in zip(self._windows, windows, strict=True)])

    def _parts(self, row: Array, place: int) -> tuple[Array, Array]:
        """The shared numbers and those of a window, in their units."""
        shared, size = self._plan.shared, self._own_scale.size
        numbers = row[shared + place * size : shared + (place + 1) * size]
        return row[:shared] * self._scale, numbers * self._own_scale

    def _simulate_window(self, window: Window, shared: Array, starts: Array) -> FlownWindow:
        model, n = self._plan.model, len(self._plan.model.vehicle.state_names)
        k, m = len(self._plan.layout.free), self._nuisances.size
        nuisance = np.zeros(len(Nuisance._fields))
        nuisance[self._nuisances] = shared[k + window.log * m : k + (window.log + 1) * m]
        nuisance[self._drifting] += starts[n:]
        reaching, slopes = commands_moved(model.vehicle, model.dt, window.inputs, Nuisance(*nuisance))
        here = slice(window.first, window.first + self._plan.length)
        parameters = np.array(self._plan.layout.values(self._card, shared[:k]), dtype=np.float64)
        numbers = FilterNumbers(parameters, self._noise, nuisance, reaching[window.first])
        begin = Begun(self._no_gain(), starting_row(model, numbers, window.motion) + starts[:n])
        nothing = np.zeros((self._plan.length, model.n_outputs))
        run = self._filter.along(begin, numbers, RecordSeries(nothing, driving_rows(reaching[here], window.voltage)))
        outputs = np.asarray(model.measure(run.states.x.T, Nuisance(*nuisance), _XP)).T
        return FlownWindow(numbers, reaching[here], slopes[here], begin, run, outputs)

    def _window_slopes(self, window: Window, simulated: FlownWindow, shared: Array) -> Array:
        """Directions of the filter: parameters, the flight's numbers, the window's drifts, its states."""
        plan, model, numbers = self._plan, self._plan.model, simulated.numbers
        n, k, m, d = len(model.vehicle.state_names), len(plan.layout.free), self._nuisances.size, self._drifting.size
        count, at = k + m + d + n, k + window.log * m
        scale = np.concatenate([self._scale[:k], self._scale[at : at + m], self._own_scale[n:], self._own_scale[:n]])
        by_command = commands_by(model.vehicle, simulated.command_slopes, (*plan.nuisances, *plan.drifting))
        parts = FilterNumbers(*(np.zeros((count, np.size(part))) for part in numbers))
        parts.parameters[:k] = plan.layout.value_slopes(self._card, shared[:k])
        for i, place in enumerate([*self._nuisances, *self._drifting]):
            parts.nuisance[k + i, place] = 1.0
        parts.inputs[k : k + m + d] = by_command[:, 0]
        directions = FilterNumbers(*(scale[:, None] * part for part in parts))
        begins = np.zeros((count, n))
        begins[: k + m + d] = starting_row_moved(
            model, numbers, window.motion, FilterNumbers(*(part[: k + m + d] for part in directions))
        )
        begins[k + m + d :] = np.diag(scale[k + m + d :])
        by_delay = by_command * scale[k : k + m + d, None, None]
        series = RecordSeries(simulated.outputs, driving_rows(simulated.commands, window.voltage))
        moves = Moves(Begun(self._no_gain(count), begins), directions, k, by_delay)
        slopes = -self._filter.run_slopes(simulated.begin, numbers, series, simulated.run, moves)[0]
        heading = simulated.run.states.x[:, model.vehicle.index("psi")]
        slopes = turned_rows(slopes, model.output_names, heading)
        every = np.zeros((plan.shared + n + d, *slopes.shape[1:]))
        every[:k], every[at : at + m] = slopes[:k], slopes[k : k + m]
        every[plan.shared : plan.shared + n], every[plan.shared + n :] = slopes[k + m + d :], slopes[k + m : k + m + d]
        return every

    def _no_gain(self, *front: int) -> FilterGain:
        model = self._plan.model
        joined = len(model.vehicle.state_names) + model.n_gusts + N_DISTURBANCES
        return model.gain_of(np.zeros((*front, joined, model.n_outputs)), np.eye(model.n_outputs))
