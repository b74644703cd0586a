"""A vehicle in disturbed air, seen by sensors: the model whose one-step predictions filter error compares.

The vehicle's own states are joined by two disturbances on each of the six accelerations: a gust (Ornstein-Uhlenbeck,
it fades) and a drift (random walk: trims, battery, servo zeros). Where asked, a horizontal wind (Ornstein-Uhlenbeck
too) acts through the equations themselves: what moving air does to the rotors depends on the very parameters that are
sought. All are held over a sample. A rotor that shakes what the cameras see may be among the sensors' noise: a line at
its frequency, of wandering phase. The measurement update has a constant gain from the Riccati equation around hover,
or around the mean flight of a helicopter that is faster (Jategaonkar 2015, sec. 5.4); horizontal position errors are
turned into the heading first, so that the gain does not depend on where the nose points.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from swashplate.arrays import Array, Values
from swashplate.engine.equations import Equations, equations_of
from swashplate.filtering.block_matrices import blocks, diagonal
from swashplate.filtering.disturbances import DISTURBED, Noise, on_axes
from swashplate.filtering.nuisance import Nuisance
from swashplate.flights.schema import POSITION, RATES
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.frames import Euler, Vector, body_to_local, turned_about_z
from swashplate.simulation.discretisation import held_series

N_DISTURBANCES = len(DISTURBED)


class FilterGain(NamedTuple):
    """Constant measurement update of states, gusts (the wind with them) and drifts, and the innovations' covariance;
    and that of a rotor's line, where there is one."""

    state: Scalar
    gust: Scalar
    drift: Scalar
    covariance: Scalar
    line: Scalar = ()


class FilterState(NamedTuple):
    """Estimated vehicle states, gusts (six accelerations, and the wind to north and east where modelled) and drifts;
    and where a rotor's line is modelled, its part of roll and pitch and of height, each with its quadrature."""

    x: Scalar
    gust: Scalar
    drift: Scalar
    line: Scalar = ()


@dataclass(frozen=True)
class StochasticModel:
    """A vehicle's equations with disturbances and sensors, as functions of flat rows.

    Two models of the same equations, outputs and rate are equal, so that compiled code serves every card.

    Attributes:
        equations: whose equations.
        output_names: measured channels.
        dt: sample time [s].
        windy: a horizontal wind is among the disturbances.
        lined: a rotor's line is among the sensors' noise.
    """

    equations: Equations
    output_names: tuple[str, ...]
    dt: float
    windy: bool = False
    lined: bool = False

    @property
    def vehicle(self) -> Vehicle:
        """For names only: its card is any card of these equations."""
        return self.equations.vehicle

    @property
    def n_gusts(self) -> int:
        """What fades: a gust on each disturbed acceleration, and perhaps the wind to north and east."""
        return N_DISTURBANCES + 2 * self.windy

    @property
    def n_line(self) -> int:
        """A rotor's line: a pair that turns for roll and pitch, and one for height."""
        return 2 * len(_LINE) * self.lined

    # ---- what is seen ------------------------------------------------------------------------------------------
    def measure(self, x: Scalar, nuisance: Nuisance, xp: Backend) -> Scalar:
        """The measured channels of a state, whose entries come first."""
        here = {name: x[self.vehicle.index(name)] for name in self.output_names}
        attitude = Euler(*(x[self.vehicle.index(name)] for name in ("phi", "theta", "psi")))
        lever = body_to_local(Vector(nuisance.lever_x, nuisance.lever_y, nuisance.lever_z), attitude, xp)
        tracked = turned_about_z(attitude, nuisance.level_psi, xp)
        seen = {
            "x": x[self.vehicle.index("x")] + lever.x,
            "y": x[self.vehicle.index("y")] + lever.y,
            "z": x[self.vehicle.index("z")] + lever.z,
            "phi": tracked.phi + nuisance.level_phi,
            "theta": tracked.theta + nuisance.level_theta,
            "psi": tracked.psi,
        }
        return xp.arrays.stack([seen.get(name, here[name]) for name in self.output_names])

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
        """A, C, Q, R of the joined system (states, gusts, drifts, line), about steady flight with the nose north.

        Args:
            by_x, by_gust: slopes of the rates by states and disturbances, with any axes in front.
            by_state: slopes of the measured channels by the states.
            noise: numbers, or rows of them along the axes in front.
        """
        n, g, d, k = by_x.shape[-1], self.n_gusts, N_DISTURBANCES, self.n_line
        by_x, held = held_series(by_x, self.dt, np.eye(n))  # as `step` makes it of a linear system
        by_gust = self.dt * held @ by_gust
        by_push = by_gust[..., :d]
        moves = np.concatenate([by_gust, by_push, np.zeros((*by_push.shape[:-1], k))], axis=-1)
        A = blocks([[by_x, moves], [None, self.lasting(noise)]], (n, g + d + k))
        shaken = np.broadcast_to(self.line_seen, (*by_state.shape[:-1], k))
        C = np.concatenate([by_state, np.zeros((*by_state.shape[:-1], g + d)), shaken], axis=-1)
        return A, C, self.process_noise(by_push, noise), diagonal(self.sensor_variances(noise))

    def white(self, noise: Noise) -> Array:
        """Intensities of white noise on the disturbed accelerations."""
        tilt, yaw, horizontal, vertical = noise[:4]
        return np.stack(on_axes(horizontal, vertical, tilt, yaw), axis=-1)

    def process_noise(self, by_push: Array, noise: Noise) -> Array:
        """Covariance of what a sample adds to states, gusts, drifts and the line.

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
        rms = np.stack([noise.line_angle, noise.line_angle, noise.line_height, noise.line_height], axis=-1)
        line = diagonal((1.0 - self._line_kept(noise) ** 2)[..., None] * rms[..., : self.n_line] ** 2)
        rows = [[spread, None, None, None], [None, gusts, None, None], [None, None, drifts, None], [None] * 3 + [line]]
        return blocks(rows, (n, g, d, self.n_line))

    def gain_of(self, K: Array, S: Array) -> FilterGain:
        """The parts of a joined gain (..., joined, outputs)."""
        n, d = len(self.vehicle.state_names), len(self.vehicle.state_names) + self.n_gusts
        k = d + N_DISTURBANCES
        line = K[..., k:, :] if self.lined else ()
        return FilterGain(K[..., :n, :], K[..., n:d, :], K[..., d:k, :], S, line)

    def fade(self, noise: Noise) -> Array:
        """What is left of each gust after one sample."""
        taus = [*on_axes(*_shared_or_own(noise, "tau_gust")), noise.tau_wind, noise.tau_wind]
        return np.exp(-self.dt / np.stack(taus[: self.n_gusts], axis=-1))

    def lasting(self, noise: Noise) -> Array:
        """How gusts, drifts and the line together go on for one sample (..., all three, all three)."""
        fade, turn = diagonal(self.fade(noise)), self.line_turn(noise)
        rows = [[fade, None, None], [None, np.eye(N_DISTURBANCES), None], [None, None, turn]]
        return blocks(rows, (self.n_gusts, N_DISTURBANCES, self.n_line))

    def line_turn(self, noise: Noise) -> Array:
        """The line one sample later (..., n_line, n_line): pairs that turn by its frequency, and forget their phase."""
        angle, quarter = 2.0 * np.pi * self.dt * noise.line_hertz, [[0.0, -1.0], [1.0, 0.0]]
        along, across = (self._line_kept(noise) * part for part in (np.cos(angle), np.sin(angle)))
        over = np.kron(np.eye(self.n_line // 2), quarter)
        return along[..., None, None] * np.eye(self.n_line) + across[..., None, None] * over

    def _line_kept(self, noise: Noise) -> Array:
        return np.exp(-self.dt / np.asarray(noise.line_time))

    @property
    def line_seen(self) -> Array:
        """What the line adds to the measured channels (outputs, n_line): roll + i pitch turns, height swings."""
        pairs = np.eye(2 * len(_LINE))
        shaken = {"phi": pairs[0], "theta": pairs[1], "z": pairs[2]}
        return np.stack([shaken.get(name, 0.0 * pairs[0]) for name in self.output_names])[:, : self.n_line]

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
        expected = self.measure(state.x, nuisance, xp)
        expected = expected + self.line_seen @ state.line if self.lined else expected
        innovation = _turn(y - expected, self.output_names, -psi, xp)
        x, gust, drift = (rows @ innovation for rows in (gain.state, gain.gust, gain.drift))
        x, gust = _turn(x, self.vehicle.state_names, psi, xp), _turn(gust, _GUST_NAMES[: self.n_gusts], psi, xp)
        line = state.line + gain.line @ innovation if self.lined else ()
        return FilterState(state.x + x, state.gust + gust, state.drift + drift, line), innovation

    def moved(self, state: FilterState, joined: Array) -> FilterState:
        """States by row, and what is added to them, joined rows (states, gusts, drifts, line) with the nose north."""
        n, g = len(self.vehicle.state_names), self.n_gusts
        psi, added = state.x[:, self.vehicle.index("psi")], joined.copy()
        c, s = np.cos(psi), np.sin(psi)
        for first, names in ((0, self.vehicle.state_names), (n, _GUST_NAMES[:g])):
            if "x" in names and "y" in names:
                i, j = first + names.index("x"), first + names.index("y")
                added[:, i], added[:, j] = c * joined[:, i] - s * joined[:, j], s * joined[:, i] + c * joined[:, j]
        x, gust, drift, line = np.split(added, [n, n + g, n + g + N_DISTURBANCES], axis=1)
        line = state.line + line if self.lined else ()
        return FilterState(state.x + x, state.gust + gust, state.drift + drift, line)

    def acting(self, state: FilterState, xp: Backend) -> Scalar:
        """The disturbances that act: gusts and drifts together, and perhaps the wind."""
        return state.gust + xp.arrays.concatenate([state.drift, np.zeros(2 * self.windy)])


def _shared_or_own(noise: Noise, kind: str) -> tuple[Values, Array, Values, Array]:
    """A number of level, downward, tilting and yawing disturbances: down and yaw have their own, where there is one."""
    force, down, moment, yaw = (getattr(noise, f"{kind}_{name}") for name in ("force", "vertical", "moment", "yaw"))
    return force, np.where(down > 0.0, down, force), moment, np.where(yaw > 0.0, yaw, moment)


_LINE = ("roll and pitch", "height")
"""What a rotor's line shakes, each by a pair of states."""

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

    With a wind and a rotor's line where the noise has them; their numbers may change, not whether there are any.
    """
    noise = noise or Noise()
    windy, lined = float(noise.wind) > 0.0, float(noise.line_hertz) != 0.0
    return StochasticModel(equations_of(vehicle), output_names, round(dt, 9), windy, lined)
