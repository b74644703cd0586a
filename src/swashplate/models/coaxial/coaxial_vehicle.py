"""The coaxial helicopter with collective pitch as a vehicle: its equations with a card's numbers, and its traits."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

from swashplate.arrays import Array
from swashplate.models.card import Card
from swashplate.models.coaxial.coaxial import (
    CoaxialState,
    TwinRotorLoads,
    commands_of,
    derivatives,
    loads,
    specific_force,
    stops,
)
from swashplate.models.coaxial.coaxial_options import coaxial_options
from swashplate.models.coaxial.coaxial_parameters import UNITS, CoaxialParameters, checked_numbers
from swashplate.models.conventional.helicopter_limits import rotor_doubts
from swashplate.models.nesting import rebuild
from swashplate.models.traits import Axis, PhysicalEffect, Pose, RecordingFit, Traits
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.physics.engine import EngineLag, RotorSpeed
from swashplate.physics.environment import Environment
from swashplate.physics.flapping import Flapping
from swashplate.physics.frames import local_to_body
from swashplate.physics.ground_contact import Grip
from swashplate.physics.inflow import Inflow
from swashplate.physics.rigid_body import BODY_UNITS, RigidBody

_XP = FloatBackend()
_SIDES = ("upper", "lower")
_START_INFLOW = 0.05
_START_PITCH = 0.15


def acting_at(vehicle: Vehicle, x: Sequence[float], u: Sequence[float], around: Environment) -> TwinRotorLoads:
    """What acts on it at a state row and an input row."""
    state: CoaxialState = rebuild(vehicle.state, [float(value) for value in x])
    inputs: Any = vehicle.inputs(*(float(value) for value in u))
    return loads(state, inputs, vehicle.values(), around, _XP, options=vehicle.options)


def picture(vehicle: Vehicle) -> dict[str, Any]:
    """Two rotors on one mast, and the card's skids."""
    card, sense = vehicle.card.values(), int(vehicle.options.upper.sense)
    rotors = [
        {
            "name": side,
            "hub": [card["hub_x"], card["hub_y"], -card[f"hub_height_{side}"]],
            "radius": card["rotor_radius"],
            "blades": round(card["rotor_blades"]),
            "sense": turned * sense,
            "tilt": 0.0,
        }
        for side, turned in zip(_SIDES, (-1, 1), strict=True)
    ]
    skids = {name: card[f"skid_{name}"] for name in ("length", "width", "depth")}
    parts = {"rotors": rotors, "bar": None, "tail": None, "skids": skids, "fin": None}
    weight = card["mass"] * card["gravity"]
    return {"size": card["rotor_radius"], "weight": weight, **parts, "ground": True, "rpm": True}


def pose(vehicle: Vehicle) -> Pose:
    """Both discs with their speed and the force of each rotor."""
    par = vehicle.values()

    def discs(x: Sequence[float], u: Sequence[float], around: Environment) -> dict[str, Any]:
        state: CoaxialState = rebuild(vehicle.state, [float(value) for value in x])
        acting = acting_at(vehicle, x, u, around)
        omega = par.rotor_speed if state.rotor is None else state.rotor.omega
        forces = (acting.upper_rotor.force, acting.lower_rotor.force)
        planes = (state.upper, state.lower)
        rotors = [[disc.b1, disc.a1, omega, *force] for disc, force in zip(planes, forces, strict=True)]
        return {"rotors": rotors, "bar": None, "tail": None}

    return discs


def power(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> float:
    """Power [W] that both rotors take from the engine."""
    return float(acting_at(vehicle, list(x), list(u), environment).power)


def doubts(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> dict[str, str]:
    """What of either rotor's equations does not hold at a state, in words by kind and rotor."""
    state: CoaxialState = rebuild(vehicle.state, [float(value) for value in x])
    acting, par = acting_at(vehicle, list(x), list(u), environment), vehicle.values()
    air = state.body.velocity + local_to_body(environment.wind, state.body.attitude, _XP).scaled(-1.0)
    omega = par.rotor_speed if state.rotor is None else state.rotor.omega
    rotors, by_kind = acting.rotors, {}
    for side, part, rotor, given, disc in (
        ("upper", acting.upper_rotor, rotors.upper, rotors.given_upper, state.upper),
        ("lower", acting.lower_rotor, rotors.lower, rotors.given_lower, state.lower),
    ):
        through = float(rotor.induced + given)
        for kind, doubt in rotor_doubts(part.force, air, through, omega, disc, par, environment).items():
            by_kind[f"{kind} {side}"] = f"{side} rotor: {doubt}"
    return by_kind


_AXES = (
    Axis("roll", {"A1": 1.0}),
    Axis("pitch", {"B1": 1.0}),
    Axis("yaw", {"theta0d": 1.0}, ("inertia_zz",)),
    Axis("heave", {"theta0": 1.0}, ("fuselage_area_z",)),
)
_EFFECTS = (
    PhysicalEffect("spring of the hubs", {"hub_stiffness": 0.0}),
    PhysicalEffect("wake distorted by pitch and roll rate", {"wake_distortion": 0.0}),
    PhysicalEffect("drag of the fuselage", {f"fuselage_area_{axis}": 0.0 for axis in "xyz"}),
)
TRAITS = Traits(
    axes=_AXES,
    roles=dict.fromkeys((f"{tilt}_{side}" for side in ("upper", "lower") for tilt in ("a1", "b1")), "flapping"),
    servo_layout="two swashplates",
    standing={"ground": True, "grip": True, "rotor_speed": "throttle"},
    effects=lambda card: _EFFECTS,
    recording=RecordingFit(),
    picture=picture,
    pose=pose,
    doubts=doubts,
    power=power,
)


def _traits_of_delays(states: tuple[str, ...]) -> Traits:
    """With delayed commands, which these states carry."""
    return replace(TRAITS, delayed_by="servo_delay", roles={**TRAITS.roles, **dict.fromkeys(states, "other")})


@lru_cache(maxsize=16)
def _tuple(name: str, fields: tuple[str, ...]) -> Any:
    """A named tuple type; the same one for the same names, so that compiled code is shared."""
    return namedtuple(name, fields)


def _state_names(state: CoaxialState) -> tuple[str, ...]:
    """Names of the flat states: those of both rotors with their side behind them."""
    both = [f"{name}_{side}" for part in (Flapping, Inflow) for side in _SIDES for name in part._fields]
    rest = (state.rotor, state.servos, state.delays, state.engine, state.grip)
    return (*RigidBody._fields, *both, *(name for part in rest if part is not None for name in part._fields))


def coaxial(card: Card) -> Vehicle:
    """The coaxial helicopter with a card's numbers and options (see `CoaxialOptions`).

    Inputs are theta0, B1, A1 and theta0d of both swashplates together, B1d and A1d with `differential_cyclic`, and the
    throttle with `rotor_speed = "throttle"`.

    Raises:
        CardError: for a number that is missing, unknown, in another unit or impossible, or an unknown option.
    """
    options = coaxial_options(card)
    card = checked_numbers(card)
    numbers = card.values()
    parameters: Any = CoaxialParameters._make(numbers[each] for each in UNITS)
    switches = options.upper
    names: tuple[str, ...] = commands_of(options)._fields
    count = len(names)
    servos = _tuple("CoaxialServos", tuple(f"{each}_servo" for each in names))
    delay_states = (*(f"{each}_late" for each in names), *(f"{each}_late_rate" for each in names))
    delays = _tuple("CoaxialDelays", delay_states)
    at = (_START_PITCH, *(0.0,) * (count - 1))
    state = CoaxialState(
        RigidBody(*(0.0,) * 12),
        Flapping(0.0, 0.0),
        Flapping(0.0, 0.0),
        Inflow(_START_INFLOW, 0.0, 0.0),
        Inflow(_START_INFLOW, 0.0, 0.0),
        RotorSpeed(parameters.rotor_speed, 0.3) if switches.rotor_speed != "fixed" else None,
        servos(*at) if switches.servos else None,
        delays(*at, *(0.0,) * count) if switches.delay else None,
        EngineLag(0.3) if switches.engine_lag else None,
        Grip(*(0.0,) * 8) if switches.grip else None,
    )
    units = (
        *BODY_UNITS,
        *("rad",) * 4,
        *("1",) * 6,
        *(("rad/s", "1") if state.rotor is not None else ()),
        *(("rad",) * count if state.servos is not None else ()),
        *(("rad",) * count + ("rad/s",) * count if state.delays is not None else ()),
        *(("1",) if state.engine is not None else ()),
        *(("m",) * 8 if state.grip is not None else ()),
    )
    inputs: Any = commands_of(options)
    limits = stops(parameters, count)
    held = tuple((name, 0.0) for name in names[4:])
    if switches.throttle:
        inputs = _tuple("CoaxialEngineInputs", (*names, "throttle"))
        limits.append((0.0, 1.0))
        held = (*held, ("throttle", 1.0))
    return Vehicle(
        card=card,
        state=state,
        inputs=inputs,
        parameters=CoaxialParameters,
        state_names=_state_names(state),
        state_units=units,
        input_names=inputs._fields,
        input_units=(*("rad",) * count, "1")[: len(limits)],
        input_limits=tuple(limits),
        derivatives=partial(derivatives, options=options),
        specific_force=partial(specific_force, options=options),
        trim_held=held,
        traits=TRAITS if state.delays is None else _traits_of_delays(state.delays._fields),
        options=options,
    )
