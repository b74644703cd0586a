"""What belongs to one record of a vehicle and not to the vehicle."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from swashplate.filtering.disturbances import DISTURBED, on_axes


class Nuisance(NamedTuple):
    """What belongs to one record and not to the vehicle.

    `delay_*`: time by which the motion lags the logged commands [s]; `trim_*`: zeros of the commands; `lever_*`: from
    the centre of gravity to the tracked point in body axes [m]; `level_phi`, `level_theta`: error of the tracked body's
    level, `level_psi`: its heading against the nose [rad]; `push_*`: accelerations that the equations lack all the time
    [m/s^2, rad/s^2], with which the filter's drifts begin (a battery that is not in the middle, a bent blade).
    """

    delay_servo: Any = 0.0
    delay_motor: Any = 0.0
    trim_motor_lower: Any = 0.0
    trim_motor_upper: Any = 0.0
    trim_servo_roll: Any = 0.0
    trim_servo_pitch: Any = 0.0
    lever_x: Any = 0.0
    lever_y: Any = 0.0
    lever_z: Any = 0.0
    level_phi: Any = 0.0
    level_theta: Any = 0.0
    level_psi: Any = 0.0
    push_u: Any = 0.0
    push_v: Any = 0.0
    push_w: Any = 0.0
    push_p: Any = 0.0
    push_q: Any = 0.0
    push_r: Any = 0.0


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
