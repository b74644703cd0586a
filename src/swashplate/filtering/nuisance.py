"""What belongs to one record of a vehicle and not to the vehicle."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from swashplate.filtering.disturbances import DISTURBED, on_axes
from swashplate.physics.backend import Scalar


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
