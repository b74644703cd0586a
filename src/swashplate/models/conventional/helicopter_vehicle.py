"""The single-rotor helicopter as a vehicle: its equations with a card's numbers, its picture, traits and choices."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from swashplate.models.card import Card
from swashplate.models.conventional.helicopter import (
    Controls,
    Delays,
    EngineControls,
    HelicopterState,
    ServoPositions,
    YawGyro,
    derivatives,
    loads,
    specific_force,
)
from swashplate.models.conventional.helicopter_checks import check_numbers, with_added
from swashplate.models.conventional.helicopter_limits import doubts_by_kind, shaft_power
from swashplate.models.conventional.helicopter_options import helicopter_options
from swashplate.models.conventional.helicopter_parameters import UNITS, HelicopterParameters
from swashplate.models.nesting import rebuild
from swashplate.models.traits import Axis, Choice, Free, PhysicalEffect, Pose, RecordingFit, Traits
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.physics.bell_hiller import Bar
from swashplate.physics.engine import EngineLag, RotorSpeed
from swashplate.physics.environment import LABORATORY_GRAVITY, Environment
from swashplate.physics.flapping import Flapping
from swashplate.physics.ground_contact import Grip
from swashplate.physics.inflow import Inflow
from swashplate.physics.rigid_body import BODY_UNITS, RigidBody

_ROTOR = ("hub_stiffness", "blade_inertia", "wake_distortion")
_WHOLE = (
    *_ROTOR,
    "rotor_lift_slope",
    "rotor_drag",
    "tail_lift_slope",
    "fuselage_area_x",
    "fuselage_area_y",
    "fuselage_area_z",
)
_WITH_OPTION = {"bar": ("bar_gain", "bar_inertia"), "gyro": ("gyro_gain",), "servos": ("servo_time",)}


def helicopter_choices(card: Card) -> Mapping[str, Choice]:
    """The ready choices by name; priors are from the card.

    The prior of a parameter is the card's value with the card's sigma, or half the value where the card has none: a
    card of estimates with tolerances becomes one of measured values, as far as the flight can tell.
    """
    switched = [name for option, names in _WITH_OPTION.items() if card.options.get(option, False) for name in names]
    bar = [name for name in switched if name.startswith("bar_")]
    return {
        "rotor": Choice(
            "rotor",
            "what turns the rotor's answer to a stick: hub spring, blade inertia, wake distortion, stabilizer bar",
            tuple(Free(name, _tolerance(card, name)) for name in (*_ROTOR, *bar)),
        ),
        "full": Choice(
            "full",
            "the rotor, lift slopes and drag of rotor, tail rotor and fuselage, and what the card's options add",
            tuple(_with_tolerance(card, name) for name in (*_WHOLE, *switched)),
        ),
    }


def helicopter_effects(card: Card) -> Sequence[PhysicalEffect]:
    """What numbers can leave out: the hub's spring, the distorted wake, drag, and what options add."""
    drag = {f"fuselage_area_{axis}": 0.0 for axis in "xyz"}
    bar = (PhysicalEffect("stabilizer bar", {"bar_gain": 0.0}),) if card.options.get("bar", False) else ()
    gyro = (PhysicalEffect("yaw gyro", {"gyro_gain": 0.0}),) if card.options.get("gyro", False) else ()
    return (
        PhysicalEffect("spring of the hub", {"hub_stiffness": 0.0}),
        PhysicalEffect("wake distorted by pitch and roll rate", {"wake_distortion": 0.0}),
        PhysicalEffect("drag of the fuselage", drag),
        PhysicalEffect("profile drag that grows with thrust", {"rotor_drag_thrust": 0.0}),
        *bar,
        *gyro,
    )


def _tolerance(card: Card, name: str) -> float:
    entry = card.parameters[name]
    return entry.sigma or 0.5 * abs(entry.value) or 1.0


def _with_tolerance(card: Card, name: str) -> Free:
    entry, sigma = card.parameters[name], _tolerance(card, name)
    source = "the card with its sigma" if entry.sigma else "the card, half its value"
    return Free(name, sigma, entry.value, sigma, source=source)


_XP = FloatBackend()
_RECORDED = ("--free", "rotor", "--method", "output-error", "--rate", "50")
"""What turns the rotor's answer to a stick, at half the rate: a minute of one processor (measured: 45 s for 20 s of
flight; filter error at full rate took 160 s and had not settled)."""


def picture(vehicle: Vehicle) -> dict[str, Any]:
    """Main rotor, bar where there is one, tail rotor, fin and skids as the card has them."""
    card = vehicle.card.values()
    radius, weight = card["rotor_radius"], card["mass"] * LABORATORY_GRAVITY
    hub = [card["hub_x"], card["hub_y"], -card["hub_height"]]
    sense = 1 if vehicle.card.options.get("rotation", "ccw") == "cw" else -1
    main = {"name": "main", "hub": hub, "radius": radius, "blades": round(card["rotor_blades"]), "sense": sense}
    main["tilt"] = card["shaft_tilt"]
    bar = None
    if vehicle.card.options.get("bar", False):
        bar = {"hub": [hub[0], hub[1], hub[2] - 0.04 * radius], "radius": card["bar_outer"]}
    tail = {
        "hub": [-card["tail_arm"], 0.0, -card["tail_height"]],
        "radius": card["tail_radius"],
        "blades": round(card["tail_blades"]),
    }
    skids = {"length": card["skid_length"], "width": card["skid_width"], "depth": card["skid_depth"]}
    if min(skids.values()) <= 0.0:
        skids = {"length": 0.3 * radius, "width": 0.2 * radius, "depth": 0.3 * radius}
    fin = {"x": -card["fin_arm"], "z": -card["fin_height"], "side": math.sqrt(max(card["fin_area"], 0.0))}
    parts = {"rotors": [main], "bar": bar, "tail": tail, "skids": skids, "fin": fin}
    return {"size": radius, "weight": weight, **parts, "ground": True, "rpm": True}


def pose(vehicle: Vehicle) -> Pose:
    """The disc with the rotor's force, the bar's tilt, and the tail rotor's thrust."""
    parameters = vehicle.values()

    def single(x: Sequence[float], u: Sequence[float], around: Environment) -> dict[str, Any]:
        state: HelicopterState = rebuild(vehicle.state, [float(value) for value in x])
        inputs = vehicle.inputs(*(float(value) for value in u))
        acting = loads(state, inputs, parameters, around, _XP, options=vehicle.options)
        omega = parameters.rotor_speed if state.rotor is None else state.rotor.omega
        main = [state.disc.b1, state.disc.a1, omega, *acting.main_rotor.force]
        bar = None if state.bar is None else [state.bar.d, state.bar.c]
        return {"rotors": [main], "bar": bar, "tail": [parameters.tail_gear * omega, acting.tail_rotor.force.y]}

    return single


_AXES = (
    Axis("roll", {"A1": 1.0}),
    Axis("pitch", {"B1": 1.0}),
    Axis("yaw", {"theta0T": 1.0}, ("tail_lift_slope", "gyro_gain", "gyro_time")),
    Axis("heave", {"theta0": 1.0}, ("fuselage_area_z",)),
)
TRAITS = Traits(
    axes=_AXES,
    roles={
        **dict.fromkeys(Flapping._fields, "flapping"),
        **dict.fromkeys(Bar._fields, "bar"),
        **dict.fromkeys((*YawGyro._fields, *Delays._fields), "other"),
    },
    rotorcraft=True,
    servo_layout="swashplate",
    standing={"ground": True, "grip": True, "rotor_speed": "throttle"},
    choices=helicopter_choices,
    effects=helicopter_effects,
    recording=RecordingFit(_RECORDED, longest=20.0),
    switches=("bar",),
    picture=picture,
    pose=pose,
    doubts=doubts_by_kind,
    power=shaft_power,
)

LATE = replace(TRAITS, delayed_by="servo_delay")


def conventional(card: Card) -> Vehicle:
    """The single-rotor helicopter with a card's numbers and options (see `helicopter_options`).

    Raises:
        CardError: for a number that is missing, unknown, in another unit or impossible, or an unknown option.
    """
    options = helicopter_options(card)
    card = with_added(card, options).checked_against(UNITS)
    check_numbers(card)
    speed = card.values()["rotor_speed"]
    nothing = HelicopterState(
        RigidBody(*(0.0,) * 12),
        Flapping(0.0, 0.0),
        Bar(0.0, 0.0) if options.bar else None,
        Inflow(0.03, 0.0, 0.0) if options.inflow == "pitt-peters" else None,
        RotorSpeed(speed, 0.3) if options.rotor_speed != "fixed" else None,
        YawGyro(0.0) if options.gyro else None,
        ServoPositions(0.1, 0.0, 0.0, 0.1) if options.servos else None,
        Delays(0.1, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0) if options.delay else None,
        EngineLag(0.3) if options.engine_lag else None,
        Grip(*(0.0,) * 8) if options.grip else None,
    )
    names, units = list(RigidBody._fields), list(BODY_UNITS)
    for part, inner in (
        (nothing.disc, ("rad", "rad")),
        (nothing.bar, ("rad", "rad")),
        (nothing.inflow, ("1", "1", "1")),
        (nothing.rotor, ("rad/s", "1")),
        (nothing.gyro, ("rad/s",)),
        (nothing.servos, ("rad",) * 4),
        (nothing.delays, ("rad",) * 4 + ("rad/s",) * 4),
        (nothing.engine, ("1",)),
        (nothing.grip, ("m",) * 8),
    ):
        if part is not None:
            names += part._fields
            units += inner
    numbers = card.values()
    limits = [
        (numbers["collective_low"], numbers["collective_high"]),
        (-numbers["cyclic_limit"], numbers["cyclic_limit"]),
        (-numbers["cyclic_limit"], numbers["cyclic_limit"]),
        (numbers["tail_low"], numbers["tail_high"]),
    ]
    inputs: Any = Controls
    if options.throttle:
        inputs = EngineControls
        limits.append((0.0, 1.0))
    return Vehicle(
        card=card,
        state=nothing,
        inputs=inputs,
        parameters=HelicopterParameters,
        state_names=tuple(names),
        state_units=tuple(units),
        input_names=inputs._fields,
        input_units=("rad", "rad", "rad", "rad", "1")[: len(limits)],
        input_limits=tuple(limits),
        derivatives=partial(derivatives, options=options),
        specific_force=partial(specific_force, options=options),
        trim_held=(("throttle", 1.0),) if options.throttle else (),
        traits=LATE if options.delay else TRAITS,
        options=options,
    )
