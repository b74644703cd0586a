"""A hold that is flown from camera readings: those that the log holds, or those of cameras of its own.

Bounds of filter error hold in a closed loop where the commands are functions of the readings that the filter has
(Ljung 1999, sec. 13.4; Soederstroem and Stoica 1989, ch. 10). A real aircraft is flown so: its log holds what its
controller saw. A command that is made of true states tells of them what no reading does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import scipy.linalg
from scipy.spatial.transform import Rotation

import swashplate as sp
from swashplate.arrays import Array
from swashplate.control.laws.state_hold import state_hold_step
from swashplate.flights.schema import POSITION, QUATERNION
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.controller import Step, StepController
from swashplate.simulation.linearize import linearize
from swashplate.simulation.record import simulated_flight
from swashplate.simulation.sensors import MotionCapture
from swashplate.simulation.trim import Trim

firm_hold = partial(sp.state_hold, rate=100.0, effort=0.03)
"""A hold of the CoaX from true states; with the usual gains and 50 Hz its yaw is unstable between samples."""

POSE = (*POSITION, "phi", "theta", "psi")

_STICK = 0.1
"""Inputs that the observer does not know of (the maneuver), standard deviation in their unit."""

_PUSH = {"u": 0.05, "v": 0.05, "w": 0.05, "p": 0.1, "q": 0.1, "r": 0.1}
"""What gusts do in a sample, standard deviation [m/s, rad/s]."""

_FAR = 0.02
"""An error this large is that of swapped markers, which conditioning finds and the hold does not believe [m, rad]."""


@dataclass(frozen=True)
class SeenHold(StepController):
    """`state_hold` behind a Kalman filter of the linear model, for `simulate_closed_loop`.

    Attributes:
        errors: of its cameras, a row per sample: of the pose, and 1 where there is a frame, 0 where there is none.
    """

    rate: float
    memory: Array
    gains: Array
    step: Step
    errors: Array

    @property
    def drawn(self) -> int:
        return self.errors.shape[1]

    def draws(self, samples: int, seed: int | None = None) -> Array:
        return self.errors[:samples]


def seen_hold(seed: int, *, duration: float) -> Callable[[Vehicle, Trim], SeenHold]:
    """A hold that sees what `sp.observe` with the same seed will write down, with its gaps and swapped markers.

    Args:
        seed: of the cameras that it is flown from.
        duration: of the flight at least [s].
    """

    def hold(vehicle: Vehicle, trim: Trim) -> SeenHold:
        inner, model = firm_hold(vehicle, trim), linearize(vehicle, trim)
        n, m = model.B.shape
        F = scipy.linalg.expm(np.block([[model.A, model.B], [np.zeros((m, n + m))]]) / inner.rate)
        A, B = F[:n, :n], F[:n, n:]
        C = np.eye(n)[[model.states.index(name) for name in POSE]]
        camera = MotionCapture()
        R = np.repeat([camera.position_noise**2, camera.attitude_noise**2], 3)
        Q = _STICK**2 * B @ B.T + np.diag([_PUSH.get(name, 0.0) ** 2 for name in model.states]) + 1e-12 * np.eye(n)
        P = scipy.linalg.solve_discrete_are(A.T, C.T, Q, np.diag(R))
        L = P @ C.T @ np.linalg.inv(C @ P @ C.T + np.diag(R))
        errors = camera_errors(vehicle, seed, duration=duration)[:: round(camera.rate / inner.rate)]
        frames = np.isfinite(errors).all(axis=1)
        told = np.column_stack([np.where(frames[:, None], errors, 0.0), frames])
        gains = np.concatenate([inner.gains, *(part.ravel() for part in (A, B, L))])
        step = partial(seen_hold_step, inputs=m, states=n)
        return SeenHold(inner.rate, np.zeros(n + m), gains, step, told)

    return hold


def camera_errors(vehicle: Vehicle, seed: int, *, duration: float) -> Array:
    """What the cameras of a seed read where the pose is zero, a row per frame [m, rad]; NaN: missing or swapped.

    Their noise does not depend on the flight, so that a still aircraft shows it.
    """
    camera, time = MotionCapture(), np.arange(round(100.0 * duration) + 1) / 100.0
    states, rows = np.zeros((time.size, len(vehicle.state_names))), np.zeros((time.size, len(vehicle.input_names) + 4))
    still = simulated_flight(vehicle, time, states, rows, details={})
    seen = sp.observe(still, vehicle, seed=seed)
    frames = np.full((round(camera.rate * duration) + 1, len(POSE)), np.nan)
    turned = Rotation.from_quat(np.roll(seen.array(QUATERNION), -1, axis=1)).as_rotvec()
    frames[np.rint(camera.rate * seen.time("x")).astype(int)] = np.column_stack([seen.array(POSITION), turned])
    frames[np.abs(frames).max(axis=1) > _FAR] = np.nan
    return frames


def seen_hold_step(
    memory: Any, measured: Any, reference: Any, gains: Any, xp: Any, *, inputs: int, states: int
) -> tuple[Any, Any]:
    """Estimated deviations from the trim and from the inputs of before in, the same and the commands out."""
    n, m, k = states, inputs, len(POSE)
    parts = np.cumsum([m * n + m + n, n * n, n * m])
    hold, A, B, L = np.split(gains, parts)
    A, B, L = A.reshape(n, n), B.reshape(n, m), L.reshape(n, k)
    rest, held = hold[m * n + m :], hold[m * n : m * n + m]
    expected = A @ memory[:n] + B @ memory[n:]
    voltage, error, there = measured[n], measured[n + 1 : n + 1 + k], measured[n + 1 + k]
    # The cameras turn about the body's axes: what this does to the angles.
    phi, theta = measured[6], measured[7]
    across = error[4] * xp.sin(phi) + error[5] * xp.cos(phi)
    angles = xp.stack(
        [
            error[3] + across * xp.tan(theta),
            error[4] * xp.cos(phi) - error[5] * xp.sin(phi),
            across / xp.cos(theta),
        ]
    )
    pose = xp.concatenate([measured[:3] + error[:3], measured[6:9] + angles])
    innovation = pose - (expected + rest)[[0, 1, 2, 6, 7, 8]]
    estimate = expected + L @ (there * innovation)
    seen = xp.concatenate([estimate + rest, xp.atleast_1d(voltage)])
    _, commands = state_hold_step(np.zeros(1), seen, reference, hold, xp, inputs=m, states=n)
    return xp.concatenate([estimate, commands - held]), commands
