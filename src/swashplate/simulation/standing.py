"""A vehicle that can stand on level ground with its rotors at rest, spool up, lift off and land.

Some have skids and an engine among their options (`Traits.standing`). Any other rigid body gets four skid ends added
around its own equations: forces add, so its rates only gain what the ground's push gives a body at rest. Either kind's
ends stick to the ground with eight states more (`ground_contact.Grip`): what is parked stays where it is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.errors import SwashError
from swashplate.models.catalogue import from_card
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend, Named
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Vector
from swashplate.physics.ground_contact import Grip, Skids, skid_loads
from swashplate.physics.rigid_body import Inertia, RigidBody, rigid_body_rates

_SINK = 0.002
"""m: how far skids that are not on a card sink under the weight."""
_DAMPING = 0.4
"""Of the critical damping of the weight on its skids."""
_FRICTION = 0.5
_CONTACT = ("ground", "grip")
"""Options of `Traits.standing` that say nothing in the air."""


class Standing(NamedTuple):
    """A body on skids that were added: the rigid body, the vehicle's own state with None for it, and the grip."""

    body: RigidBody
    rest: Any
    grip: Grip


def standing(vehicle: Vehicle) -> Vehicle:
    """The vehicle with ground under it at z = 0, and an engine that can be shut off where it has one.

    Args:
        vehicle: of any equations with a rigid body; its card's other options stay.

    Raises:
        SwashError: where its states hold no rigid body, or its equations can have no ground.
    """
    if vehicle.traits.standing:
        return from_card(replace(vehicle.card, options={**vehicle.card.options, **vehicle.traits.standing}))
    if not vehicle.traits.ground:
        raise no_ground(vehicle.card.where)
    if vehicle.state_names[: len(RigidBody._fields)] != RigidBody._fields:
        raise SwashError("has no position and attitude to stand with.", where=vehicle.name)
    skids = skids_of(vehicle)
    return replace(
        vehicle,
        state=Standing(vehicle.state.body, vehicle.state._replace(body=None), Grip(*(0.0,) * len(Grip._fields))),
        state_names=(*vehicle.state_names, *Grip._fields),
        state_units=(*vehicle.state_units, *("m",) * len(Grip._fields)),
        derivatives=partial(_derivatives, vehicle.derivatives, skids),
        specific_force=partial(_specific_force, vehicle.specific_force, skids),
    )


def airborne(vehicle: Vehicle) -> Vehicle:
    """The same equations as `standing`'s where no ground is: for the hover and the linear model of what is flown there.

    Raises:
        SwashError: where its equations can have no ground.
    """
    if not vehicle.traits.standing:
        if not vehicle.traits.ground:
            raise no_ground(vehicle.card.where)
        return vehicle
    flying = {name: value for name, value in vehicle.traits.standing.items() if name not in _CONTACT}
    return from_card(replace(vehicle.card, options={**vehicle.card.options, **flying}))


def no_ground(where: str) -> SwashError:
    """That a linear or stitched model cannot stand, as an error to be raised."""
    return SwashError(
        "is a linear model of flight, or stitched from such, without ground, rotors or a battery, so it cannot "
        "start from the ground as an autopilot expects.",
        where=where,
        hint="Fly it with `swash live`, or give the autopilot a vehicle, e.g. raptor50.",
    )


def skids_of(vehicle: Vehicle) -> Skids:
    """The skids of a card, or some in proportion to the rotor (assumed: half as long as the radius)."""
    numbers = vehicle.card.values()
    if "skid_depth" in numbers:
        names = ("length", "width", "depth", "stiffness", "damping", "friction")
        return Skids(*(numbers[f"skid_{name}"] for name in names))
    radius, mass = numbers.get("rotor_radius", 0.2), numbers["mass"]
    stiffness = mass * 9.81 / (4.0 * _SINK)
    damping = _DAMPING * 2.0 * float(np.sqrt(4.0 * stiffness * mass)) / 4.0
    return Skids(0.5 * radius, 0.35 * radius, 0.5 * radius, stiffness, damping, _FRICTION)


def at_rest(vehicle: Vehicle, environment: Environment) -> NDArray[np.float64]:
    """The state row of a vehicle from `standing` at rest on the ground: level, rotors stopped, shape (n_states,)."""
    row = np.zeros(len(vehicle.state_names))
    skids = skids_of(vehicle)
    sink = vehicle.card.values()["mass"] * environment_of(vehicle, environment).gravity / (4.0 * skids.stiffness)
    row[vehicle.index("z")] = sink - skids.depth
    return row


def _derivatives(
    free: Callable[..., Any], skids: Skids, state: Standing, inputs: object, par: Named, env: Environment, xp: Backend
) -> Any:
    force, moment, bending = skid_loads(state.body, skids, xp, state.grip)
    inertia = Inertia(par.mass, par.inertia_xx, par.inertia_yy, par.inertia_zz, getattr(par, "inertia_xz", None))
    still = state.body._replace(u=0.0, v=0.0, w=0.0, p=0.0, q=0.0, r=0.0)
    pushed = rigid_body_rates(still, force, moment, inertia, xp)
    rates = free(_own(state), inputs, par, env, xp)
    body = RigidBody(*(rate + gained for rate, gained in zip(rates.body, pushed, strict=True)))
    assert bending is not None  # a grip was given
    return Standing(body, rates._replace(body=None), bending)


def _specific_force(
    free: Callable[..., Any], skids: Skids, state: Standing, inputs: object, par: Named, env: Environment, xp: Backend
) -> Vector:
    force, _, _ = skid_loads(state.body, skids, xp, state.grip)
    felt: Vector = free(_own(state), inputs, par, env, xp)
    return felt + force.scaled(1.0 / par.mass)


def _own(state: Standing) -> Any:
    return state.rest._replace(body=state.body)
