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
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import N_DISTURBANCES, FilterState, StochasticModel
from swashplate.filtering.nuisance import Nuisance
from swashplate.filtering.riccati import predicted_covariance
from swashplate.identification.core import robust
from swashplate.identification.core.comparison import Comparison
from swashplate.identification.core.parameters import Parameterization
from swashplate.identification.core.records import Record
from swashplate.identification.core.scoring import TracedCost
from swashplate.identification.time.beginning import (
    FilterNumbers,
    FirstMotion,
    first_state,
    starting_samples,
    traced_begin,
)
from swashplate.identification.time.innovations import Filtered, RecordRun
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.identification.time.prediction_error import PredictionError
from swashplate.identification.time.record_filter import STRETCH, stretches, whole
from swashplate.identification.time.start_states import measured_start, slopes_ahead, steady_flight
from swashplate.jax_on_demand import jax, jit, jnp
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import ArrayBackend
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.compilation import FEW_PASSES, RUN_RARELY, lengthened
from swashplate.simulation.discretisation import held_series

_LANES = 8
"""Rows whose filters run side by side, where there is more than one."""

_BODY = len(RigidBody._fields)

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


class FollowingError(PredictionError):
    """`PredictionError` with a gain that follows: some ten times the work, for wind; arguments are the same."""

    def __init__(self, table: Parameterization, pieces: Sequence[Record], *, noise: Noise) -> None:
        super().__init__(table, pieces, noise=noise)
        self._constant = PredictionError(table, pieces, noise=noise)
        self._judgement: tuple[bytes, tuple[float, list[tuple[Array, Array, Array]]]] | None = None
        measured = [piece.measured for piece in pieces]
        self.counted = tuple(counted & seen for counted, seen in zip(self.counted, measured, strict=True))
        self._readings = tuple(
            np.where(seen[:, None], piece.outputs, np.nan) for piece, seen in zip(pieces, measured, strict=True)
        )

    @property
    def constant(self) -> PredictionError:
        """The likelihood of the same row with a constant gain."""
        return self._constant

    @property
    def compiled_by(self) -> str:
        """XLA, always."""
        return "XLA"

    @cached_property
    def _spread(self) -> tuple[Array, ...]:
        """How far off the states may be that each record begins with, (states, states)."""
        went = self._constant.runs(self.row.starts())
        return tuple(_off(self.table.vehicle, *each) for each in zip(self.pieces, self._runs, went, strict=True))

    def traced(self) -> TracedCost:
        """None: what JAX can differentiate as a whole has a constant gain, which is another likelihood.

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
            turned = np.tril(by_covariance) * (1.0 - 0.5 * np.eye(white.shape[1]))  # as in PredictionError
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
        """Cost and what `_whitened` says at a row; that of the last one is kept, as in PredictionError."""
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
            lanes = 1 if len(rows) == 1 else _LANES
            placed += placed[-1:] * (-len(placed) % lanes)
            blocks = [placed[first : first + lanes] for first in range(0, len(placed), lanes)]
            followed.append(
                whole([_along_some(self.model, run, readings, spread, block) for block in blocks], len(rows))
            )
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
        xp=ArrayBackend(),
    )
    error = begun - states[:n]
    if vehicle.traits.settled is None:  # found by Newton's method at the start, not here
        error[:, _BODY:] = states[:n, _BODY:] - states[:, _BODY:].mean(axis=0)
    return np.asarray(error.T @ error / n)


def _along_some(
    model: StochasticModel,
    run: RecordRun,
    readings: Array,
    spread: Array,
    placed: Sequence[tuple[Array, FilterNumbers]],
) -> Followed:
    """One record at as many rows as there are lanes.

    Args:
        model, run: whose.
        readings: NaN where there are none.
        spread: how far off the states may be that it begins with, a second moment.
        placed: commands and numbers of each row.
    """
    commands = np.stack([reaching for reaching, _ in placed])
    numbers = jax.tree.map(lambda *rows: np.stack(rows), *(numbers for _, numbers in placed))
    state, P = _begun(model, numbers, run.seen, spread)
    parts, n = [], len(readings)
    for k, (read, voltage) in enumerate(stretches(readings, run.voltage)):
        here = commands[:, k * STRETCH : (k + 1) * STRETCH]
        driven = np.swapaxes(lengthened(np.swapaxes(here, 0, 1), STRETCH), 0, 1)
        state, P, part = _along(model, state, P, numbers, read, driven, voltage)
        parts.append(part)
    return jax.tree.map(lambda *rows: np.concatenate(rows, axis=1)[:, :n], *parts)


@jit(static_argnums=0, compiler_options=RUN_RARELY)
def _begun(
    model: StochasticModel, numbers: FilterNumbers, seen: FirstMotion, spread: Float[jax.Array, "states states"]
) -> tuple[FilterState, Any]:
    """States to begin with, and their covariances, by lane: those of a filter that has settled in steady flight, how
    far off the first states may be, and the air."""

    def one(numbers: FilterNumbers) -> tuple[FilterState, Any]:
        parameters = model.vehicle.parameters(*numbers.parameters)
        around, held = steady_flight(model.vehicle, parameters, seen.voltage[1], seen.velocity)
        noise, nuisance = Noise(*numbers.noise), Nuisance(*numbers.nuisance)
        linear = model.linear(around, held, parameters, seen.voltage[1], noise, nuisance)
        settled = predicted_covariance(*linear)
        begin = first_state(model, traced_begin(model, numbers, seen).x, numbers.nuisance)
        kept, rest = model.fade(noise), len(settled) - len(spread) - model.n_gusts
        added = jnp.diag(linear[2])[len(spread) : len(spread) + model.n_gusts] / (1.0 - kept**2)
        unseen = jax.scipy.linalg.block_diag(spread, jnp.diag(added), jnp.zeros((rest, rest)))
        return begin, settled + unseen

    return jax.vmap(one)(numbers)


@jit(static_argnums=0, compiler_options=FEW_PASSES)
def _along(
    model: StochasticModel,
    state: FilterState,
    covariance: Float[jax.Array, "lanes joined joined"],
    numbers: FilterNumbers,
    readings: Float[jax.Array, "samples outputs"],
    commands: Float[jax.Array, "lanes samples inputs"],
    voltage: Float[jax.Array, " samples"],
) -> tuple[FilterState, Any, Followed]:
    def one(state: FilterState, P: Any, numbers: FilterNumbers, commands: Any) -> Any:
        def sample(carry: tuple[FilterState, Any], now: tuple[Any, Any, Any]) -> tuple[Any, Followed]:
            y, u, volts = now
            state, P, nu, S = _corrected(model, *carry, y, numbers)
            return _predicted(model, state, P, u, volts, numbers), Followed(nu, S, state)

        return jax.lax.scan(sample, (state, P), (readings, commands, voltage))

    (state, P), part = jax.vmap(one)(state, covariance, numbers, commands)
    return state, P, part


def _corrected(
    model: StochasticModel,
    state: FilterState,
    P: Float[jax.Array, "joined joined"],
    y: Float[jax.Array, " outputs"],
    numbers: FilterNumbers,
) -> tuple[FilterState, Any, Any, Any]:
    """State and covariance after a reading (NaN: none, which tells nothing), the innovation and its covariance."""
    n, d, k = np.cumsum([state.x.shape[0], model.n_gusts, N_DISTURBANCES])
    noise, nuisance = Noise(*numbers.noise), Nuisance(*numbers.nuisance)
    expected = model.measure(state.x, nuisance)
    read = jnp.isfinite(y)
    nu = jnp.where(read, y - (expected + model.line_seen @ state.line if model.lined else expected), 0.0)
    by_state = jax.jacfwd(lambda x: model.measure(x, nuisance))(state.x)
    C = jnp.concatenate([by_state, np.zeros((len(y), k - n)), model.line_seen], axis=1) * read[:, None]
    R = jnp.diag(model.sensor_variances(noise))
    seen = C @ P
    S = seen @ C.T + R
    left, rows = jnp.column_stack([S, seen, nu]), []
    for i in range(len(y)):  # eliminated row after row: L^-1 C P and L^-1 nu, L the Cholesky factor of S
        row = left[0] / jnp.sqrt(left[0, 0])
        rows.append(row[len(y) - i :])
        left = left[1:, 1:] - row[1 : len(y) - i, None] * row[1:]
    told = jnp.stack(rows)
    move = told[:, :-1].T @ told[:, -1]
    line = state.line + move[k:] if model.lined else ()
    corrected = FilterState(state.x + move[:n], state.gust + move[n:d], state.drift + move[d:k], line)
    return corrected, P - told[:, :-1].T @ told[:, :-1], nu, S


def _predicted(
    model: StochasticModel,
    state: FilterState,
    P: Float[jax.Array, "joined joined"],
    u: Float[jax.Array, " inputs"],
    volts: Float[jax.Array, ""],
    numbers: FilterNumbers,
) -> tuple[FilterState, Any]:
    """State and covariance one sample later, averaged over what is not known of the air speed."""
    n, d = state.x.shape[0], N_DISTURBANCES
    parameters, noise = model.vehicle.parameters(*numbers.parameters), Noise(*numbers.noise)
    names = model.vehicle.state_names
    psi = state.x[names.index("psi")]
    c, s = jnp.cos(psi), jnp.sin(psi)
    turn = jnp.stack([jnp.stack([c, s]), jnp.stack([-s, c])])
    speeds = np.eye(n)[[names.index("u"), names.index("v")]]
    wind = jnp.zeros((2, P.shape[0] - n)).at[:, d : d + 2].set(-turn)
    air = jnp.concatenate([jnp.asarray(speeds), wind], axis=1)  # of the state and the disturbances
    spread = jnp.sqrt(jnp.maximum(jnp.diag(air @ P @ air.T), _STILL))
    acting = model.acting(state)

    def rates(gust: Any) -> Any:
        return model.rates(state.x, gust, u=u, parameters=parameters, voltage=volts)

    away = (_AWAY[:, None, None] * spread[:, None] * wind[:, : model.n_gusts]).reshape(-1, model.n_gusts)
    here, there = rates(acting), jax.vmap(rates)(acting + away).reshape(len(_AWAY), 2, n)
    apart = jnp.tensordot(_SHARES, there - here, 1).sum(axis=0)  # what the spread of the air speed does on average
    by_x, by_gust = model.slopes(state.x, acting, u=u, parameters=parameters, voltage=volts)
    by_air = jnp.tensordot(_SHARES * _AWAY, there, 1).T / spread  # averaged slopes (Stein 1981, lemma 1), (n, 2)
    more = by_air + by_gust[:, d : d + 2] @ turn.T
    by_x, by_gust = by_x + more @ speeds, by_gust + more @ wind[:, : model.n_gusts]
    by_x, held = held_series(by_x, model.dt, jnp.eye(n))
    by_gust = model.dt * held @ by_gust
    after = model.step(state.x, acting, u, parameters, volts) + model.dt * apart
    # Disturbances and the line go on by themselves: F is full in the states' rows alone.
    rows = jnp.concatenate([by_x, by_gust, by_gust[:, :d], np.zeros((n, model.n_line))], axis=1)
    kept = model.lasting(noise)
    led = rows @ P
    across = led[:, n:] @ kept.T
    moved = jnp.block([[led @ rows.T, across], [across.T, kept @ P[n:, n:] @ kept.T]])
    moved = moved + model.process_noise(by_gust[:, :d], noise)
    line = model.line_turn(noise) @ state.line if model.lined else ()
    return FilterState(after, model.fade(noise) * state.gust, state.drift, line), 0.5 * (moved + moved.T)
