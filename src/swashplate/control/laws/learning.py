"""What a flown step teaches the decoupling: the lag that flies straight, and how the lower rotor tilts with speed.

The identified models that a hover flight cannot tell apart differ most in that tilt, and a path that bends with the law
on is its measurement.
"""

from __future__ import annotations

import math
from dataclasses import replace

from scipy.optimize import brentq

from swashplate.control.analysis.straightness import step_paths
from swashplate.control.laws.autopilot import Autopilot
from swashplate.errors import ControllerError
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.trim import Trim

_NUDGE = 0.004
"""rad s/m; a change of the law's tilt with speed that moves the path by half a metre on the CoaX."""
_FURTHEST_LAG = math.radians(40.0)
"""Either way of the rotor's own lag; a step that needs more is not bent by a lag."""
_LAG_TOLERANCE = math.radians(0.02)


def straightened(
    vehicle: Vehicle,
    controller: Autopilot,
    trim: Trim,
    *,
    command: float,
    distance: float = 6.0,
    duration: float = 10.0,
) -> Autopilot:
    """The controller whose law takes out the lag with which the model ends a step straight ahead.

    The lower rotor's own lag leaves the path bent by what its equations do not hold: the stabilizer bar's misalignment,
    the delays and lags between command and rotor. A constant on top of the rotor's lag takes them in; it is found by
    flying the model, with its delays.

    Args:
        vehicle: the model that the law was made from.
        controller: in mode "manual", decoupled, with the rotor's lag by one of `LAGS`.
        trim: the hover.
        command: the step of the pitch command.
        distance: after which the drift is to be zero [m].
        duration: after which the model's flight is given up [s].

    Raises:
        ControllerError: where no lag within 40 deg of the rotor's does it, or the model does not cover the distance.
    """

    def with_lag(change: float) -> Autopilot:
        law = controller.numbers.law
        return replace(controller, numbers=controller.numbers._replace(law=law._replace(o_zeta=law.o_zeta + change)))

    def drift(change: float) -> float:
        lagged = with_lag(change)
        return float(step_paths(vehicle, lagged, trim, command=command, distance=distance, duration=duration).drift[0])

    low, high = (-0.25 * _FURTHEST_LAG, 0.25 * _FURTHEST_LAG)
    ends = drift(low), drift(high)
    if ends[0] * ends[1] > 0.0:
        low, high = -_FURTHEST_LAG, _FURTHEST_LAG
        ends = drift(low), drift(high)
    if not ends[0] * ends[1] <= 0.0:
        raise ControllerError(
            f"drifts {ends[0]:+.2f} m with 40 deg less than the rotor's lag and {ends[1]:+.2f} m with 40 deg more: no "
            f"constant lag makes a step of {command:.3g} end straight ahead.",
            where=vehicle.name,
            channel="lag",
            hint="Give one: --lag battery (the paper's), or degrees.",
        )
    return with_lag(float(brentq(drift, low, high, xtol=_LAG_TOLERANCE)))


def corrected_by_step(
    vehicle: Vehicle,
    controller: Autopilot,
    trim: Trim,
    *,
    command: float,
    drift: float,
    distance: float = 6.0,
    duration: float = 10.0,
) -> Autopilot:
    """The controller whose law takes out the drift that the aircraft was seen to have with it.

    The law's tilt across the motion per speed is changed by the drift over its sensitivity, which is that of the model;
    by symmetry of the disc the tilt per speed to the right changes alike.

    Args:
        vehicle: the model that the law was made from.
        controller: as it was flown, in mode "manual", decoupled.
        trim: the hover.
        command: the step of the pitch command that was flown.
        drift: offset to the right of the first heading that was seen after `distance` [m].
        distance: [m].
        duration: after which the model's flight is given up [s].

    Raises:
        ControllerError: where the model does not cover the distance.
    """

    def with_tilt(change: float) -> Autopilot:
        law = controller.numbers.law
        across = law._replace(
            across_u_linear=law.across_u_linear + change, across_v_linear=law.across_v_linear + change
        )
        return replace(controller, numbers=controller.numbers._replace(law=across))

    ends = [
        float(step_paths(vehicle, law_of, trim, command=command, distance=distance, duration=duration).drift[0])
        for law_of in (controller, with_tilt(_NUDGE))
    ]
    slope = (ends[1] - ends[0]) / _NUDGE
    return with_tilt(-drift / slope)
