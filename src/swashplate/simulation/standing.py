"""A vehicle that can stand on level ground with its rotors at rest, spool up, lift off and land.

Conventional helicopters have skids and an engine among their options. Any other rigid body gets four skid ends added
around its own equations: forces add, so its rates only gain what the ground's push gives a body at rest. Without states
for them, these do not stick: what the wind pushes creeps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.errors import SwashError
from swashplate.physics.backend import Backend
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Vector
from swashplate.physics.ground_contact import Skids, skid_loads
from swashplate.physics.rigid_body import Inertia, RigidBody, rigid_body_rates
from swashplate.vehicles.catalogue import from_card
from swashplate.vehicles.linear import NAME as LINEAR
from swashplate.vehicles.vehicle import Vehicle

_SINK = 0.002
"""m: how far skids that are not on a card sink under the weight."""
_DAMPING = 0.4
"""Of the critical damping of the weight on its skids."""
_FRICTION = 0.5


def standing(vehicle: Vehicle) -> Vehicle:
    """The vehicle with ground under it at z = 0, and an engine that can be shut off where it has one.

    Args:
        vehicle: of any equations with a rigid body; a conventional helicopter keeps its card's other options.

    Raises:
        SwashError: where its states hold no rigid body, or it is a linear model.
    """
    if vehicle.name == "conventional":
        options = {**vehicle.card.options, "ground": True, "grip": True, "rotor_speed": "throttle"}
        return from_card(replace(vehicle.card, options=options))
    if vehicle.name == LINEAR:
        raise no_ground(vehicle.card.where)
    if vehicle.state_names[: len(RigidBody._fields)] != RigidBody._fields:
        raise SwashError("has no position and attitude to stand with.", where=vehicle.name)
    whole: Any = vehicle.derivatives
    felt: Any = vehicle.specific_force
    skids = skids_of(vehicle)
    return replace(
        vehicle,
        derivatives=partial(_derivatives, whole.func, skids, **whole.keywords),
        specific_force=partial(_specific_force, felt.func, skids, **felt.keywords),
    )


def no_ground(where: str) -> SwashError:
    """That a linear model cannot stand, as an error to be raised."""
    return SwashError(
        "is a linear model: deviations from one trim in flight, without ground, rotors or a battery, so it cannot "
        "start from the ground as an autopilot expects.",
        where=where,
        hint="Fly it with `swash live`, or give the autopilot a vehicle, e.g. raptor50. ArduPilot's own state-space "
        "model is written by `swash export --format ardupilot-statespace`.",
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
    sink = vehicle.card.values()["mass"] * environment.gravity / (4.0 * skids.stiffness)
    row[vehicle.index("z")] = sink - skids.depth
    return row


def _derivatives(
    free: Callable[..., Any], skids: Skids, state: Any, inputs: Any, par: Any, env: Environment, xp: Backend, **how: Any
) -> Any:
    force, moment, _ = skid_loads(state.body, skids, xp)
    inertia = Inertia(par.mass, par.inertia_xx, par.inertia_yy, par.inertia_zz, getattr(par, "inertia_xz", None))
    still = state.body._replace(u=0.0, v=0.0, w=0.0, p=0.0, q=0.0, r=0.0)
    pushed = rigid_body_rates(still, force, moment, inertia, xp)
    rates = free(state, inputs, par, env, xp, **how)
    body = RigidBody(*(own + gained for own, gained in zip(rates.body, pushed, strict=True)))
    return rates._replace(body=body)


def _specific_force(
    free: Callable[..., Any], skids: Skids, state: Any, inputs: Any, par: Any, env: Environment, xp: Backend, **how: Any
) -> Vector:
    force, _, _ = skid_loads(state.body, skids, xp)
    felt: Vector = free(state, inputs, par, env, xp, **how)
    return felt + force.scaled(1.0 / par.mass)
