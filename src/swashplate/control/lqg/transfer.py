"""A controller of a linear model taken to the nonlinear vehicle that the model is of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from swashplate.control.lqg.controller import Lqg
from swashplate.engine.equations import parameter_row
from swashplate.errors import ControllerError
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.trim import Trim


def flown_on(controller: Lqg, vehicle: Vehicle, trim: Trim) -> Lqg:
    """The controller with its deviations counted from another vehicle's trim, and that vehicle's limits.

    The observer goes on predicting with the linear model; states of the same name start at the trim's.

    Args:
        controller: designed on a linear model, with sensors (another vehicle has other states to be fed with).
        vehicle: with the same inputs in the same order.
        trim: where it flies.

    Raises:
        ControllerError: where the inputs are not the same, or it has no sensors.
    """
    if not controller.plan.sensors:
        raise ControllerError(
            "is fed with the linear model's states, which another vehicle does not have.",
            where=controller.vehicle.card.title,
            hint="Design it with --method lqg: sensors read the same of both.",
        )
    own = about(controller.vehicle, trim)
    numbers = own.card.values()
    named = {name: numbers.get(f"trim_{name}", 0.0) for name in own.state_names}
    state = np.array([trim.states().get(name, value) for name, value in named.items()])
    limits = np.array(vehicle.input_limits)
    feedback = controller.feedback._replace(
        states=state[None], inputs=np.array(trim.inputs)[None], low=limits[:, 0], high=limits[:, 1]
    )
    return replace(
        controller,
        vehicle=own,
        feedback=feedback,
        numbers=controller.numbers._replace(parameters=parameter_row(own, trim.environment)),
        start=replace(trim, state=state, state_names=own.state_names),
    )


def about(vehicle: Vehicle, trim: Trim) -> Vehicle:
    """A linear vehicle about another vehicle's trim: where it flies, deviations count from there.

    Args:
        vehicle: linear.
        trim: of the vehicle that is to be flown; states of the same name move, others keep theirs.

    Raises:
        ControllerError: where the inputs are not the same.
    """
    if trim.input_names != vehicle.input_names:
        raise ControllerError(
            f"has the inputs {', '.join(vehicle.input_names)}, the aircraft {', '.join(trim.input_names)}.",
            where=vehicle.card.title,
        )
    at_trim = {**trim.states(), **trim.commands()}
    names = {f"trim_{n}": at_trim[n] for n in (*vehicle.card.options["states"], *vehicle.input_names) if n in at_trim}
    return vehicle.with_values(names, source="derived: the trim that it is flown at", status="derived")
