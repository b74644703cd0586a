"""The observer on a logged flight, open loop: what it would have estimated, and how well that predicts.

The commands are the logged ones, the readings what motion capture logged. Beside the observer runs its rival: the raw
model, whose body is set to the measured motion (differentiated attitude and place) at every sample and whose rotors and
bar follow the equations unobserved. Both predict the rates some samples ahead; the flight judges.

The CoaX shakes at its rotors' 36 Hz. Readings that are taken every third sample of 100 Hz, each the mean of three
samples, have a notch there: the observer is not asked to explain a vibration that its equations do not have.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.ndimage
from jaxtyping import Float
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

from swashplate.arrays import Array
from swashplate.control.lqg.controller import Lqg
from swashplate.errors import ControllerError
from swashplate.filtering import observer
from swashplate.filtering.filter_loop import filtered
from swashplate.filtering.matrix_operations import JaxMatrices
from swashplate.filtering.observer import Numbers, ObserverEstimate, ObserverPlan
from swashplate.flights.flight import Flight
from swashplate.flights.schema import ATTITUDE, POSITION, RATES
from swashplate.identification.core.records import uniform_table
from swashplate.jax_on_demand import jax, jit, jnp
from swashplate.physics.backend import FloatBackend
from swashplate.physics.frames import Euler, Vector, body_to_local, turned_about_z
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.compilation import QUICK_FLIGHT
from swashplate.simulation.dynamics import enable_double_precision
from swashplate.simulation.runge_kutta import rk4_steps

POSE = (*POSITION, *ATTITUDE)
_SETTLING = 1.5
"""Seconds that are not judged, as in the identification's own filter."""
_BODY = len(RigidBody._fields)


@dataclass(frozen=True)
class Along:
    """An observer along a flight.

    Attributes:
        time: [s], shape (n,).
        estimates: of the vehicle's states after each reading, (n, states).
        innovations: of the six readings when they are taken, (readings, 6), without the first `_SETTLING` seconds.
        covariance: what the observer expects of them (mean, (6, 6)).
        ahead: of the predictions [s].
        measured: rates p, q, r when they are predicted for, (n, 3); the last ones are not finite.
        predicted, raw: the same by the observer and by the raw model.
    """

    time: Array
    estimates: Array
    innovations: Array
    covariance: Array
    ahead: float
    measured: Array
    predicted: Array
    raw: Array

    def rms(self) -> dict[str, tuple[float, float, float]]:
        """By rate the RMS of the observer's and of the raw model's prediction error and of the rate [rad/s]."""
        good = np.all(np.isfinite(self.measured), axis=1) & (self.time - self.time[0] > _SETTLING)
        errors = [np.sqrt(np.mean(part[good] ** 2, axis=0)) for part in self._parts()]
        return {name: (float(errors[0][i]), float(errors[1][i]), float(errors[2][i])) for i, name in enumerate(RATES)}

    def _parts(self) -> tuple[Array, Array, Array]:
        return self.predicted - self.measured, self.raw - self.measured, self.measured


def at_centre(flight: Flight, *, lever: tuple[float, float, float], heading: float) -> Array:
    """Logged pose of a tracked body as the pose of the centre of gravity, shape (n, 6).

    Args:
        flight: with place and attitude on a uniform grid.
        lever: from the centre of gravity to the tracked point in body axes [m].
        heading: of the tracked body against the nose [rad].
    """
    xp = FloatBackend()
    _, table = uniform_table(flight, POSE, who="the observer")
    rows = []
    for x, y, z, phi, theta, psi in table:
        attitude = turned_about_z(Euler(phi, theta, psi), -heading, xp)
        off = body_to_local(Vector(*lever), attitude, xp)
        rows.append([x - off.x, y - off.y, z - off.z, *attitude])
    return np.array(rows)


def along(controller: Lqg, flight: Flight, pose: Array, *, ahead: float = 0.1) -> Along:
    """Run a controller's observer along one unbroken, conditioned flight.

    Args:
        controller: its only sensor is motion capture without delay, at a whole part of the controller's rate; a
            reading is the mean of the samples about it. Its delays are those of the log's commands.
        flight: at the controller's rate.
        pose: of the centre of gravity (`at_centre`).
        ahead: how far the rates are predicted [s].

    Raises:
        ControllerError: for other sensors or another rate. FlightError: where a channel is missing.
    """
    enable_double_precision()
    plan = controller.plan
    if len(plan.sensors) != 1 or plan.channels != tuple(f"mocap.{name}" for name in POSE) or plan.sampling[0].late:
        raise ControllerError("a log is replayed to motion capture alone, without delay.", channel="sensors")
    vehicle = plan.equations.vehicle
    wanted = (*vehicle.input_names, *RigidBody._fields)
    time, table = uniform_table(flight, wanted, who="the observer")
    if abs(float(np.mean(np.diff(time))) * plan.rate - 1.0) > 1e-3:
        raise ControllerError(f"the flight is at {1 / np.mean(np.diff(time)):.1f} Hz.", channel="rate")
    n, every = len(time), plan.sampling[0].every
    turned = np.column_stack([pose[:, :3], np.unwrap(pose[:, 3:], axis=0)])
    read = scipy.ndimage.uniform_filter1d(turned, every, axis=0, mode="nearest")
    late = np.column_stack([table[np.maximum(np.arange(n) - d, 0), j] for j, d in enumerate(plan.delays)])
    volts = flight.values("voltage") if "voltage" in flight else np.full(n, float(controller.feedback.voltage))
    rates = _smoothed_rates(pose, plan.dt)
    steps = round(ahead * plan.rate)
    mean = np.zeros((len(plan.names), 1))
    mean[: plan.n, 0] = controller.start.state
    mean[[vehicle.index(name) for name in POSE], 0] = pose[0]
    variance = np.diag(observer.start_variance(plan, controller.unrest))
    arrays = _along(
        plan,
        steps,
        Numbers(*(None if part is None else jnp.asarray(part) for part in controller.numbers)),
        jnp.asarray(mean),
        jnp.asarray(variance * 10.0),
        jnp.asarray(read),
        jnp.asarray(np.column_stack([late, volts])),
        jnp.asarray(_measured_body(pose, rates, plan.dt)),
    )
    estimates, innovations, covariances, predicted, raw = (np.asarray(part) for part in arrays)
    later = np.full((n, 3), np.nan)
    later[: n - steps] = rates[steps:]
    taken = np.arange(n) % every == 0
    taken[: round(_SETTLING * plan.rate)] = False
    return Along(time, estimates, innovations[taken], covariances[taken].mean(axis=0), ahead, later, predicted, raw)


def _smoothed_rates(pose: Array, dt: float) -> Array:
    """Body rates from the attitude: central differences over a fit of 7 samples (Savitzky and Golay 1964)."""
    angles = np.unwrap(pose[:, 3:], axis=0)
    phi, theta = angles[:, 0], angles[:, 1]
    dphi, dtheta, dpsi = savgol_filter(angles, 7, 2, deriv=1, delta=dt, axis=0).T
    return np.column_stack(
        [
            dphi - dpsi * np.sin(theta),
            dtheta * np.cos(phi) + dpsi * np.sin(phi) * np.cos(theta),
            -dtheta * np.sin(phi) + dpsi * np.cos(phi) * np.cos(theta),
        ]
    )


def _measured_body(pose: Array, rates: Array, dt: float) -> Array:
    """The rigid body's twelve states as measured."""
    local = savgol_filter(pose[:, :3], 7, 2, deriv=1, delta=dt, axis=0)
    velocity = Rotation.from_euler("ZYX", pose[:, [5, 4, 3]]).inv().apply(local)
    return np.column_stack([pose[:, :3], velocity, pose[:, 3:], rates])


@jit(static_argnums=(0, 1), compiler_options=QUICK_FLIGHT)
def _along(
    plan: ObserverPlan,
    steps: int,
    numbers: Numbers,
    mean: Float[jax.Array, "n 1"],
    covariance: Float[jax.Array, "n n"],
    pose: Float[jax.Array, "samples channels"],
    driving: Float[jax.Array, "samples driving"],
    body: Float[jax.Array, "samples body"],
) -> Any:
    M = JaxMatrices()
    n = plan.n
    p = slice(plan.equations.vehicle.index("p"), plan.equations.vehicle.index("r") + 1)

    def moved(e: Float[jax.Array, "n 1"], w: Float[jax.Array, "driving 1"], count: int) -> Any:
        """The state `count` samples later."""

        def rates(e: Float[jax.Array, "n 1"], w: Float[jax.Array, "driving 1"]) -> Any:
            return M.value(lambda e, w: observer.moving(plan, numbers, e, w, M.xp), e, w)

        return rk4_steps(rates, e, lambda *_: w, plan.dt, count)

    def correct(state: tuple[ObserverEstimate, Any], seen: tuple[Any, Any], now: tuple[Any, Any]) -> Any:
        """The rival without a filter begins at what is measured."""
        (estimate, rival), (y, measured), (w, due) = state, seen, now
        estimate, innovation, S = observer.corrected(plan, numbers, estimate, y, [due], w, M)
        rival = rival.at[:_BODY, 0].set(measured)
        ahead = moved(estimate.mean, w, steps)[p, 0], moved(rival, w, steps)[p, 0]
        return (estimate, rival), (estimate.mean[:n, 0], innovation[:, 0], S, *ahead)

    def predict(state: tuple[ObserverEstimate, Any], now: tuple[Any, Any]) -> tuple[ObserverEstimate, Any]:
        (estimate, rival), (w, _) = state, now
        return observer.predicted(plan, numbers, estimate, w, [1.0], M), moved(rival, w, 1)

    start = ObserverEstimate(mean, covariance), mean.at[n:].set(0.0)
    due = jnp.where(jnp.arange(len(pose)) % plan.sampling[0].every == 0, 1.0, 0.0)
    seen, now = (pose[:, :, None], body), (driving[:, :, None], due)
    return filtered(start, seen, now, correct=correct, predict=predict)[1][0]
