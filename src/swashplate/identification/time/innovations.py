"""The innovations of one record as a function of one row of numbers: what a row means for the filter along it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import IMAGINARY, Array, Complex
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import FilterState, StochasticModel
from swashplate.filtering.filter_code import RecordSeries, driving_rows
from swashplate.filtering.following import COMPLEX_ARRAYS
from swashplate.filtering.nuisance import Nuisance, commands_by, commands_moved
from swashplate.identification.core.parameters import Layout
from swashplate.identification.time.beginning import (
    Begun,
    FilterNumbers,
    FirstMotion,
    begun,
    begun_moved,
    starting_samples,
)
from swashplate.identification.time.record_filter import FilterRun, Moves, RecordFilter, record_filter


@dataclass(frozen=True)
class FilterPlan:
    """What compiled code depends on: everything but numbers.

    Attributes:
        model: the stochastic model.
        layout: where a row's parameters go.
        logs: how many flights have nuisances of their own.
        nuisances: what is estimated of each of them.
        noises: what is estimated of the noise.
    """

    model: StochasticModel
    layout: Layout
    logs: int
    nuisances: tuple[str, ...]
    noises: tuple[str, ...]


class Filtered(NamedTuple):
    """A record's run: commands as they arrive, the numbers that it depends on, its beginning, and the filter's run."""

    commands: Array
    numbers: FilterNumbers
    begin: Begun
    run: FilterRun

    @property
    def innovations(self) -> Array:
        """Innovations (n, n_outputs)."""
        return self.run.innovations

    @property
    def states(self) -> FilterState:
        """States after each reading."""
        return self.run.states


@dataclass(frozen=True)
class RecordRun:
    """One record as the filter runs along it.

    Attributes:
        plan: of the fit.
        log: which flight it is of.
        readings, inputs, voltage: by sample.
        motion: of its beginning.
    """

    plan: FilterPlan
    log: int
    readings: Array
    inputs: Array
    voltage: Array
    motion: FirstMotion

    def placed(self, card: Array, noise: Array, numbers: Array) -> tuple[Array, FilterNumbers]:
        """Commands as they arrive, and what the filter depends on, at a row of numbers in their units.

        Args:
            card: parameters of the card. noise: numbers of `Noise` where they are not estimated.
            numbers: the row.
        """
        model = self.plan.model
        k, n, m = len(self.plan.layout.free), self.plan.logs, len(self.plan.nuisances)
        nuisance, noise = np.zeros(len(Nuisance._fields)), noise.copy()
        nuisance[_places(Nuisance, self.plan.nuisances)] = numbers[k + self.log * m : k + (self.log + 1) * m]
        noise[_places(Noise, self.plan.noises)] = np.exp(numbers[k + n * m :])
        reaching, _ = commands_moved(model.vehicle, model.dt, self.inputs, Nuisance(*nuisance))
        parameters = np.array(self.plan.layout.values(card, numbers[:k]))
        starting = reaching[: starting_samples(model.dt)].mean(axis=0)
        return reaching, FilterNumbers(parameters, noise, nuisance, starting)

    def filtered(self, card: Array, noise: Array, numbers: Array, near: Filtered | None = None) -> Filtered:
        """The run at a row, of arguments as `placed` has them; `near`, another run, may have the same gain."""
        reaching, at = self.placed(card, noise, numbers)
        begin = begun(self.plan.model, at, self.motion, None if near is None else (near.numbers, near.begin.gain))
        run = self._filter.along(begin, at, self._series(reaching))
        return Filtered(reaching, at, begin, run)

    def innovation_slopes(self, run: Filtered, card: Array, numbers: Array, scale: Array) -> tuple[Array, Array]:
        """Slopes by every scaled entry of the row: innovations (p, n, outputs), covariance (p, outputs, outputs)."""
        moves = self._moves(run, card, numbers, scale, len(numbers))
        slopes, _ = self._filter.run_slopes(run.begin, run.numbers, self._series(run.commands), run.run, moves)
        return slopes, np.asarray(moves.begin.gain.covariance)

    def ahead(self, run: Filtered, starts: Sequence[int], steps: Sequence[int]) -> Array:
        """Measured less predicted after `steps` samples from each start (starts, steps, outputs)."""
        at, of = np.asarray(starts, dtype=np.intp), np.asarray(steps, dtype=np.intp)
        driving = self._series(run.commands).driving
        states = self._filter.ahead_of(run.states.at(at), run.numbers, driving, at, int(of[-1]))[:, of - 1]
        return self.readings[at[:, None] + of] - np.real(self._measured(states, Nuisance(*run.numbers.nuisance)))

    def ahead_moved(
        self,
        run: Filtered,
        starts: Sequence[int],
        steps: Sequence[int],
        given: tuple[Array, Array, Array],
        count: int,
    ) -> tuple[Array, Array]:
        """The same, and its slopes by the first `count` entries of the scaled row (entries, starts, ...).

        Args:
            run, starts, steps: as of `ahead`. given: the card's parameters, numbers and scale of the row.
        """
        at, of = np.asarray(starts, dtype=np.intp), np.asarray(steps, dtype=np.intp)
        moves, series = self._moves(run, *given, count), self._series(run.commands)
        _, by_start = self._filter.run_slopes(run.begin, run.numbers, series, run.run, moves, starts)
        states, slopes = self._filter.ahead_moved(run.states.at(at), by_start, run.numbers, series, moves, at, steps)
        nuisance, to = run.numbers.nuisance, moves.numbers.nuisance
        errors = self.readings[at[:, None] + of] - np.real(self._measured(states, Nuisance(*nuisance)))
        aside = Nuisance(*(nuisance + 1j * IMAGINARY * to).T[..., None, None])
        return errors, -np.imag(self._measured(states + 1j * IMAGINARY * slopes, aside)) / IMAGINARY

    def _measured(self, states: Complex | Array, nuisance: Nuisance) -> Complex:
        """The measured channels of states (..., states), in the last axis too; imaginary parts are slopes."""
        readings = self.plan.model.measure(np.moveaxis(states, -1, 0), nuisance, COMPLEX_ARRAYS)
        return np.moveaxis(readings, 0, -1)

    def _series(self, commands: Array) -> RecordSeries:
        return RecordSeries(self.readings, driving_rows(commands, self.voltage))

    @property
    def _filter(self) -> RecordFilter:
        return record_filter(self.plan.model)

    def _moves(self, run: Filtered, card: Array, numbers: Array, scale: Array, count: int) -> Moves:
        """How the run's numbers move along the first `count` entries of the scaled row."""
        model, k, m, p = self.plan.model, len(self.plan.layout.free), len(self.plan.nuisances), len(numbers)
        slopes = commands_moved(model.vehicle, model.dt, self.inputs, Nuisance(*run.numbers.nuisance))[1]
        by_command = commands_by(model.vehicle, slopes, self.plan.nuisances)
        place, noises = k + self.log * m, _places(Noise, self.plan.noises)
        directions = FilterNumbers(
            np.zeros((p, len(run.numbers.parameters))),
            np.zeros((p, len(run.numbers.noise))),
            np.zeros((p, len(run.numbers.nuisance))),
            np.zeros((p, len(run.numbers.inputs))),
        )
        directions.parameters[:k] = self.plan.layout.value_slopes(card, numbers[:k])
        directions.nuisance[np.arange(place, place + m), _places(Nuisance, self.plan.nuisances)] = 1.0
        directions.noise[np.arange(p - noises.size, p), noises] = run.numbers.noise[noises]
        directions.inputs[place : place + m] = by_command[:, : starting_samples(model.dt)].mean(axis=1)
        directions = FilterNumbers(*(scale[:count, None] * part[:count] for part in directions))
        begin = begun_moved(model, run.numbers, self.motion, directions)
        slopes = by_command * scale[place : place + m, None, None]
        return Moves(begin, directions, place, slopes[: max(0, count - place)])


def _places(of: type[Noise | Nuisance], names: Sequence[str]) -> NDArray[np.intp]:
    return np.array([of._fields.index(name) for name in names], dtype=np.intp)
