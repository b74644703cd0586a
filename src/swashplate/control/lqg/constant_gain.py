"""A controller whose observer has constant gains: what an autopilot's processor can afford where the trim is one.

The settled gains have forgotten that sensors' offsets are unknown at the start: they would take 20 s to learn them, and
attitude would be wrong meanwhile by twice what is promised. Gains are therefore those for offsets that wander `EAGER`
times faster; what is promised is what these gains give with the offsets' own wander.
"""

from __future__ import annotations

from dataclasses import replace
from math import lcm

import numpy as np

from swashplate.arrays import Array
from swashplate.control.lqg.controller import Lqg
from swashplate.errors import ControllerError
from swashplate.filtering import periodic_gain
from swashplate.simulation.linearize import linearize

EAGER = 10.0
"""Of the CoaX with gyros, accelerometers and late motion capture offsets are learnt in 2 s instead of 21 s, attitude is
known to 0.54 instead of 0.91 mrad over the first 20 s (the filter that finds its gains as it flies: 0.49) and to 0.53
instead of 0.48 mrad in the end. With 3 it is 0.61 and 0.49 mrad, with 30 0.61 and 0.61."""
_LONGEST = 50
"""Samples of the sensors' common period; each has a gain matrix in the controller."""


def with_steady_gain(controller: Lqg) -> Lqg:
    """The same controller with constant observer gains.

    Raises:
        ControllerError: without sensors, for gains over speed (one trim only), for sensors whose rates have a long
            common period, or where the covariance does not settle.
    """
    plan, where = controller.plan, controller.vehicle.card.path or controller.vehicle.name
    if not plan.sensors:
        raise ControllerError("has no observer.", where=where, channel="gain", hint="Use --method lqg.")
    if np.size(controller.feedback.speeds) != 1:
        raise ControllerError(
            "is one matrix, good about one trim, and the gains are scheduled over several speeds.",
            where=where,
            channel="gain",
            hint="Give one speed, or let the observer find its gains as it flies.",
        )
    period = lcm(*(at.every for at in plan.sampling))
    if period > _LONGEST:
        rates = ", ".join(map(str, plan.sensors))
        raise ControllerError(
            f"repeats only after {period} samples for {rates} at {plan.rate:g} Hz, expected at most {_LONGEST}.",
            where=where,
            channel="gain",
            hint="Choose sensor rates that divide each other.",
        )
    process = np.array(controller.numbers.process)
    process[plan.n + 6 : plan.n + 6 + len(plan.biases)] *= EAGER**2
    eager = controller.numbers._replace(process=process)
    gains, _ = periodic_gain.steady_gains(plan, eager, linearize(controller.vehicle, controller.start), period)
    numbers = controller.numbers._replace(steady=gains)
    return replace(controller, plan=replace(plan, period=period), numbers=numbers)


def steady_sigmas(controller: Lqg) -> Array:
    """Standard deviations of the predicted estimates' errors under a controller's constant gains, shape (N,)."""
    model = linearize(controller.vehicle, controller.start)
    return periodic_gain.steady_sigmas(controller.plan, controller.numbers, model)
