"""Prediction errors of a filter whose gain follows what is flown: for wind, which acts through the square of speed.

What wind does to a rotor grows with the air speed: nothing at rest, much in a gust. A constant gain answers to the
average. Where the air speed is small it then takes other noise for wind, and a noisy regressor makes its coefficient
too small, with bounds too narrow. An extended Kalman filter carries the covariance along instead (Jategaonkar 2015,
sec. 5.5), with slopes and means averaged over the air speed's own uncertainty (statistical linearisation, Gelb 1974,
sec. 6.2): the force of wind has a kink at rest, and a slope there would be zero. It begins with how far
off a record's first states may be, and goes on by itself where the pose was not seen.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import StochasticModel
from swashplate.filtering.filter_code import Followed, Following, RecordSeries, driving_rows
from swashplate.filtering.filter_library import filter_code
from swashplate.filtering.nuisance import Nuisance
from swashplate.filtering.riccati import covariances_beside, diagonal, steady_gain
from swashplate.identification.core.likelihood import Errors, Likelihood, MovedErrors, factor_of
from swashplate.identification.core.multi_step import Ahead, Places
from swashplate.identification.core.parameters import Parameterization
from swashplate.identification.core.records import Comparison, Record
from swashplate.identification.core.scoring import Optimum, Solver, minimise
from swashplate.identification.time.beginning import (
    FilterNumbers,
    FirstMotion,
    first_state,
    joined_at,
    numbers_and_constants,
    starting_rows,
    starting_samples,
)
from swashplate.identification.time.filter_error import FilterError
from swashplate.identification.time.innovations import Filtered, RecordRun
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.identification.time.start_states import measured_start, slopes_ahead
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import ArrayBackend
from swashplate.physics.rigid_body import RigidBody

_BODY, _ARRAYS = len(RigidBody._fields), ArrayBackend()

_STEP = 1e-4
"""Of a scaled entry, for slopes by differences."""


class FollowingError(FilterError):
    """`FilterError` with a gain that follows: some ten times the work, for wind; arguments are the same."""

    def __init__(self, table: Parameterization, pieces: Sequence[Record], *, noise: Noise) -> None:
        super().__init__(table, pieces, noise=noise)
        self._constant = FilterError(table, pieces, noise=noise)
        measured = [piece.measured for piece in pieces]
        self.counted = tuple(counted & known for counted, known in zip(self.counted, measured, strict=True))
        self._readings = tuple(
            np.where(known[:, None], piece.outputs, np.nan) for piece, known in zip(pieces, measured, strict=True)
        )

    @property
    def constant(self) -> FilterError:
        """The likelihood of the same row with a constant gain."""
        return self._constant

    @cached_property
    def _spread(self) -> tuple[Array, ...]:
        """How far off the states may be that each record begins with, (states, states)."""
        went = self._constant.runs(self.row.starts())
        return tuple(_off(self.table.vehicle, *each) for each in zip(self.records, self._runs, went, strict=True))

    def slope(self, row: Array) -> tuple[float, Array]:
        """Refused: samplers draw from a constant gain, which is another likelihood.

        Raises:
            IdentificationError: always.
        """
        raise IdentificationError(
            "the fit has a wind, whose likelihood (a gain that follows) NUTS does not draw from.",
            channel="posterior",
            hint="Take 'laplace', or fit the flight without --wind.",
        )

    def errors_of(self, row: Array) -> list[Errors]:
        return self._counted_errors(self._followed([row]))

    def moved_errors(self, row: Array) -> Iterator[MovedErrors]:
        """Slopes are differences of whole runs."""
        runs, places = self._followed([row, *(row + step for step in _STEP * np.eye(len(row)))]), np.arange(len(row))
        for run, counted, part in zip(runs, self.counted, self._counted_errors(runs), strict=True):
            nu, S = (np.compress(counted, rows, axis=1) for rows in (run.innovations, run.covariances))
            yield _with_slopes(part, places, (nu[1:] - nu[0]) / _STEP, (S[1:] - S[0]) / _STEP)

    def _moved_here(self, row: Array) -> Iterator[MovedErrors]:
        asked = np.asarray(row, dtype=np.float64).tobytes()
        if self._last is None or self._last[0] != asked:
            self._last = asked, list(self.moved_errors(row))
        return iter(self._last[1])

    def _counted_errors(self, runs: Sequence[Followed]) -> list[Errors]:
        return [
            Errors(number, run.innovations[0][counted], factor_of(run.covariances[0][counted]))
            for number, (run, counted) in enumerate(zip(runs, self.counted, strict=True))
        ]

    def comparisons(self, row: Array) -> tuple[Comparison, ...]:
        """Every record beside its one-step predictions; the bounds are those of the mean covariance."""
        kept = [self.table.vehicle.index(name) for name in PREDICTED]
        return tuple(
            Comparison(
                record=piece,
                counted=counted.astype(np.float64),
                model=piece.outputs - run.innovations[0],
                sigma=np.sqrt(np.diag(run.covariances[0][counted].mean(axis=0))),
                states=run.states[0][:, kept],
            )
            for piece, run, counted in zip(self.records, self._followed([row]), self.counted, strict=True)
        )

    def _followed(self, rows: Sequence[Array]) -> list[Followed]:
        """Every record's runs at some rows."""
        given = self.table.card_row, np.array(self.noise, dtype=np.float64)
        followed = []
        for run, readings, spread in zip(self._runs, self._readings, self._spread, strict=True):
            placed = [run.placed(*given, row * self.row.scale) for row in rows]
            commands = np.stack([reaching for reaching, _ in placed], axis=1)
            numbers = FilterNumbers(*map(np.stack, zip(*(numbers for _, numbers in placed), strict=True)))
            begin = following_from(self.model, numbers, run.motion, spread)
            followed.append(
                filter_code(self.model).follow(
                    self.model.dt, begin, RecordSeries(readings, driving_rows(commands, run.voltage))
                )
            )
        return followed


class CarriedSlopes(Likelihood):
    """A likelihood whose slopes are carried along a search, by what each step shows of them (secants: Broyden 1965).

    Slopes that are differences of whole runs cost a run for every entry; a secant costs none. Where a search that takes
    them ends, exact ones judge (`searched`).

    Args:
        base: the likelihood.
    """

    def __init__(self, base: Likelihood) -> None:
        self.row, self.records, self._base = base.row, base.records, base
        self._tried: tuple[bytes, list[Errors]] | None = None
        self._at: tuple[Array, list[MovedErrors], list[Array]] | None = None

    def errors_of(self, row: Array) -> list[Errors]:
        asked = np.asarray(row, dtype=np.float64).tobytes()
        if self._tried is None or self._tried[0] != asked:
            self._tried = asked, self._base.errors_of(row)
        return self._tried[1]

    def moved_errors(self, row: Array) -> Iterator[MovedErrors]:
        if self._at is None:
            exact = list(self._base._moved_here(row))
            self._at = np.array(row), exact, [_spreads_moved(part) for part in exact]
        before, carried, spreads = self._at
        way = row - before
        if np.any(way):
            weight = way * sum(np.sum(part.slopes**2, axis=(1, 2)) for part in carried)  # far in what shows most
            weight /= way @ weight
            parts = zip(carried, spreads, self.errors_of(row), strict=True)
            further = [_carried(part, dS, now, way, weight) for part, dS, now in parts]
            self._at = np.array(row), [part for part, _ in further], [dS for _, dS in further]
        return iter(self._at[1])

    def errors_ahead_moved(self, row: Array, ahead: Ahead, places: Places) -> tuple[list[Array], list[Array]]:
        return self._base.errors_ahead_moved(row, ahead, places)

    def comparisons(self, row: Array) -> tuple[Comparison, ...]:
        return self._base.comparisons(row)


def _with_slopes(part: Errors, places: NDArray[np.intp], slopes: Array, dS: Array) -> MovedErrors:
    """Errors with their slopes and those of their covariance by sample (entries, n, outputs, outputs)."""
    turned = part.inverse @ dS @ np.swapaxes(part.inverse, -1, -2)
    flat = turned.reshape(len(turned), -1)
    return MovedErrors(part.number, part.errors, part.factor, places, slopes, turned, (None, 0.5 * flat @ flat.T))


def _spreads_moved(part: MovedErrors) -> Array:
    """Slopes of the covariance."""
    assert part.turned is not None
    return np.asarray(part.factor @ part.turned @ np.swapaxes(part.factor, -1, -2))


def _carried(part: MovedErrors, dS: Array, now: Errors, way: Array, weight: Array) -> tuple[MovedErrors, Array]:
    """The slopes of a part where its errors and covariance are `now`, that way further, changed along it alone."""
    slopes = part.slopes + np.multiply.outer(weight, now.errors - part.errors - np.tensordot(way, part.slopes, 1))
    after, before = (factor @ np.swapaxes(factor, -1, -2) for factor in (now.factor, part.factor))
    further = np.multiply.outer(weight, after - before - np.tensordot(way, dS, 1))
    further += dS
    return _with_slopes(now, part.places, slopes, further), further


def searched(likelihood: FollowingError, solver: Solver, *, start: Array) -> Optimum:
    """The optimum of a likelihood with dear slopes: a step by exact ones, then searches by carried ones, each from the
    exact slopes where the last ended, until one gains too little to go on for.

    Args:
        likelihood, solver, start: as of `minimise`.
    """
    optimum = minimise(CarriedSlopes(likelihood), replace(solver, iterations=1), start=start)
    while True:
        done = len(optimum.history) - 1
        more = replace(solver.after(done), iterations=solver.iterations - done)
        further = minimise(CarriedSlopes(likelihood), more, start=optimum.row)
        settled = further.converged and optimum.cost - further.cost < solver.tolerance
        if not settled:
            optimum = replace(further, history=(*optimum.history, *further.history[1:]))
        if settled or not further.converged:
            return replace(optimum, information=likelihood.scores(optimum.row)[2], converged=settled)


def following_from(model: StochasticModel, numbers: FilterNumbers, first: FirstMotion, spread: Array) -> Following:
    """What filters of a record begin with and depend on: a filter that has settled in steady flight, its first states
    off as far as the spread says, and the air, of which nothing is known.

    Args:
        model: of the filters. numbers: by row. first: of the record's beginning.
        spread: how far off the states may be that it begins with, a second moment.
    """
    noise, n = Noise(*numbers.noise.T), len(spread)
    matrices, fade = joined_at(model, numbers, first), model.fade(noise)
    A, C, Q, R = (part[0] for part in matrices)
    P = steady_gain(A, C, Q, R)[2]
    beside = [part[1:] for part in matrices]
    covariances = np.stack([P, *covariances_beside(P, (A, C, Q, R), beside)])
    here, added = slice(n, n + model.n_gusts), np.diagonal(matrices[2], axis1=1, axis2=2)[:, n:]
    covariances[:, :n, :n] += spread
    covariances[:, here, here] += diagonal(added[:, : model.n_gusts] / (1.0 - fade**2))
    state = first_state(model, starting_rows(model, numbers, first), numbers.nuisance)
    return Following(
        states=np.concatenate(state, axis=1),
        covariances=covariances,
        nuisance=numbers.nuisance,
        fade=fade,
        white=model.white(noise) ** 2 / model.dt,
        added=added,
        sensors=model.sensor_variances(noise),
        numbers=numbers_and_constants(model.vehicle, numbers.parameters),
    )


def _off(vehicle: Vehicle, piece: Record, run: RecordRun, went: Filtered) -> Array:
    """Second moment (states, states) of what a beginning is off: of beginnings at all samples of the record, against
    the states that the constant gain's filter finds there.

    In the middle of a maneuver a line through 0.15 s of pose knows little of rates, and nothing of rotors that lag and
    of bars.
    """
    states, off = went.states.x, np.zeros((went.states.x.shape[1],) * 2)
    if not np.isfinite(states).all():
        return off
    value, rate = slopes_ahead(piece)
    settling = min(starting_samples(piece.dt), len(states))
    reaching = np.lib.stride_tricks.sliding_window_view(went.commands, settling, axis=0).mean(axis=2)
    n = min(len(value), len(reaching))
    begun = measured_start(
        vehicle,
        piece.output_names,
        vehicle.parameters(*went.numbers.parameters),
        Nuisance(*went.numbers.nuisance),
        value=value[:n].T,
        rate=rate[:n].T,
        inputs=reaching[:n],
        voltage=run.voltage[:n],
        xp=_ARRAYS,
    )
    error = begun - states[:n]
    if vehicle.traits.settled is None:  # found by Newton's method at the start, not here
        error[:, _BODY:] = states[:n, _BODY:] - states[:, _BODY:].mean(axis=0)
    return np.asarray(error.T @ error / n)
