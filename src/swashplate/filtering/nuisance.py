"""What belongs to one record of a vehicle and not to the vehicle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.filtering.disturbances import DISTURBED, on_axes
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.frames import Euler, Vector, body_to_local, turned_about_z


def commands_moved(vehicle: Vehicle, dt: float, inputs: Array, nuisance: Nuisance) -> tuple[Array, Array]:
    """What reaches the vehicle at each sample, to be held there: trimmed, and later than logged; and its slopes by each
    input's delay [1/s]. Both (n, n_inputs).

    A smooth curve through the samples; before the first and after the last sample the nearest one holds.
    """
    n = inputs.shape[0]
    trims = np.stack([np.asarray(getattr(nuisance, f"trim_{name}", 0.0), dtype=float) for name in vehicle.input_names])
    delay = np.where(np.asarray(motors(vehicle)), nuisance.delay_motor, nuisance.delay_servo)
    trimmed = inputs + trims
    wanted = np.arange(n)[:, None] - delay[None, :] / dt
    place = np.clip(wanted, 0.0, n - 1.0)
    below = np.clip(np.floor(place), 0, n - 2).astype(int)
    a, b, c, d = (np.take_along_axis(trimmed, np.clip(below + k, 0, n - 1), axis=0) for k in (-1, 0, 1, 2))
    t = place - below
    # Catmull and Rom (1974): smooth in the delay, where straight lines would give the cost a kink at every sample.
    first, second, third = c - a, 2.0 * a - 5.0 * b + 4.0 * c - d, 3.0 * (b - c) + d - a
    slope = 0.5 * (first + t * (2.0 * second + t * (3.0 * third)))
    return b + 0.5 * t * (first + t * (second + t * third)), np.where(wanted == place, -slope / dt, 0.0)


def commands_by(vehicle: Vehicle, slope: Array, names: Sequence[str]) -> Array:
    """Slopes of the arriving commands by some of a record's own numbers (names, n, n_inputs).

    Args:
        slope: slopes by each input's delay, of `commands_moved`. names: of `Nuisance`; most move no command.
    """
    motor = np.array(motors(vehicle))
    ways = {"delay_motor": slope * motor, "delay_servo": slope * ~motor}
    for j, name in enumerate(vehicle.input_names):
        ways[f"trim_{name}"] = np.tile(np.arange(len(motor)) == j, (len(slope), 1)).astype(float)
    return np.stack([ways.get(name, np.zeros_like(slope)) for name in names])


def motors(vehicle: Vehicle) -> list[bool]:
    """Which inputs are motors; the others come by way of servos, with a delay of their own."""
    return [name in vehicle.traits.motors for name in vehicle.input_names]


class Nuisance(NamedTuple):
    """What belongs to one record and not to the vehicle.

    `delay_*`: time by which the motion lags the logged commands [s]; `trim_*`: zeros of the commands; `lever_*`: from
    the centre of gravity to the tracked point in body axes [m]; `level_phi`, `level_theta`: error of the tracked body's
    level, `level_psi`: its heading against the nose [rad]; `push_*`: accelerations that the equations lack all the time
    [m/s^2, rad/s^2], with which the filter's drifts begin (a battery that is not in the middle, a bent blade).
    """

    delay_servo: Scalar = 0.0
    delay_motor: Scalar = 0.0
    trim_motor_lower: Scalar = 0.0
    trim_motor_upper: Scalar = 0.0
    trim_servo_roll: Scalar = 0.0
    trim_servo_pitch: Scalar = 0.0
    lever_x: Scalar = 0.0
    lever_y: Scalar = 0.0
    lever_z: Scalar = 0.0
    level_phi: Scalar = 0.0
    level_theta: Scalar = 0.0
    level_psi: Scalar = 0.0
    push_u: Scalar = 0.0
    push_v: Scalar = 0.0
    push_w: Scalar = 0.0
    push_p: Scalar = 0.0
    push_q: Scalar = 0.0
    push_r: Scalar = 0.0


def tracked_pose(place: Vector, attitude: Euler, nuisance: Nuisance, xp: Backend) -> tuple[Vector, Euler]:
    """Place of the tracked point, and attitude of the tracked body, of a vehicle's."""
    lever = body_to_local(Vector(nuisance.lever_x, nuisance.lever_y, nuisance.lever_z), attitude, xp)
    phi, theta, psi = turned_about_z(attitude, nuisance.level_psi, xp)
    shifted = Vector(place.x + lever.x, place.y + lever.y, place.z + lever.z)
    return shifted, Euler(phi + nuisance.level_phi, theta + nuisance.level_theta, psi)


DELAYS = ("delay_servo", "delay_motor")
"""Times: no motion comes before its command, and a cost has a kink where one is a whole number of samples."""

PUSHES = tuple(f"push_{name}" for name in DISTURBED)
"""In the order of the disturbances."""

USUAL_PUSH = dict(zip(PUSHES, on_axes(0.5, 0.5, 5.0, 5.0), strict=True))
"""Standard deviations of their priors where nothing is said."""


def mean_nuisance(nuisances: Nuisance) -> Nuisance:
    """Delays and lever arms averaged over the records; trims and pushes are their flight's own and left at zero."""
    means = {name: float(np.mean(np.asarray(value))) for name, value in nuisances._asdict().items()}
    return Nuisance(**{name: 0.0 if name.startswith(("trim", "push")) else value for name, value in means.items()})
