"""Filters of one record side by side whose gain follows what is flown, by NumPy: for wind.

Wind acts through the square of speed. `templates/follow.c` does the same in C.

An extended Kalman filter carries the covariance along (Jategaonkar 2015, sec. 5.5), with slopes and means averaged over
the air speed's own uncertainty (statistical linearisation, Gelb 1974, sec. 6.2): the force of wind has a kink at rest,
and a slope there would be zero.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from swashplate.arrays import IMAGINARY, Array, Complex
from swashplate.filtering.disturbed_model import N_DISTURBANCES, FilterState, StochasticModel
from swashplate.filtering.filter_code import FilterCode, Followed, Following, Pushed, RecordSeries
from swashplate.filtering.nuisance import Nuisance
from swashplate.filtering.riccati import diagonal
from swashplate.physics.backend import ArrayBackend
from swashplate.simulation.discretisation import held_series

AWAY = (-2.22500, -0.97861, 0.97861, 2.22500)
SHARES = (0.05036, 0.26179, 0.26179, 0.05036)
"""Places in standard deviations, beside the mean itself, and their weights: averages over a normal distribution that
are exact for parabolas, and within 0.7 % for the slope and 0.012 variances for the mean of x |x|, wherever its kink
lies (found by least squares; the cubature of the third degree is 11 % off at the kink)."""

STILL = 1e-8
"""Variance of an air speed that is known for sure [m^2/s^2]."""

_ARRAYS, _AWAY, _SHARES = ArrayBackend(), np.array(AWAY), np.array(SHARES)


class _Air(NamedTuple):
    """How the air speed ahead and to the right (rows, 2) is made: of the states (2, states), and of the joined gusts
    and drifts (rows, 2, both); `turn` takes north and east there."""

    speeds: Array
    wind: Array
    turn: Array


class FollowingRows:
    """One record at some rows of numbers side by side: an extended Kalman filter for each.

    Args:
        model: of the filter. code: that runs its equations.
        begin: what they begin with and depend on, by row.
    """

    def __init__(self, model: StochasticModel, code: FilterCode, begin: Following) -> None:
        self._model, self._code, self._given = model, code, begin
        self._n, self._joined = len(model.vehicle.state_names), begin.states.shape[1]
        self._ends = np.cumsum([self._n, model.n_gusts])
        self._nuisance = Nuisance(*begin.nuisance.T)
        self.state, self.covariance = FilterState(*np.split(begin.states, self._ends, axis=1)), begin.covariances

    def corrected(self, y: Array) -> tuple[Array, Array]:
        """After a reading (NaN: none, which tells nothing): the innovations and their covariances."""
        model, n, P = self._model, self._n, self.covariance
        expected = model.measure(self.state.x.T, self._nuisance, _ARRAYS).T
        read = np.isfinite(y)
        nu = np.where(read, y - expected, 0.0)
        C = np.zeros((len(nu), len(y), self._joined))
        C[:, :, :n] = measured_slopes(model, self.state.x, self._nuisance)
        C *= read[:, None]
        cross = C @ P
        S = cross @ np.swapaxes(C, 1, 2) + diagonal(self._given.sensors)
        K = np.swapaxes(np.linalg.solve(S, cross), 1, 2)
        move = (K @ nu[:, :, None])[:, :, 0]
        parts = zip(self.state, np.split(move, self._ends, axis=1), strict=True)
        self.state = FilterState(*(part + added for part, added in parts))
        self.covariance = P - K @ cross
        return nu, S

    def predicted(self, w: Array) -> None:
        """One sample later, averaged over what is not known of the air speed (w: what drives, by row)."""
        model, n, g, d, P = self._model, self._n, self._model.n_gusts, N_DISTURBANCES, self.covariance
        air, m, numbers, given = self._air(), w.shape[1] - 4, self._given.numbers, self._given
        total = np.concatenate([np.broadcast_to(air.speeds, (len(w), 2, n)), air.wind], axis=2)
        spread = np.sqrt(np.maximum(np.einsum("ris,rst,rit->ri", total, P, total, optimize=True), STILL))
        acting = self.state.gust + np.pad(self.state.drift, ((0, 0), (0, g - d)))
        driving = w.copy()
        driving[:, m : m + g - d] += acting[:, d:]
        away = np.repeat(driving[:, None], 2 * len(_AWAY), axis=1).reshape(len(w), len(_AWAY), 2, m + 4)
        away[..., m : m + 2] -= _AWAY[:, None, None] * (spread[:, :, None] * air.turn)[:, None]
        front = away.shape[:3]
        there = self._code.rates(
            np.broadcast_to(self.state.x[:, None, None], (*front, n)),
            away,
            np.broadcast_to(numbers[:, None, None], (*front, numbers.shape[1])),
        )
        here, by_x, by_driving = self._code.rates_and_slopes(self.state.x, driving, numbers)
        # What the spread of the air speed does on average, and averaged slopes (Stein 1981, lemma 1).
        apart = np.einsum("k,rkin->rn", _SHARES, there - here[:, None, None])
        by_air = np.einsum("k,rkin->rni", _SHARES * _AWAY, there) / spread[:, None]
        by_gust = np.concatenate(
            [np.broadcast_to(self._pushed, (len(w), n, d)), by_driving[:, :, m : m + g - d]], axis=2
        )
        more = by_air + by_gust[:, :, d : d + 2] @ np.swapaxes(air.turn, 1, 2)
        by_x, by_gust = by_x + more @ air.speeds, by_gust + more @ air.wind[:, :, :g]
        by_x, held = held_series(by_x, model.dt, np.eye(n))
        by_gust = model.dt * held @ by_gust
        after = self._code.step(model.dt, self.state.x, Pushed(driving, acting[:, :d]), numbers)
        # Disturbances go on by themselves: F is full in the states' rows alone.
        rows = np.concatenate([by_x, by_gust, by_gust[:, :, :d]], axis=2)
        led, kept = rows @ P, self._lasting
        ahead = np.empty_like(P)
        ahead[:, :n, :n] = led @ np.swapaxes(rows, 1, 2)
        ahead[:, :n, n:] = led[:, :, n:] @ np.swapaxes(kept, 1, 2)
        ahead[:, n:, :n] = np.swapaxes(ahead[:, :n, n:], 1, 2)
        ahead[:, n:, n:] = kept @ P[:, n:, n:] @ np.swapaxes(kept, 1, 2)
        push = by_gust[:, :, :d]
        ahead[:, :n, :n] += (push * given.white[:, None]) @ np.swapaxes(push, 1, 2) + np.diag(model.unexcited)
        ahead[:, n:, n:] += diagonal(given.added)
        state = self.state
        self.state = FilterState(after + model.dt * apart, given.fade * state.gust, state.drift)
        self.covariance = 0.5 * (ahead + np.swapaxes(ahead, 1, 2))

    @cached_property
    def _lasting(self) -> Array:
        """How gusts and drifts go on (rows, both, both)."""
        given, g = self._given, self._model.n_gusts
        factor = np.tile(np.eye(self._joined - self._n), (len(given.fade), 1, 1))
        factor[:, range(g), range(g)] = given.fade
        return factor

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


def followed(model: StochasticModel, code: FilterCode, begin: Following, series: RecordSeries) -> Followed:
    """The rows along a record."""
    beside, samples = FollowingRows(model, code, begin), []
    for y, w in zip(*series, strict=True):
        nu, S = beside.corrected(y)
        samples.append((nu, S, np.concatenate(beside.state, axis=1)))
        beside.predicted(w)
    return Followed(*(np.stack(part, axis=1) for part in zip(*samples, strict=True)))


def measured_slopes(model: StochasticModel, x: Array, nuisance: Nuisance) -> Array:
    """Slopes of the measured channels by the states, by row: by complex steps in the angles, plain in the others."""
    names = model.vehicle.state_names
    measured = np.tile(np.eye(len(names))[[names.index(name) for name in model.output_names]], (len(x), 1, 1))
    for place in (names.index(name) for name in ("phi", "theta", "psi")):
        turned = x + 1j * IMAGINARY * np.eye(len(names))[place]
        measured[:, :, place] = np.imag(model.measure(turned.T, nuisance, COMPLEX_ARRAYS)).T / IMAGINARY
    return measured


class _ComplexArrays(ArrayBackend):
    """NumPy's operations, for arrays whose imaginary parts are slopes."""

    def __init__(self) -> None:
        super().__init__()
        self.atan2 = self._atan2

    @staticmethod
    def _atan2(y: Complex, x: Complex) -> Complex:
        slope = (np.real(x) * np.imag(y) - np.real(y) * np.imag(x)) / (np.real(x) ** 2 + np.real(y) ** 2)
        return np.asarray(np.arctan2(np.real(y), np.real(x)) + 1j * slope, dtype=np.complex128)


COMPLEX_ARRAYS = _ComplexArrays()
"""NumPy's operations, where imaginary parts are slopes."""
