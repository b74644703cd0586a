"""The CoaX as a vehicle: its equations with a card's numbers, its picture, its hover in closed form, its traits."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from swashplate.arrays import Array
from swashplate.errors import CardError
from swashplate.models.card import Card, Parameter, no_option
from swashplate.models.coax import (
    UNITS,
    CoaxBladeParameters,
    CoaxialLoads,
    CoaxInflowParameters,
    CoaxInputs,
    CoaxParameters,
    CoaxState,
    Drive,
    derivatives,
    loads,
    specific_force,
)
from swashplate.models.coax_choices import (
    BLADE_EFFECTS,
    CHOICES,
    EFFECTS,
    INFLOW_CHOICES,
    INFLOW_EFFECTS,
    blade_choices,
)
from swashplate.models.coax_discs import UNITS as FLAPPING_UNITS
from swashplate.models.coax_rotors import FLAPPINGS, InflowOptions, balanced_hover, checked_blades
from swashplate.models.coax_rotors import UNITS as INFLOW_UNITS
from swashplate.models.nesting import rebuild
from swashplate.models.traits import Axis, Pose, RecordingFit, Traits
from swashplate.models.vehicle import Vehicle
from swashplate.physics import rotor
from swashplate.physics.backend import Backend, FloatBackend, Scalar
from swashplate.physics.coaxial_wake import FORMS as INTERFERENCES
from swashplate.physics.drive_train import steady_speed
from swashplate.physics.environment import LABORATORY_GRAVITY, Environment
from swashplate.physics.frames import Euler, local_to_body
from swashplate.physics.ground_effect import FORMS as GROUND_EFFECTS
from swashplate.physics.rigid_body import BODY_UNITS, RigidBody
from swashplate.physics.rotor import TipPathPlane
from swashplate.physics.stabilizer_bar import StabilizerBar

_XP = FloatBackend()


def picture(vehicle: Vehicle) -> dict[str, Any]:
    """Two rotors, a bar where there is one, and skids of the rotor's size."""
    card = vehicle.card.values()
    radius = card["rotor_radius"]
    hubs = {"upper": (-1, card["hub_height_upper"]), "lower": (1, card["hub_height_lower"])}
    rotors = [
        {"name": name, "hub": [0.0, 0.0, -height], "radius": radius, "blades": 2, "sense": sense, "tilt": 0.0}
        for name, (sense, height) in hubs.items()
    ]
    height = card["hub_height_upper"] + 0.25 * radius
    bar = {"hub": [0.0, 0.0, -height], "radius": 0.55 * radius} if vehicle.card.options.get("bar", True) else None
    skids = {"length": 0.45 * radius, "width": 0.35 * radius, "depth": 0.55 * radius}
    parts = {"rotors": rotors, "bar": bar, "tail": None, "skids": skids, "fin": None}
    return {"size": radius, "weight": card["mass"] * LABORATORY_GRAVITY, **parts, "ground": True, "rpm": True}


def acting_at(vehicle: Vehicle, x: Sequence[float], u: Sequence[float], around: Environment) -> CoaxialLoads:
    """What acts on a CoaX, paper's rotors or others, at a state row and an input row."""
    state: CoaxState = rebuild(vehicle.state, [float(value) for value in x])
    inputs = CoaxInputs(*(float(value) for value in u))
    mixing = vehicle.card.options.get("mixing", "rotation")
    return loads(state, inputs, vehicle.values(), around, _XP, mixing=mixing, rotors=vehicle.options)


def pose(vehicle: Vehicle) -> Pose:
    """Both discs with their thrusts, and the bar's tilt against the fuselage."""

    def coaxial(x: Sequence[float], u: Sequence[float], around: Environment) -> dict[str, Any]:
        state: CoaxState = rebuild(vehicle.state, [float(value) for value in x])
        body = state.body.attitude
        bar = None if state.bar is None else [state.bar.eta - body.phi, state.bar.zeta - body.theta]
        acting = acting_at(vehicle, x, u, around)
        rotors = []
        for plane, lift, omega in zip(
            acting.planes, acting.lift, (state.drive.omega_upper, state.drive.omega_lower), strict=True
        ):
            rotors.append([plane.alpha, plane.beta, omega, *rotor.thrust_direction(plane, _XP).scaled(lift)])
        return {"rotors": rotors, "bar": bar, "tail": None}

    return coaxial


def hover(parameters: Any, voltage: Scalar, xp: Backend) -> tuple[dict[str, Scalar], tuple[Scalar, ...]]:
    """Hover in closed form: both torques balance and both thrusts carry the weight.

    Returns:
        The states that are not zero, by name, and the inputs.
    """
    p = parameters
    ratio = p.k_torque_lower / p.k_torque_upper
    omega_lower = xp.sqrt(p.mass * LABORATORY_GRAVITY / (p.k_thrust_lower + p.k_thrust_upper * ratio))
    omega_upper = omega_lower * xp.sqrt(ratio)
    sag = p.k_drive_voltage * (voltage - p.voltage_nominal)
    motors = (
        (omega_lower - p.o_drive_lower - sag) / p.k_drive_lower,
        (omega_upper - p.o_drive_upper - sag) / p.k_drive_upper,
    )
    return {"omega_lower": omega_lower, "omega_upper": omega_upper}, (*motors, 0.0, 0.0)


def settled(inputs: Any, parameters: Any, voltage: Scalar, attitude: Any, running: Scalar) -> dict[str, Scalar]:
    """Inner states in a slow flight: steady rotor speeds, the bar aligned with the fuselage."""
    speeds = {
        f"omega_{side}": steady_speed(
            getattr(inputs, f"motor_{side}"),
            voltage,
            k=getattr(parameters, f"k_drive_{side}"),
            o=getattr(parameters, f"o_drive_{side}"),
            k_voltage=parameters.k_drive_voltage,
            nominal=parameters.voltage_nominal,
        )
        for side in ("lower", "upper")
    }
    return {**speeds, "eta_bar": attitude.phi, "zeta_bar": attitude.theta}


def rotor_factors(vehicle: Vehicle) -> dict[str, float]:
    """`k_thrust_*` and `k_torque_*` of a vehicle in hover: the card's, or what rotors with inflow have there.

    The second are thrust and torque over Omega^2 at the rotor speeds that balance torque and weight, at the card's air
    density; in hover they hold for any weight, away from it they do not.
    """
    card = vehicle.card.values()
    if not isinstance(vehicle.options, InflowOptions):
        return {name: card[name] for name in _BALANCING}
    hovering = balanced_hover(vehicle.values(), vehicle.options, _XP)
    return {
        "k_thrust_upper": hovering.thrust_upper / hovering.omega_upper**2,
        "k_thrust_lower": hovering.thrust_lower / hovering.omega_lower**2,
        "k_torque_upper": hovering.torque / hovering.omega_upper**2,
        "k_torque_lower": hovering.torque / hovering.omega_lower**2,
    }


_RING = (0.5, 2.0)
"""Sink over the hover's induced velocity between which wakes come back through the discs (Leishman 2006, sec. 2.13)."""
_CARRIES = 0.1
"""Of the weight: rotors that lift less have no wake that could come back, and no number of it is told."""
_STALLED = 0.13
"""C_T / sigma beyond which blades stall."""


def inflow_power(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> float:
    """Power [W] that the two rotors take from their shafts."""
    state: CoaxState = rebuild(vehicle.state, [float(value) for value in x])
    upper, lower = acting_at(vehicle, list(x), list(u), environment).torque
    return float(upper * state.drive.omega_upper + lower * state.drive.omega_lower)


def inflow_doubts(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> dict[str, str]:
    """Where rotors with inflow stop being true: vortex ring and stall, in words by kind."""
    state: CoaxState = rebuild(vehicle.state, [float(value) for value in x])
    acting, par = acting_at(vehicle, list(x), list(u), environment), vehicle.values()
    air = state.body.velocity + local_to_body(environment.wind, state.body.attitude, _XP).scaled(-1.0)
    area = math.pi * par.rotor_radius**2
    hover = math.sqrt(max(sum(acting.lift), 0.0) / (2.0 * environment.air_density * area))
    across, doubts = math.hypot(air.x, air.y), {}
    low, high = (share * hover for share in _RING)
    carries = sum(acting.lift) > _CARRIES * par.mass * environment.gravity
    if carries and low < air.z < high and across < hover:
        doubts["vortex ring"] = (
            f"sinks at {air.z:.1f} m/s with {across:.1f} m/s across: the vortex ring ({low:.1f} to {high:.1f} m/s "
            f"below {hover:.1f} m/s of speed), where momentum theory is only a mean"
        )
    solidity = par.rotor_blades * par.rotor_chord / (math.pi * par.rotor_radius)
    for side, lift in zip(("upper", "lower"), acting.lift, strict=True):
        tip = getattr(state.drive, f"omega_{side}") * par.rotor_radius
        loading = lift / (environment.air_density * area * max(tip, 1e-3) ** 2) / solidity
        if tip > _SLOWEST_JUDGED * par.rotor_radius * getattr(par, f"k_drive_{side}") and loading > _STALLED:
            doubts[f"stall {side}"] = (
                f"C_T / sigma of the {side} rotor is {loading:.3f}, above {_STALLED}: blades would stall, lift here is "
                "linear"
            )
    return doubts


_SLOWEST_JUDGED = 0.25
"""Share of the full speed below which a rotor carries nothing that could be doubted."""
_BALANCING = ("k_torque_upper", "k_torque_lower", "k_thrust_upper", "k_thrust_lower")


def balance(start: Vehicle, identified: Vehicle, trims: Mapping[str, float]) -> tuple[str, ...]:
    """What takes the place of the yaw and the fall that the start's numbers leave in the hover that was flown.

    Args:
        start, found: before and after the fit.
        trims: of the motors, "trim_motor_upper" and "trim_motor_lower", zero where they are not named.

    Returns:
        Nothing where the fit moved neither trims nor factors of torque and thrust.
    """
    before, after = start.values(), identified.values()
    moved = {n: getattr(after, n) / getattr(before, n) - 1.0 for n in _BALANCING if getattr(before, n)}
    upper, lower = (trims.get(f"trim_motor_{side}", 0.0) for side in ("upper", "lower"))
    if not (any(moved.values()) or upper or lower):
        return ()
    motors = CoaxInputs(*hover(after, after.voltage_nominal, _XP)[1])

    def left(trimmed: bool) -> tuple[float, float]:
        """Yaw [rad/s^2] and climb [m/s^2] by the start's factors at the logged commands, with the trims or without."""
        share = 0.0 if trimmed else 1.0
        logged = motors._replace(
            motor_upper=motors.motor_upper - share * upper, motor_lower=motors.motor_lower - share * lower
        )
        speeds = settled(logged, after, after.voltage_nominal, Euler(0.0, 0.0, 0.0), 0.0)
        low, high = speeds["omega_lower"] ** 2, speeds["omega_upper"] ** 2
        yaw = (before.k_torque_upper * high - before.k_torque_lower * low) / after.inertia_zz
        return yaw, (before.k_thrust_upper * high + before.k_thrust_lower * low) / after.mass - LABORATORY_GRAVITY

    (yaw, climb), (yaw_trimmed, climb_trimmed) = left(False), left(True)
    yaw_left, climb_left = round(yaw_trimmed, 1) + 0.0, round(climb_trimmed, 2) + 0.0  # no minus before a zero
    factors = ", ".join(f"{name} {100.0 * share:+.1f} %" for name, share in moved.items() if share)
    return (
        f"balance: the numbers before the fit leave {yaw:+.1f} rad/s^2 of yaw and {climb:+.2f} m/s^2 of climb in the "
        f"hover that was flown, {yaw_left:+.1f} and {climb_left:+.2f} with the motor trims found "
        f"({upper:+.4f} upper, {lower:+.4f} lower); the factors make up for the rest ({factors or 'none moved'}). One "
        "hover cannot tell a trim from a factor: the priors do.",
    )


_AXES = (
    Axis("roll", {"servo_roll": 1.0}),
    Axis("pitch", {"servo_pitch": 1.0}),
    Axis("yaw", {"motor_upper": 1.0, "motor_lower": -1.0}, ("damping_r", "inertia_zz")),
    Axis("heave", {"motor_upper": 0.5, "motor_lower": 0.5}, ("damping_w",)),
)
TRAITS = Traits(
    axes=_AXES,
    coaxial=True,
    observed=True,
    published="coax",
    servos="coax",
    servo_layout="two motors",
    choices=lambda card: CHOICES,
    effects=lambda card: EFFECTS,
    recording=RecordingFit(),
    switches=("bar",),
    picture=picture,
    pose=pose,
    hover=hover,
    settled=settled,
    balance=balance,
)


INFLOW_TRAITS = replace(
    TRAITS,
    choices=lambda card: INFLOW_CHOICES,
    effects=lambda card: INFLOW_EFFECTS,
    hover=None,
    settled=None,
    balance=None,
    doubts=inflow_doubts,
    power=inflow_power,
)
BLADE_TRAITS = replace(INFLOW_TRAITS, choices=blade_choices, effects=lambda card: BLADE_EFFECTS, heavy=True)


def _traits(rotors: InflowOptions | None) -> Traits:
    if rotors is None:
        return TRAITS
    return INFLOW_TRAITS if rotors.flapping == "paper" else BLADE_TRAITS


_SYMMETRY = Parameter(
    value=0.0,
    unit="1",
    source="not in the paper; zero gives its equations",
    status="assumed",
    lower=-0.9,
    upper=0.9,
)
_ASYMMETRIES = {
    "linkage_asymmetry_lower": _SYMMETRY,
    "phase_asymmetry_lower": replace(_SYMMETRY, unit="rad", lower=-0.7, upper=0.7),
    "linkage_asymmetry_upper": _SYMMETRY,
}
"""What cards that were written before these numbers do not have."""


def _symmetric_where_silent(card: Card) -> Card:
    """The card with the symmetric values of what it does not name."""
    missing = {name: entry for name, entry in _ASYMMETRIES.items() if name not in card.parameters}
    return replace(card, parameters={**card.parameters, **missing}) if missing else card


_CHOICES: dict[str, tuple[Any, ...]] = {
    "bar": (True, False),
    "mixing": ("rotation", "as_printed"),
    "rotor": ("paper", "inflow"),
    "interference": INTERFERENCES,
    "ground_effect": GROUND_EFFECTS,
    "flapping": FLAPPINGS,
}


def _checked_options(card: Card) -> dict[str, Any]:
    """The options with their defaults.

    Raises:
        CardError: naming the option that is not known, has no such value, or belongs to other rotors.
    """
    for name, value in card.options.items():
        if name not in _CHOICES:
            raise no_option(name, _CHOICES, where=card.where)
        if not any(value is choice or (isinstance(value, str) and value == choice) for choice in _CHOICES[name]):
            expected = ", ".join(map(repr, _CHOICES[name])).replace("True", "true").replace("False", "false")
            raise CardError(f"is {value!r}, expected one of {expected}.", where=card.where, channel=name)
        if name in InflowOptions._fields and card.options.get("rotor", "paper") == "paper":
            raise CardError("needs rotors with inflow.", where=card.where, channel=name, hint='Add rotor = "inflow".')
    return {"bar": True, "mixing": "rotation", "rotor": "paper", **card.options}


def coax(card: Card) -> Vehicle:
    """The CoaX with a card's numbers and options.

    `bar` (True, False), `mixing` ("rotation", "as_printed"), `rotor`: "paper" for thrust and torque by Omega^2, or
    "inflow" for rotors that know climb, speed and each other's wake (`coax_rotors`, two states more); those have
    `interference`, `ground_effect` and `flapping` (`InflowOptions`).

    Raises:
        CardError: for an unknown option, or a number that is missing, unknown, in another unit or impossible.
    """
    options = _checked_options(card)
    rotors = None
    if options["rotor"] == "inflow":
        rotors = InflowOptions(**{name: options[name] for name in InflowOptions._fields if name in options})
    card = _symmetric_where_silent(card)
    if rotors is not None:
        card = checked_blades(card, rotors)
    also = {**INFLOW_UNITS, **FLAPPING_UNITS}
    needed = {**UNITS, **{name: unit for name, unit in also.items() if name in card.parameters}}
    card = card.checked_against(needed)
    bar = StabilizerBar(0.0, 0.0) if options["bar"] else None
    bar_names = ("eta_bar", "zeta_bar") if options["bar"] else ()
    drive, induced = Drive(0.0, 0.0), None
    parameters: Any = CoaxParameters
    if rotors is not None:
        parameters = CoaxInflowParameters if rotors.flapping == "paper" else CoaxBladeParameters
        numbers = card.values()
        hovering = balanced_hover(parameters(*(numbers[name] for name in parameters._fields)), rotors, _XP)
        drive, induced = Drive(hovering.omega_lower, hovering.omega_upper), hovering.induced
    inflow_names = () if induced is None else induced._fields
    upper = TipPathPlane(0.0, 0.0) if rotors is not None and rotors.flapping == "blades" else None
    upper_names = () if upper is None else ("alpha_upper", "beta_upper")
    return Vehicle(
        card=card,
        state=CoaxState(RigidBody(*(0.0,) * 12), TipPathPlane(0.0, 0.0), bar, drive, induced, upper),
        inputs=CoaxInputs,
        parameters=parameters,
        state_names=(
            *RigidBody._fields,
            *("alpha_lower", "beta_lower", *bar_names, "omega_lower", "omega_upper", *inflow_names, *upper_names),
        ),
        state_units=(
            *BODY_UNITS,
            *("rad",) * (2 + len(bar_names)),
            *("rad/s", "rad/s"),
            *("m/s",) * len(inflow_names),
            *("rad",) * len(upper_names),
        ),
        input_names=CoaxInputs._fields,
        input_units=("1",) * 4,
        input_limits=((0.0, 1.0), (0.0, 1.0), (-1.0, 1.0), (-1.0, 1.0)),
        derivatives=partial(derivatives, mixing=options["mixing"], rotors=rotors),
        specific_force=partial(specific_force, mixing=options["mixing"], rotors=rotors),
        traits=_traits(rotors),
        options=rotors,
    )
