"""A vehicle in disturbed air, seen by sensors: the model whose one-step predictions filter error compares.

The vehicle's own states are joined by two disturbances on each of the six accelerations: a gust (Ornstein-Uhlenbeck,
it fades) and a drift (random walk: trims, battery, servo zeros). Where asked, a horizontal wind (Ornstein-Uhlenbeck
too) acts through the equations themselves: what moving air does to the rotors depends on the very parameters that are
sought. All are held over a sample. The measurement update has a constant gain from the Riccati equation around hover,
or around the mean flight of a helicopter that is faster (Jategaonkar 2015, sec. 5.4); horizontal position errors are
turned into the heading first, so that the gain does not depend on where the nose points.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array, Values
from swashplate.engine.equations import Equations, equations_of
from swashplate.filtering.disturbances import DISTURBED, Noise, on_axes
from swashplate.filtering.nuisance import Nuisance, tracked_pose
from swashplate.filtering.riccati import blocks, diagonal
from swashplate.flights.schema import ATTITUDE, POSITION, RATES
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.frames import Euler, Vector
from swashplate.simulation.discretisation import held_series

N_DISTURBANCES = len(DISTURBED)


class FilterGain(NamedTuple):
    """Constant measurement update of states, gusts (the wind with them) and drifts, and the innovations' covariance."""

    state: Scalar
    gust: Scalar
    drift: Scalar
    covariance: Scalar


class FilterState(NamedTuple):
    """Estimated vehicle states, gusts (six accelerations, and the wind to north and east where modelled), drifts."""

    x: Scalar
    gust: Scalar
    drift: Scalar

    def at(self, samples: NDArray[np.intp]) -> FilterState:
        """Those at some samples of a series."""
        return FilterState(*(np.asarray(part)[samples] for part in self))


@dataclass(frozen=True)
class StochasticModel:
    """A vehicle's equations with disturbances and sensors, as functions of flat rows.

    Two models of the same equations, outputs and rate are equal, so that compiled code serves every card.

    Attributes:
        equations: whose equations.
        output_names: measured channels.
        dt: sample time [s].
        windy: a horizontal wind is among the disturbances.
    """

    equations: Equations
    output_names: tuple[str, ...]
    dt: float
    windy: bool = False

    @property
    def vehicle(self) -> Vehicle:
        """For names only: its card is any card of these equations."""
        return self.equations.vehicle

    @property
    def n_gusts(self) -> int:
        """What fades: a gust on each disturbed acceleration, and perhaps the wind to north and east."""
        return N_DISTURBANCES + 2 * self.windy

    # ---- what is seen ------------------------------------------------------------------------------------------
    def measure(self, x: Scalar, nuisance: Nuisance, xp: Backend) -> Scalar:
        """The measured channels of a state, whose entries come first."""
        here = {name: x[self.vehicle.index(name)] for name in (*POSITION, *ATTITUDE, *self.output_names)}
        place, attitude = Vector(*map(here.get, POSITION)), Euler(*map(here.get, ATTITUDE))
        shown = [part._asdict() for part in tracked_pose(place, attitude, nuisance, xp)]
        readings = {**here, **shown[0], **shown[1]}
        return xp.arrays.stack([readings[name] for name in self.output_names])

    @property
    def disturbed(self) -> list[int]:
        """Places of the disturbed states."""
        return [self.vehicle.index(name) for name in DISTURBED]

    # ---- the filter --------------------------------------------------------------------------------------------
    def places(self, x: Array, noise: Noise) -> list[Array]:
        """Where slopes are taken and averaged, by row: the equilibrium itself, four points about it with wind.

        Wind acts through terms that grow with the square of the speed and have no slope at rest; with wind, slopes are
        averaged over a normal distribution of the horizontal air speed by four points (statistical linearisation,
        Gelb 1974, sec. 6.2; cubature of the third degree).
        """
        if not self.windy:
            return [x]
        sigma = np.sqrt(noise.speed**2 + 0.5 * noise.tau_wind * noise.wind**2)
        along = np.sqrt(2.0) * np.eye(x.shape[-1])[self.disturbed[:2]]
        return [x + sign * sigma[..., None] * way for sign in (1.0, -1.0) for way in along]

    def joined(self, by_x: Array, by_gust: Array, by_state: Array, noise: Noise) -> tuple[Array, Array, Array, Array]:
        """A, C, Q, R of the joined system (states, gusts, drifts), about steady flight with the nose north.

        Args:
            by_x, by_gust: slopes of the rates by states and disturbances, with any axes in front.
            by_state: slopes of the measured channels by the states.
            noise: numbers, or rows of them along the axes in front.
        """
        n, g, d = by_x.shape[-1], self.n_gusts, N_DISTURBANCES
        by_x, held = held_series(by_x, self.dt, np.eye(n))  # as `step` makes it of a linear system
        by_gust = self.dt * held @ by_gust
        by_push = by_gust[..., :d]
        A = blocks(
            [[by_x, by_gust, by_push], [None, diagonal(self.fade(noise)), None], [None, None, np.eye(d)]], (n, g, d)
        )
        C = np.concatenate([by_state, np.zeros((*by_state.shape[:-1], g + d))], axis=-1)
        return A, C, self.process_noise(by_push, noise), diagonal(self.sensor_variances(noise))

    def white(self, noise: Noise) -> Array:
        """Intensities of white noise on the disturbed accelerations."""
        tilt, yaw, horizontal, vertical = noise[:4]
        return np.stack(on_axes(horizontal, vertical, tilt, yaw), axis=-1)

    def process_noise(self, by_push: Array, noise: Noise) -> Array:
        """Covariance of what a sample adds to states, gusts and drifts.

        Args:
            by_push: how an acceleration that is held over the sample moves the states (..., states, accelerations).
            noise: intensities.
        """
        n, g, d = by_push.shape[-2], self.n_gusts, N_DISTURBANCES
        white = self.white(noise)
        tilt, yaw, horizontal, vertical = noise[4:8]
        gust = np.stack([*on_axes(horizontal, vertical, tilt, yaw), noise.wind, noise.wind][:g], axis=-1)
        drift = np.stack(on_axes(*_shared_or_own(noise, "drift")), axis=-1)
        # White acceleration noise enters as by_push does, for one sample; the floor keeps unexcited states observable.
        spread = (by_push * (white**2 / self.dt)[..., None, :]) @ np.swapaxes(by_push, -1, -2) + np.diag(self.unexcited)
        gusts, drifts = (diagonal(row**2 * self.dt) for row in (gust, drift))
        return blocks([[spread, None, None], [None, gusts, None], [None, None, drifts]], (n, g, d))

    def gain_of(self, K: Array, S: Array) -> FilterGain:
        """The parts of a joined gain (..., joined, outputs)."""
        n, d = len(self.vehicle.state_names), len(self.vehicle.state_names) + self.n_gusts
        return FilterGain(K[..., :n, :], K[..., n:d, :], K[..., d:, :], S)

    def fade(self, noise: Noise) -> Array:
        """What is left of each gust after one sample."""
        taus = [*on_axes(*_shared_or_own(noise, "tau_gust")), noise.tau_wind, noise.tau_wind]
        return np.exp(-self.dt / np.stack(taus[: self.n_gusts], axis=-1))

    @property
    def unexcited(self) -> Array:
        """A little variance per sample on states that no disturbance reaches: rotor speeds [rad/s], and others."""
        return np.where([role == "rotor speed" for role in self.vehicle.roles], 1e-4, 1e-10)

    def sensor_variances(self, noise: Noise) -> Array:
        """Variances of the measured channels."""
        sigma = dict.fromkeys(POSITION, noise.sensor_position)
        sigma |= dict.fromkeys(RATES, np.where(noise.sensor_rate > 0.0, noise.sensor_rate, noise.sensor_angle))
        sigma["psi"] = np.where(noise.sensor_heading > 0.0, noise.sensor_heading, noise.sensor_angle)
        return np.stack([sigma.get(name, noise.sensor_angle) ** 2 for name in self.output_names], axis=-1)

    @property
    def n_outputs(self) -> int:
        return len(self.output_names)

    def correct(
        self, state: FilterState, y: Scalar, gain: FilterGain, nuisance: Nuisance, xp: Backend
    ) -> tuple[FilterState, Scalar]:
        """The state after a measurement, and the innovation with its horizontal part in heading axes."""
        psi = state.x[self.vehicle.index("psi")]
        innovation = _turn(y - self.measure(state.x, nuisance, xp), self.output_names, -psi, xp)
        x, gust, drift = (rows @ innovation for rows in (gain.state, gain.gust, gain.drift))
        x, gust = _turn(x, self.vehicle.state_names, psi, xp), _turn(gust, _GUST_NAMES[: self.n_gusts], psi, xp)
        return FilterState(state.x + x, state.gust + gust, state.drift + drift), innovation

    def displace(self, state: FilterState, joined: Array) -> FilterState:
        """States by row, and what is added to them, joined rows (states, gusts, drifts) with the nose north."""
        n, g = len(self.vehicle.state_names), self.n_gusts
        psi, added = state.x[:, self.vehicle.index("psi")], joined.copy()
        c, s = np.cos(psi), np.sin(psi)
        for first, names in ((0, self.vehicle.state_names), (n, _GUST_NAMES[:g])):
            if "x" in names and "y" in names:
                i, j = first + names.index("x"), first + names.index("y")
                added[:, i], added[:, j] = c * joined[:, i] - s * joined[:, j], s * joined[:, i] + c * joined[:, j]
        x, gust, drift = np.split(added, [n, n + g], axis=1)
        return FilterState(state.x + x, state.gust + gust, state.drift + drift)

    def acting(self, state: FilterState, xp: Backend) -> Scalar:
        """The disturbances that act: gusts and drifts together, and perhaps the wind."""
        return state.gust + xp.arrays.concatenate([state.drift, np.zeros(2 * self.windy)])


def _shared_or_own(noise: Noise, kind: str) -> tuple[Values, Array, Values, Array]:
    """A number of level, downward, tilting and yawing disturbances: down and yaw have their own, where there is one."""
    force, down, moment, yaw = (getattr(noise, f"{kind}_{name}") for name in ("force", "vertical", "moment", "yaw"))
    return force, np.where(down > 0.0, down, force), moment, np.where(yaw > 0.0, yaw, moment)


_GUST_NAMES = (*DISTURBED, "x", "y")
"""The gusts, the wind by the axes that it blows along."""


def _turn(row: Scalar, names: tuple[str, ...], angle: Scalar, xp: Backend) -> Scalar:
    """The part of a row that lies along x and y, turned by an angle about the vertical.

    Sums of unit rows instead of setting entries: a loop that scatters is not compiled as one function.
    """
    if "x" not in names or "y" not in names:
        return row
    i, j = names.index("x"), names.index("y")
    along, across = np.eye(len(names))[[i, j]]
    c, s = xp.cos(angle) - 1.0, xp.sin(angle)
    return row + along * (c * row[i] - s * row[j]) + across * (s * row[i] + c * row[j])


def stochastic_model(
    vehicle: Vehicle, output_names: tuple[str, ...], dt: float, *, noise: Noise | None = None
) -> StochasticModel:
    """The stochastic model of a vehicle whose `output_names` are sampled every `dt` seconds.

    With a wind where the noise has one; its numbers may change, not whether there is any.
    """
    return StochasticModel(equations_of(vehicle), output_names, round(dt, 9), float((noise or Noise()).wind) > 0.0)
