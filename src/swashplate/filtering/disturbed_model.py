"""A vehicle in disturbed air, seen by sensors: the model whose one-step predictions prediction error compares.

The vehicle's own states are joined by two disturbances on each of the six accelerations: a gust (Ornstein-Uhlenbeck,
it fades) and a drift (random walk: trims, battery, servo zeros). Where asked, a horizontal wind (Ornstein-Uhlenbeck
too) acts through the equations themselves: what moving air does to the rotors depends on the very parameters that are
sought. All are held over a sample. The measurement update has a constant gain from the Riccati equation around hover,
or around the mean flight of a helicopter that is faster (Jategaonkar 2015, sec. 5.4); horizontal position errors are
turned into the heading first, so that the gain does not depend on where the nose points.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from swashplate.filtering.disturbances import DISTURBED, Noise, on_axes
from swashplate.filtering.filter_loop import filtered
from swashplate.filtering.nuisance import Nuisance
from swashplate.filtering.riccati import kalman_gain
from swashplate.flights.schema import POSITION, RATES
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend
from swashplate.physics.frames import Euler, Vector, body_to_local, turned_about_z
from swashplate.simulation.discretisation import held_series
from swashplate.simulation.dynamics import (
    CONSTANTS,
    Equations,
    equations_of,
    jax_backend,
    row_rates,
)
from swashplate.simulation.runge_kutta import rk4_step

N_DISTURBANCES = len(DISTURBED)


class FilterGain(NamedTuple):
    """Constant measurement update of states, gusts (the wind with them) and drifts, and the innovations' covariance."""

    state: Any
    gust: Any
    drift: Any
    covariance: Any


Advance = Callable[[Any, Any, Any], Any]
"""A state row one sample later, from the row, the disturbances that act and what holds at this sample."""


class FilterState(NamedTuple):
    """Estimated vehicle states, gusts (six accelerations, and the wind to north and east where modelled) and drifts."""

    x: Any
    gust: Any
    drift: Any


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

    # ---- one sample --------------------------------------------------------------------------------------------
    def step(self, x: Any, gust: Any, u: Any, parameters: Any, voltage: Any) -> Any:
        """The state one sample later, with commands and disturbances held.

        Disturbances are accelerations as in `DISTURBED`, and perhaps the wind.
        """
        rates, push = self._rates(parameters), self._push(gust)
        driving = self._driving(gust, u, voltage)
        return rk4_step(lambda x, w: rates(x, w) + push, x, lambda _: driving, self.dt, looped=True)

    def _rates(self, parameters: Any) -> Any:
        rates = row_rates(self.equations, padded=False)
        around = environment_of(self.vehicle, parameters=parameters)
        constants = [getattr(around, name) for name in CONSTANTS]
        numbers = jnp.stack([jnp.asarray(value, dtype=float) for value in (*parameters, *constants)])
        return lambda x, w: rates(x, w, numbers)

    def _push(self, gust: Any) -> Any:
        """The accelerations of a gust as rates of a whole state row."""
        units = np.eye(len(self.vehicle.state_names))[self.disturbed]
        return sum(gust[i] * unit for i, unit in enumerate(units))

    def _driving(self, gust: Any, u: Any, voltage: Any) -> Any:
        """Inputs, wind and voltage side by side."""
        return jnp.concatenate([u, gust[N_DISTURBANCES:], jnp.zeros(3 - 2 * self.windy), voltage[None]])

    def measure(self, x: Any, nuisance: Nuisance, xp: Backend | None = None) -> Any:
        """The measured channels of a state, whose entries come first; JAX's operations where `xp` is None."""
        xp = xp or jax_backend()
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
    def linear(
        self, x: Any, u: Any, parameters: Any, voltage: Any, noise: Noise, nuisance: Nuisance
    ) -> tuple[Any, Any, Any, Any]:
        """A, C, Q, R of the joined system (states, gusts, drifts) around an equilibrium with the nose north.

        Wind acts through terms that grow with the square of the speed and have no slope at rest; with wind, slopes are
        averaged over a normal distribution of the horizontal air speed by four points (statistical linearisation,
        Gelb 1974, sec. 6.2; cubature of the third degree).
        """
        places, still = jnp.stack(self.places(x, noise, jnp)), jnp.zeros(self.n_gusts)
        by_x, by_gust = (
            jnp.mean(part, axis=0)
            for part in jax.vmap(lambda x: self.slopes(x, still, u=u, parameters=parameters, voltage=voltage))(places)
        )
        by_state = jax.jacfwd(lambda x: self.measure(x, nuisance))(x)
        return self.joined(by_x, by_gust, by_state, noise, jnp)

    def places(self, x: Any, noise: Noise, xp: Any) -> list[Any]:
        """Where slopes are taken and averaged: the equilibrium itself, four points about it with wind."""
        if not self.windy:
            return [x]
        sigma = xp.sqrt(noise.speed**2 + 0.5 * noise.tau_wind * noise.wind**2)
        along = np.sqrt(2.0) * np.eye(x.shape[-1])[self.disturbed[:2]]
        return [x + sign * sigma[..., None] * way for sign in (1.0, -1.0) for way in along]

    def joined(self, by_x: Any, by_gust: Any, by_state: Any, noise: Noise, xp: Any) -> tuple[Any, Any, Any, Any]:
        """A, C, Q, R of the joined system.

        Args:
            by_x, by_gust: slopes of the rates by states and disturbances, with any axes in front.
            by_state: slopes of the measured channels by the states.
            noise: numbers, or rows of them along the axes in front.
            xp: `numpy` or `jax.numpy`.
        """
        n, g, d = by_x.shape[-1], self.n_gusts, N_DISTURBANCES
        by_x, held = held_series(by_x, self.dt, np.eye(n))  # as `step` makes it of a linear system
        by_gust = self.dt * held @ by_gust
        by_push = by_gust[..., :d]
        fade = _diagonal(self.fade(noise, xp), xp)
        A = _blocks([[by_x, by_gust, by_push], [None, fade, None], [None, None, np.eye(d)]], (n, g, d), xp)
        C = xp.concatenate([by_state, xp.zeros((*by_state.shape[:-1], g + d))], axis=-1)
        return A, C, self.process_noise(by_push, noise, xp), _diagonal(self.sensor_variances(noise, xp), xp)

    def rates(self, x: Any, gust: Any, *, u: Any, parameters: Any, voltage: Any) -> Any:
        """Rates of a state row under commands and disturbances."""
        return self._rates(parameters)(x, self._driving(gust, u, voltage)) + self._push(gust)

    def slopes(self, x: Any, gust: Any, *, u: Any, parameters: Any, voltage: Any) -> tuple[Any, Any]:
        """Slopes of the rates by the state (states, states) and by the disturbances (states, gusts)."""
        push, wind = gust[:N_DISTURBANCES], gust[N_DISTURBANCES:]

        def moved(x: Any, wind: Any) -> Any:
            return self.rates(x, jnp.concatenate([push, wind]), u=u, parameters=parameters, voltage=voltage)

        by_x, by_wind = jax.jacfwd(moved, argnums=(0, 1))(x, wind)
        pushed = np.eye(x.shape[0])[:, self.disturbed]  # an acceleration is the rate of one state
        return by_x, jnp.concatenate([pushed, by_wind], axis=1)

    def process_noise(self, by_push: Any, noise: Noise, xp: Any = jnp) -> Any:
        """Covariance of what a sample adds to states, gusts and drifts.

        Args:
            by_push: how an acceleration that is held over the sample moves the states (..., states, accelerations).
            noise: intensities.
            xp: `numpy` or `jax.numpy`.
        """
        n, g, d = by_push.shape[-2], self.n_gusts, N_DISTURBANCES
        tilt, yaw, horizontal, vertical = noise[:4]
        white = xp.stack(on_axes(horizontal, vertical, tilt, yaw), axis=-1)
        tilt, yaw, horizontal, vertical = noise[4:8]
        gust = xp.stack([*on_axes(horizontal, vertical, tilt, yaw), noise.wind, noise.wind][:g], axis=-1)
        drift = xp.stack(on_axes(*_shared_or_own(noise, "drift", xp)), axis=-1)
        # White acceleration noise enters as by_push does, for one sample; the floor keeps unexcited states observable.
        spread = (by_push * (white**2 / self.dt)[..., None, :]) @ xp.swapaxes(by_push, -1, -2) + self._floor(n)
        gusts, drifts = (_diagonal(row**2 * self.dt, xp) for row in (gust, drift))
        return _blocks([[spread, None, None], [None, gusts, None], [None, None, drifts]], (n, g, d), xp)

    def gain(self, x: Any, u: Any, parameters: Any, voltage: Any, noise: Noise, nuisance: Nuisance) -> FilterGain:
        """Steady gain at an equilibrium with the nose north."""
        n, g = x.shape[0], self.n_gusts
        K, S = kalman_gain(*self.linear(x, u, parameters, voltage, noise, nuisance))
        return FilterGain(K[:n], K[n : n + g], K[n + g :], S)

    def fade(self, noise: Noise, xp: Any = jnp) -> Any:
        """What is left of each gust after one sample."""
        taus = [*on_axes(*_shared_or_own(noise, "tau_gust", xp)), noise.tau_wind, noise.tau_wind]
        return xp.exp(-self.dt / xp.stack(taus[: self.n_gusts], axis=-1))

    def _floor(self, n: int) -> Any:
        """A little noise on the states that no disturbance reaches: rotor speeds [rad/s] and angles [rad]."""
        speeds = [name.startswith("omega") for name in self.vehicle.state_names]
        return np.diag(np.where(np.array(speeds), 1e-4, 1e-10)[:n])

    def sensor_variances(self, noise: Noise, xp: Any = jnp) -> Any:
        """Variances of the measured channels."""
        sigma = dict.fromkeys(POSITION, noise.sensor_position)
        sigma |= dict.fromkeys(RATES, xp.where(noise.sensor_rate > 0.0, noise.sensor_rate, noise.sensor_angle))
        return xp.stack([sigma.get(name, noise.sensor_angle) ** 2 for name in self.output_names], axis=-1)

    @property
    def n_outputs(self) -> int:
        return len(self.output_names)

    def correct(self, state: FilterState, y: Any, gain: FilterGain, nuisance: Nuisance) -> tuple[FilterState, Any]:
        """The state after a measurement, and the innovation with its horizontal part in heading axes."""
        psi = state.x[self.vehicle.index("psi")]
        innovation = _turn(y - self.measure(state.x, nuisance), self.output_names, -psi)
        x, gust, drift = (rows @ innovation for rows in (gain.state, gain.gust, gain.drift))
        x, gust = _turn(x, self.vehicle.state_names, psi), _turn(gust, _GUST_NAMES[: self.n_gusts], psi)
        return FilterState(state.x + x, state.gust + gust, state.drift + drift), innovation

    def acting(self, state: FilterState) -> Any:
        """The disturbances that act: gusts and drifts together, and perhaps the wind."""
        return state.gust + jnp.concatenate([state.drift, jnp.zeros(2 * self.windy)])

    def predict(self, state: FilterState, noise: Noise, advance: Advance, now: Any) -> FilterState:
        """The state one sample later."""
        return FilterState(advance(state.x, self.acting(state), now), self.fade(noise) * state.gust, state.drift)

    def run(
        self,
        start: FilterState,
        y: Any,
        advance: Advance,
        along: Any,
        noise: Noise,
        nuisance: Nuisance,
        gain: FilterGain,
    ) -> tuple[FilterState, tuple[Any, FilterState]]:
        """The state predicted after the last sample; innovations (n, n_outputs) and the states after each measurement.

        Args:
            start: predicted state at the first sample.
            y: measurements (n, n_outputs).
            advance: a state row one sample later.
            along: what `advance` is told, by sample.
            noise, nuisance, gain: of this record.
        """

        return filtered(
            start,
            y,
            along,
            correct=lambda state, measured, _: self.correct(state, measured, gain, nuisance),
            predict=lambda state, now: self.predict(state, noise, advance, now),
        )


def _diagonal(rows: Any, xp: Any) -> Any:
    """Diagonal matrices of rows (..., n)."""
    return rows[..., None] * xp.eye(rows.shape[-1])


def _blocks(rows: Any, sizes: tuple[int, ...], xp: Any) -> Any:
    """Matrices of blocks of these sizes, with any axes in front; None is zeros."""
    front = np.broadcast_shapes(*(block.shape[:-2] for row in rows for block in row if block is not None))
    whole = [
        xp.concatenate(
            [
                xp.zeros((*front, high, wide)) if block is None else xp.broadcast_to(block, (*front, high, wide))
                for block, wide in zip(row, sizes, strict=True)
            ],
            axis=-1,
        )
        for row, high in zip(rows, sizes, strict=True)
    ]
    return xp.concatenate(whole, axis=-2)


def _shared_or_own(noise: Noise, kind: str, xp: Any = jnp) -> tuple[Any, Any, Any, Any]:
    """A number of level, downward, tilting and yawing disturbances: down and yaw have their own, where there is one."""
    force, down, moment, yaw = (getattr(noise, f"{kind}_{name}") for name in ("force", "vertical", "moment", "yaw"))
    return force, xp.where(down > 0.0, down, force), moment, xp.where(yaw > 0.0, yaw, moment)


_GUST_NAMES = (*DISTURBED, "x", "y")
"""The gusts, the wind by the axes that it blows along."""


def _turn(row: Any, names: tuple[str, ...], angle: Any) -> Any:
    """The part of a row that lies along x and y, turned by an angle about the vertical.

    Sums of unit rows instead of setting entries: a loop that scatters is not compiled as one function.
    """
    if "x" not in names or "y" not in names:
        return row
    i, j = names.index("x"), names.index("y")
    along, across = np.eye(len(names))[[i, j]]
    c, s = jnp.cos(angle) - 1.0, jnp.sin(angle)
    return row + along * (c * row[i] - s * row[j]) + across * (s * row[i] + c * row[j])


def stochastic_model(
    vehicle: Vehicle, output_names: tuple[str, ...], dt: float, *, windy: bool = False
) -> StochasticModel:
    """The stochastic model of a vehicle whose `output_names` are sampled every `dt` seconds."""
    return StochasticModel(equations_of(vehicle), output_names, round(dt, 9), windy)


def commands(vehicle: Vehicle, dt: float, inputs: Any, nuisance: Nuisance) -> Any:
    """What reaches the vehicle at each sample, to be held there: trimmed, and later than logged (n, n_inputs).

    A smooth curve through the samples; before the first and after the last sample the nearest one holds.
    """
    return commands_moved(vehicle, dt, inputs, nuisance, jnp)[0]


def commands_moved(vehicle: Vehicle, dt: float, inputs: Any, nuisance: Nuisance, xp: Any) -> tuple[Any, Any]:
    """`commands`, and their slopes by each input's delay [1/s], both (n, n_inputs); `xp` is `numpy` or `jax.numpy`."""
    n = inputs.shape[0]
    trims = xp.stack([xp.asarray(getattr(nuisance, f"trim_{name}", 0.0), dtype=float) for name in vehicle.input_names])
    delay = xp.where(xp.asarray(motors(vehicle)), nuisance.delay_motor, nuisance.delay_servo)
    trimmed = inputs + trims
    wanted = xp.arange(n)[:, None] - delay[None, :] / dt
    place = xp.clip(wanted, 0.0, n - 1.0)
    below = xp.clip(xp.floor(place), 0, n - 2).astype(int)
    a, b, c, d = (xp.take_along_axis(trimmed, xp.clip(below + k, 0, n - 1), axis=0) for k in (-1, 0, 1, 2))
    t = place - below
    # Catmull and Rom (1974): smooth in the delay, where straight lines would give the cost a kink at every sample.
    first, second, third = c - a, 2.0 * a - 5.0 * b + 4.0 * c - d, 3.0 * (b - c) + d - a
    slope = 0.5 * (first + t * (2.0 * second + t * (3.0 * third)))
    return b + 0.5 * t * (first + t * (second + t * third)), xp.where(wanted == place, -slope / dt, 0.0)


def motors(vehicle: Vehicle) -> list[bool]:
    """Which inputs are motors; the others come by way of servos, with a delay of their own."""
    return [name.startswith("motor") for name in vehicle.input_names]
