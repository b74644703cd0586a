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
from typing import NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.filtering.block_matrices import diagonal
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import N_DISTURBANCES, FilterState, StochasticModel
from swashplate.filtering.filter_code import Pushed
from swashplate.filtering.filter_library import filter_code
from swashplate.filtering.nuisance import Nuisance
from swashplate.filtering.riccati import steady_gain
from swashplate.identification.core import robust
from swashplate.identification.core.comparison import Comparison
from swashplate.identification.core.parameters import Parameterization
from swashplate.identification.core.records import Record
from swashplate.identification.time.beginning import (
    FilterNumbers,
    FirstMotion,
    first_state,
    joined_at,
    measured_slopes,
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
from swashplate.simulation.discretisation import held_series

_BODY, _ARRAYS = len(RigidBody._fields), ArrayBackend()

_STEP = 1e-4
"""Of a scaled entry, for slopes by differences."""

_AWAY = np.array([-2.22500, -0.97861, 0.97861, 2.22500])
_SHARES = np.array([0.05036, 0.26179, 0.26179, 0.05036])
"""Places in standard deviations, beside the mean itself, and their weights: averages over a normal distribution that
are exact for parabolas, and within 0.7 % for the slope and 0.012 variances for the mean of x |x|, wherever its kink
lies (found by least squares; the cubature of the third degree is 11 % off at the kink)."""

_STILL = 1e-8
"""Variance of an air speed that is known for sure [m^2/s^2]."""


class Followed(NamedTuple):
    """Of some rows along a record: innovations (rows, n, outputs), their covariances, and the states after each reading
    (rows, n, ...)."""

    innovations: Array
    covariances: Array
    states: FilterState


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
                states=np.asarray(run.states.x)[0][:, kept],
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
            beside, told = FollowingRows(self.model, numbers, run.seen, spread), []
            for y, u, volts in zip(readings, commands, run.voltage, strict=True):
                nu, S = beside.corrected(y)
                told.append((nu, S, beside.state))
                beside.predicted(u, float(volts))
            innovations, covariances, states = zip(*told, strict=True)
            parts = [
                np.stack(part, axis=1) if isinstance(part[0], np.ndarray) else () for part in zip(*states, strict=True)
            ]
            followed.append(Followed(np.stack(innovations, axis=1), np.stack(covariances, axis=1), FilterState(*parts)))
        return followed


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


class _Air(NamedTuple):
    """How the air speed ahead and to the right (rows, 2) is made: of the states (2, states), and of the joined gusts,
    drifts and line (rows, 2, all of them); `turn` takes north and east there."""

    speeds: Array
    wind: Array
    turn: Array


class FollowingRows:
    """One record at some rows of numbers side by side: an extended Kalman filter for each.

    Args:
        model: of the filter. numbers: by row.
        seen: of the record's beginning. spread: how far off the states may be that it begins with, a second moment.
    """

    def __init__(self, model: StochasticModel, numbers: FilterNumbers, seen: FirstMotion, spread: Array) -> None:
        self._model, self._code = model, filter_code(model)
        self._n, self._joined = (
            len(model.vehicle.state_names),
            len(spread) + model.n_gusts + N_DISTURBANCES + model.n_line,
        )
        self._noise, self._nuisance = Noise(*numbers.noise.T), Nuisance(*numbers.nuisance.T)
        self._numbers = numbers_and_constants(model.vehicle, numbers.parameters)
        self._fade, self._lasting = model.fade(self._noise), model.lasting(self._noise)
        self._line_turn, self._sensors = model.line_turn(self._noise), model.sensor_variances(self._noise)
        matrices = joined_at(model, numbers, seen)
        self.state = first_state(model, starting_rows(model, numbers, seen), numbers.nuisance)
        # That of a filter that has settled in steady flight, how far off the first states may be, and the air.
        self.covariance = np.array([steady_gain(*of_row)[2] for of_row in zip(*matrices, strict=True)])
        here = slice(self._n, self._n + model.n_gusts)
        added = np.diagonal(matrices[2], axis1=1, axis2=2)[:, here] / (1.0 - self._fade**2)
        self.covariance[:, : self._n, : self._n] += spread
        self.covariance[:, here, here] += diagonal(added)

    def corrected(self, y: Array) -> tuple[Array, Array]:
        """After a reading (NaN: none, which tells nothing): the innovations and their covariances."""
        model, n, P = self._model, self._n, self.covariance
        expected = model.measure(self.state.x.T, self._nuisance, _ARRAYS).T
        expected = expected + self.state.line @ model.line_seen.T if model.lined else expected
        read = np.isfinite(y)
        nu = np.where(read, y - expected, 0.0)
        C = np.zeros((len(nu), len(y), self._joined))
        C[:, :, :n] = measured_slopes(model, self.state.x, self._nuisance)
        C[:, :, self._joined - model.n_line :] = model.line_seen
        C *= read[:, None]
        seen = C @ P
        S = seen @ np.swapaxes(C, 1, 2) + diagonal(self._sensors)
        K = np.swapaxes(np.linalg.solve(S, seen), 1, 2)
        move = (K @ nu[:, :, None])[:, :, 0]
        ends = np.cumsum([n, model.n_gusts, N_DISTURBANCES])
        x, gust, drift, line = np.split(move, ends, axis=1)
        state = self.state
        line = state.line + line if model.lined else ()
        self.state = FilterState(state.x + x, state.gust + gust, state.drift + drift, line)
        self.covariance = P - K @ seen
        return nu, S

    def predicted(self, u: Array, volts: float) -> None:
        """One sample later, averaged over what is not known of the air speed (u: by row)."""
        model, n, g, d, P = self._model, self._n, self._model.n_gusts, N_DISTURBANCES, self.covariance
        air, m = self._air(), u.shape[1]
        whole = np.concatenate([np.broadcast_to(air.speeds, (len(u), 2, n)), air.wind], axis=2)
        spread = np.sqrt(np.maximum(np.einsum("ris,rst,rit->ri", whole, P, whole, optimize=True), _STILL))
        acting = self.state.gust + np.pad(self.state.drift, ((0, 0), (0, g - d)))
        driving = np.zeros((len(u), m + 4))
        driving[:, :m], driving[:, m : m + g - d], driving[:, m + 3] = u, acting[:, d:], volts
        away = np.repeat(driving[:, None], 2 * len(_AWAY), axis=1).reshape(len(u), len(_AWAY), 2, m + 4)
        away[..., m : m + 2] -= _AWAY[:, None, None] * (spread[:, :, None] * air.turn)[:, None]
        front = away.shape[:3]
        there = self._code.rates(
            np.broadcast_to(self.state.x[:, None, None], (*front, n)),
            away,
            np.broadcast_to(self._numbers[:, None, None], (*front, self._numbers.shape[1])),
        )
        here, by_x, by_driving = self._code.rates_and_slopes(self.state.x, driving, self._numbers)
        # What the spread of the air speed does on average, and averaged slopes (Stein 1981, lemma 1).
        apart = np.einsum("k,rkin->rn", _SHARES, there - here[:, None, None])
        by_air = np.einsum("k,rkin->rni", _SHARES * _AWAY, there) / spread[:, None]
        by_gust = np.concatenate(
            [np.broadcast_to(self._pushed, (len(u), n, d)), by_driving[:, :, m : m + g - d]], axis=2
        )
        more = by_air + by_gust[:, :, d : d + 2] @ np.swapaxes(air.turn, 1, 2)
        by_x, by_gust = by_x + more @ air.speeds, by_gust + more @ air.wind[:, :, :g]
        by_x, held = held_series(by_x, model.dt, np.eye(n))
        by_gust = model.dt * held @ by_gust
        after = self._code.step(model.dt, self.state.x, Pushed(driving, acting[:, :d]), self._numbers)
        # Disturbances and the line go on by themselves: F is full in the states' rows alone.
        rows = np.concatenate([by_x, by_gust, by_gust[:, :, :d], np.zeros((len(u), n, model.n_line))], axis=2)
        led, kept = rows @ P, self._lasting
        moved = np.empty_like(P)
        moved[:, :n, :n] = led @ np.swapaxes(rows, 1, 2)
        moved[:, :n, n:] = led[:, :, n:] @ np.swapaxes(kept, 1, 2)
        moved[:, n:, :n] = np.swapaxes(moved[:, :n, n:], 1, 2)
        moved[:, n:, n:] = kept @ P[:, n:, n:] @ np.swapaxes(kept, 1, 2)
        moved += model.process_noise(by_gust[:, :, :d], self._noise)
        state = self.state
        line = (self._line_turn @ state.line[:, :, None])[:, :, 0] if model.lined else ()
        self.state = FilterState(after + model.dt * apart, self._fade * state.gust, state.drift, line)
        self.covariance = 0.5 * (moved + np.swapaxes(moved, 1, 2))

    @cached_property
    def _pushed(self) -> Array:
        return np.eye(self._n)[:, self._model.disturbed]

    def _air(self) -> _Air:
        names = self._model.vehicle.state_names
        psi = self.state.x[:, names.index("psi")]
        c, s = np.cos(psi), np.sin(psi)
        turn = np.stack([np.stack([c, s], axis=1), np.stack([-s, c], axis=1)], axis=1)
        wind = np.zeros((len(psi), 2, self._joined - self._n))
        wind[:, :, N_DISTURBANCES : N_DISTURBANCES + 2] = -turn
        return _Air(np.eye(self._n)[[names.index("u"), names.index("v")]], wind, turn)
