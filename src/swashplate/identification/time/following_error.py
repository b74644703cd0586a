"""Prediction errors of a filter whose gain follows what is flown: for wind, which acts through the square of speed.

What wind does to a rotor grows with the air speed: nothing at rest, much in a gust. A constant gain answers to the
average. Where the air speed is small it then takes other noise for wind, and a noisy regressor makes its coefficient
too small, with bounds too narrow. An extended Kalman filter carries the covariance along instead (Jategaonkar 2015,
sec. 5.5), with slopes and means averaged over the air speed's own uncertainty (statistical linearisation, Gelb 1974,
sec. 6.2): the force of wind has a kink at rest, and a slope there would be zero. It begins with how far
off a record's first states may be, and goes on by itself where the pose was not seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.filtering.block_matrices import diagonal
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import StochasticModel
from swashplate.filtering.filter_code import Followed, Following, RecordSeries, driving_rows
from swashplate.filtering.filter_library import filter_code
from swashplate.filtering.nuisance import Nuisance
from swashplate.filtering.riccati import steady_gain
from swashplate.identification.core import robust
from swashplate.identification.core.parameters import Parameterization
from swashplate.identification.core.records import Comparison, Record
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
        self._judgement: tuple[bytes, tuple[float, list[tuple[Array, Array, Array]]]] | None = None
        measured = [piece.measured for piece in pieces]
        self.counted = tuple(counted & seen for counted, seen in zip(self.counted, measured, strict=True))
        self._readings = tuple(
            np.where(seen[:, None], piece.outputs, np.nan) for piece, seen in zip(pieces, measured, strict=True)
        )

    @property
    def constant(self) -> FilterError:
        """The likelihood of the same row with a constant gain."""
        return self._constant

    @cached_property
    def _spread(self) -> tuple[Array, ...]:
        """How far off the states may be that each record begins with, (states, states)."""
        went = self._constant.runs(self.row.starts())
        return tuple(_off(self.table.vehicle, *each) for each in zip(self.pieces, self._runs, went, strict=True))

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

    def cost(self, row: Array) -> float:
        """Negative log-likelihood of the counted innovations (without its constant)."""
        return self._likelihood(self._followed([row]))

    def scores(self, row: Array) -> tuple[float, Array, Array]:
        """Cost, gradient and Fisher information; slopes are differences of whole runs."""
        cost, judged = self._judged(row)
        gradient, information = np.zeros(len(row)), np.zeros((len(row), len(row)))
        for white, moved, by_covariance in judged:
            weight = robust.weights(white)
            turned = np.tril(by_covariance) * (1.0 - 0.5 * np.eye(white.shape[1]))  # as in FilterError
            flat, covariance = moved.reshape(len(row), -1), by_covariance.reshape(len(row), -1)
            gradient += flat @ (white * weight).ravel() + 0.5 * np.trace(by_covariance, axis1=2, axis2=3).sum(axis=1)
            gradient -= np.einsum("pnij,ni,nj->p", turned, white * weight, white, optimize=True)
            information += (flat * weight.ravel()) @ flat.T + 0.5 * covariance @ covariance.T
        return cost, gradient, information

    def whitened(self, row: Array) -> tuple[list[Array], list[Array], Array]:
        """Per record: whitened innovations (n, outputs) and their sensitivities (p, n, outputs).

        The last is the information (p, p) that lies in the innovations' covariance instead.
        """
        _, by_record = self._judged(row)
        by_covariance = [part.reshape(len(row), -1) for _, _, part in by_record]
        rest = sum((0.5 * flat @ flat.T for flat in by_covariance), np.zeros((len(row), len(row))))
        return [white for white, _, _ in by_record], [moved for _, moved, _ in by_record], np.asarray(rest)

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
            for piece, run, counted in zip(self.pieces, self._followed([row]), self.counted, strict=True)
        )

    def _judged(self, row: Array) -> tuple[float, list[tuple[Array, Array, Array]]]:
        """Cost and what `_whitened` says at a row; that of the last one is kept, as in FilterError."""
        asked = np.asarray(row, dtype=np.float64).tobytes()
        if self._judgement is None or self._judgement[0] != asked:
            runs = self._followed([row, *(row + step for step in _STEP * np.eye(len(row)))])
            self._judgement = asked, (self._likelihood(runs), self._whitened(runs))
        return self._judgement[1]

    def _likelihood(self, runs: Sequence[Followed]) -> float:
        total = 0.0
        for run, counted in zip(runs, self.counted, strict=True):
            nu, S = run.innovations[0][counted], run.covariances[0][counted]
            if not (np.isfinite(nu).all() and np.isfinite(S).all()):
                return np.inf
            try:
                L = np.linalg.cholesky(S)
            except np.linalg.LinAlgError:
                return np.inf
            total += robust.huber(np.linalg.solve(L, nu[..., None])[..., 0])
            total += float(np.log(np.diagonal(L, axis1=1, axis2=2)).sum())
        return total

    def _whitened(self, runs: Sequence[Followed]) -> list[tuple[Array, Array, Array]]:
        """Per record: whitened innovations (n, m), slopes of theirs (p, n, m) and L^-1 dS L^-T (p, n, m, m)."""
        by_record = []
        for run, counted in zip(runs, self.counted, strict=True):
            nu, S = run.innovations[:, counted], run.covariances[:, counted]
            Li = np.linalg.inv(np.linalg.cholesky(S[0]))
            turn = np.swapaxes(Li, 1, 2)
            white = (Li @ nu[0][..., None])[..., 0]
            moved = (Li @ ((nu[1:] - nu[0]) / _STEP)[..., None])[..., 0]
            by_record.append((white, moved, Li @ ((S[1:] - S[0]) / _STEP) @ turn))
        return by_record

    def _followed(self, rows: Sequence[Array]) -> list[Followed]:
        """Every record's runs at some rows."""
        given = self.table.card_row, np.array(self.noise, dtype=np.float64)
        followed = []
        for run, readings, spread in zip(self._runs, self._readings, self._spread, strict=True):
            placed = [run.placed(*given, row * self.row.scale) for row in rows]
            commands = np.stack([reaching for reaching, _ in placed], axis=1)
            numbers = FilterNumbers(*map(np.stack, zip(*(numbers for _, numbers in placed), strict=True)))
            begin = following_from(self.model, numbers, run.seen, spread)
            followed.append(
                filter_code(self.model).follow(
                    self.model.dt, begin, RecordSeries(readings, driving_rows(commands, run.voltage))
                )
            )
        return followed


def following_from(model: StochasticModel, numbers: FilterNumbers, seen: FirstMotion, spread: Array) -> Following:
    """What filters of a record begin with and depend on: a filter that has settled in steady flight, its first states
    off as far as the spread says, and the air, of which nothing is known.

    Args:
        model: of the filters. numbers: by row. seen: of the record's beginning.
        spread: how far off the states may be that it begins with, a second moment.
    """
    noise, n = Noise(*numbers.noise.T), len(spread)
    matrices, fade = joined_at(model, numbers, seen), model.fade(noise)
    covariances = np.array([steady_gain(*of_row)[2] for of_row in zip(*matrices, strict=True)])
    here, added = slice(n, n + model.n_gusts), np.diagonal(matrices[2], axis1=1, axis2=2)[:, n:]
    covariances[:, :n, :n] += spread
    covariances[:, here, here] += diagonal(added[:, : model.n_gusts] / (1.0 - fade**2))
    state = first_state(model, starting_rows(model, numbers, seen), numbers.nuisance)
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
