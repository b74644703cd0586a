"""A ducted fan as a model of your own: a rigid body, a fan that takes time, and three vanes in its slipstream."""

from typing import Any, NamedTuple

from swashplate.models.card import Card
from swashplate.models.traits import Axis, Traits
from swashplate.models.vehicle import Vehicle
from swashplate.physics.frames import Vector, local_to_body
from swashplate.physics.rigid_body import BODY_UNITS, Inertia, RigidBody, gravity, rigid_body_rates

UNITS = {"mass": "kg", "inertia_xx": "kg m^2", "inertia_yy": "kg m^2", "inertia_zz": "kg m^2", "rotor_radius": "m"}
UNITS |= {"k_thrust": "N s^2/rad^2", "k_torque": "N m s^2/rad^2", "fan_speed": "rad/s", "fan_time": "s"}
UNITS |= {"k_vane": "1/rad", "vane_arm": "m", "drag": "N s/m", "damping": "N m s"}
Numbers = NamedTuple("Numbers", [(name, Any) for name in UNITS])


class State(NamedTuple):
    body: RigidBody
    omega: Any  # fan speed [rad/s]


class Inputs(NamedTuple):
    fan: Any  # 0 to 1
    roll: Any  # vanes [rad], as the two below
    pitch: Any
    yaw: Any


def acting(state, inputs, par, env, xp):
    """Force and moment without gravity: the vanes deflect the fan's thrust, below and around the centre of gravity."""
    air = state.body.velocity + local_to_body(env.wind, state.body.attitude, xp).scaled(-1.0)
    thrust = par.k_thrust * state.omega * state.omega * env.air_density / 1.225
    side = thrust * par.k_vane
    force = Vector(side * inputs.pitch, -side * inputs.roll, -thrust) + air.scaled(-par.drag)
    turning = side * par.rotor_radius * inputs.yaw - par.k_torque * state.omega * state.omega
    moment = Vector(side * par.vane_arm * inputs.roll, side * par.vane_arm * inputs.pitch, turning)
    return force, moment + state.body.rates.scaled(-par.damping)


def derivatives(state, inputs, par, env, xp):
    force, moment = acting(state, inputs, par, env, xp)
    force += gravity(par.mass, env.gravity, state.body.attitude, xp)
    body = rigid_body_rates(state.body, force, moment, Inertia(*par[:4]), xp)
    return State(body, (par.fan_speed * inputs.fan - state.omega) / par.fan_time)


def specific_force(state, inputs, par, env, xp):
    return acting(state, inputs, par, env, xp)[0].scaled(1.0 / par.mass)


def ducted_fan(card: Card) -> Vehicle:
    """The vehicle of a card; the entry point names this function."""
    axes = (Axis("heave", {"fan": 1.0}), *(Axis(name, {name: 1.0}) for name in ("roll", "pitch", "yaw")))
    return Vehicle(
        card=card.checked_against(UNITS), parameters=Numbers, derivatives=derivatives, specific_force=specific_force,
        state=State(RigidBody(*(0.0,) * 12), 500.0), inputs=Inputs, input_names=Inputs._fields,
        state_names=(*RigidBody._fields, "omega"), state_units=(*BODY_UNITS, "rad/s"), traits=Traits(axes=axes),
        input_units=("1", "rad", "rad", "rad"), input_limits=((0.0, 1.0), *((-0.4, 0.4),) * 3),
    )  # fmt: skip
