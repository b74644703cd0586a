"""The filter along one record, how it moves with its numbers, and what it predicts: rows for `FilterCode`."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import IMAGINARY, Array
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import N_DISTURBANCES, FilterGain, FilterState, StochasticModel
from swashplate.filtering.filter_code import Along, Fixed, Onward, Pushed, RecordSeries
from swashplate.filtering.filter_library import filter_code
from swashplate.identification.time.beginning import (
    Begun,
    FilterNumbers,
    first_state,
    numbers_and_constants,
    numbers_moved,
)


class FilterRun(NamedTuple):
    """Innovations (n, n_outputs) and the states after each reading; what the code keeps of the run for its slopes."""

    innovations: Array
    states: FilterState
    went: Array


class Moves(NamedTuple):
    """Directions in which a run's numbers move, which come first in every part.

    Attributes:
        begin, numbers: how its beginning and its numbers move.
        arriving: the first of the directions that move the commands. commands: how they do (directions, n, inputs).
    """

    begin: Begun
    numbers: FilterNumbers
    arriving: int
    commands: Array


class RecordFilter:
    """One model's filter.

    Args:
        model: whose.
    """

    def __init__(self, model: StochasticModel) -> None:
        self.model = model
        self._code = filter_code(model)
        self._n = len(model.vehicle.state_names)
        self._ends = np.cumsum([self._n, model.n_gusts])

    @property
    def compiled_by(self) -> str:
        """What runs it: "C" or "NumPy"."""
        return self._code.compiled_by

    def along(self, begin: Begun, numbers: FilterNumbers, series: RecordSeries) -> FilterRun:
        """Innovations and the states after each reading."""
        innovations, states, went = self._code.along(self.model.dt, self._fixed(begin, numbers), series)
        return FilterRun(innovations, self._state(states), went)

    def run_slopes(
        self,
        begin: Begun,
        numbers: FilterNumbers,
        series: RecordSeries,
        run: FilterRun,
        moves: Moves,
        marks: Sequence[int] = (),
    ) -> tuple[Array, FilterState]:
        """Slopes of a run's innovations (directions, n, n_outputs), and of the states after some of the readings.

        Args:
            begin, numbers, series: as of `along`. run: its.
            moves: in which directions.
            marks: samples, ascending, whose states' slopes are wanted (directions, marks, ...).
        """
        to = moves.numbers
        directions = Fixed(
            _row(first_state(self.model, moves.begin.x, to.nuisance)),
            self._given_moved(moves.begin.gain, numbers, to),
            numbers_moved(self.model.vehicle, to.parameters),
        )
        along = Along(directions, moves.arriving, moves.commands, np.asarray(marks, dtype=np.intp))
        slopes, states = self._code.filter_slopes(self.model.dt, self._fixed(begin, numbers), series, run.went, along)
        return slopes, self._state(states)

    def ahead_of(
        self,
        states: FilterState,
        numbers: FilterNumbers,
        driving: Array,
        starts: NDArray[np.intp],
        ahead: int,
        kicks: Array | None = None,
    ) -> Array:
        """States 1, 2, ... samples after some starts, with nothing measured any more (starts, ahead, states).

        Args:
            states: at the starts. numbers: of the filter.
            driving: by sample (n, inputs + 4), `ahead` of them beyond the last start.
            starts: samples. ahead: how many samples to predict.
            kicks: what is added to the joined states after every sample, nose north (starts, ahead, joined).
        """
        onward = self._onward(states, numbers)
        return self._code.ahead(self.model.dt, starts, onward, driving, ahead, kicks)

    def step(self, x: Array, gust: Array, drift: Array, commands: Array, voltage: Array, numbers: Array) -> Array:
        """States (rows, states) one sample later.

        Args:
            x, gust, drift: of each row. commands, voltage: (rows, inputs) and (rows,).
            numbers: of `numbers_and_constants`, of all rows or of each.
        """
        return self._code.step(self.model.dt, x, _pushed(gust, drift, commands, voltage), numbers)

    def ahead_moved(
        self,
        states: FilterState,
        slopes: FilterState,
        numbers: FilterNumbers,
        series: RecordSeries,
        moves: Moves,
        starts: NDArray[np.intp],
        steps: Sequence[int],
    ) -> tuple[Array, Array]:
        """States after `steps` samples from some starts (starts, steps, states), and their slopes (directions, ...).

        Args:
            states: at the starts, and `slopes` of them, of `run_slopes`.
            numbers, series: as of `along`. moves: in which directions.
            starts: samples. steps: how far to predict, ascending.
        """
        fading = self._fading(numbers.noise, moves.numbers.noise)[1]
        along = Onward(_row(slopes), fading, numbers_moved(self.model.vehicle, moves.numbers.parameters))
        onward, of = self._onward(states, numbers), np.asarray(steps, dtype=np.intp)
        directions = along, moves.arriving, moves.commands
        return self._code.ahead_moved(self.model.dt, starts, onward, series.driving, of, directions)

    def _onward(self, states: FilterState, numbers: FilterNumbers) -> Onward:
        fade = self.model.fade(Noise(*numbers.noise))
        return Onward(_row(states), fade, numbers_and_constants(self.model.vehicle, numbers.parameters))

    def _fixed(self, begin: Begun, numbers: FilterNumbers) -> Fixed:
        fade = self.model.fade(Noise(*numbers.noise))
        given = np.concatenate([_gain(begin.gain).ravel(), numbers.nuisance, fade])
        start = _row(first_state(self.model, begin.x, numbers.nuisance))
        return Fixed(start, given, numbers_and_constants(self.model.vehicle, numbers.parameters))

    def _state(self, rows: Array) -> FilterState:
        return FilterState(*np.split(rows, self._ends, axis=-1))

    def _given_moved(self, gain: FilterGain, numbers: FilterNumbers, directions: FilterNumbers) -> Array:
        rows, count = _gain(gain), len(directions.noise)
        fading = self._fading(numbers.noise, directions.noise)[1]
        return np.concatenate([rows.reshape(count, -1), directions.nuisance, fading], axis=1)

    def _fading(self, noise: Array, directions: Array) -> tuple[Array, Array]:
        """What is left of gusts after a sample, and its slopes along directions of the noise."""
        fade = self.model.fade(Noise(*noise))
        stepped = self.model.fade(Noise(*(noise + 1j * IMAGINARY * directions).T))
        return fade, np.imag(stepped) / IMAGINARY


def _pushed(gust: Array, drift: Array, commands: Array, voltage: Array) -> Pushed:
    """What drives a step (..., inputs + 4) and pushes the body (..., 6), of gusts that act with drifts."""
    wind = gust[..., N_DISTURBANCES:]
    air = np.concatenate([wind, np.zeros((*gust.shape[:-1], 3 - wind.shape[-1]))], axis=-1)
    return Pushed(np.concatenate([commands, air, voltage[..., None]], axis=-1), gust[..., :N_DISTURBANCES] + drift)


def _row(state: FilterState) -> Array:
    return np.concatenate(state, axis=-1)


def _gain(gain: FilterGain) -> Array:
    """The joined gain (..., joined, outputs)."""
    return np.concatenate([gain.state, gain.gust, gain.drift], axis=-2)


@lru_cache(maxsize=16)
def record_filter(model: StochasticModel) -> RecordFilter:
    """A model's filter, made once."""
    return RecordFilter(model)
