"""The CoaX as a vehicle: its equations with a card's numbers, its picture, its hover in closed form, its traits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from swashplate.errors import CardError
from swashplate.models.card import Card, Parameter, no_option
from swashplate.models.coax import (
    UNITS,
    CoaxialLoads,
    CoaxInputs,
    CoaxParameters,
    CoaxState,
    Drive,
    derivatives,
    loads,
    specific_force,
)
from swashplate.models.coax_choices import CHOICES, EFFECTS
from swashplate.models.nesting import rebuild
from swashplate.models.traits import Axis, Pose, RecordingFit, Traits
from swashplate.models.vehicle import Vehicle
from swashplate.physics import rotor
from swashplate.physics.backend import Backend, FloatBackend, Named, Scalar
from swashplate.physics.drive_train import steady_speed
from swashplate.physics.environment import LABORATORY_GRAVITY, Environment
from swashplate.physics.frames import Euler
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
    """What acts on a CoaX at a state row and an input row."""
    state: CoaxState = rebuild(vehicle.state, [float(value) for value in x])
    inputs = CoaxInputs(*(float(value) for value in u))
    mixing = vehicle.card.options.get("mixing", "rotation")
    return loads(state, inputs, vehicle.values(), around, _XP, mixing=mixing)


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


def hover(parameters: Named, voltage: Scalar, xp: Backend) -> tuple[dict[str, Scalar], tuple[Scalar, ...]]:
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


def settled(inputs: Named, parameters: Named, voltage: Scalar, attitude: Named, running: Scalar) -> dict[str, Scalar]:
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


_BALANCING = ("k_torque_upper", "k_torque_lower", "k_thrust_upper", "k_thrust_lower")


def balance(start: Vehicle, identified: Vehicle, trims: Mapping[str, float]) -> tuple[str, ...]:
    """What takes the place of the yaw and the fall that the start's numbers leave in the hover that was flown.

    Args:
        start, identified: before and after the fit.
        trims: of the motors, "trim_motor_upper" and "trim_motor_lower", zero where they are not named.

    Returns:
        Nothing where the fit moved neither trims nor factors of torque and thrust.
    """
    before, after = start.values(), identified.values()
    changes = {n: getattr(after, n) / getattr(before, n) - 1.0 for n in _BALANCING if getattr(before, n)}
    upper, lower = (trims.get(f"trim_motor_{side}", 0.0) for side in ("upper", "lower"))
    if not (any(changes.values()) or upper or lower):
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
    factors = ", ".join(f"{name} {100.0 * share:+.1f} %" for name, share in changes.items() if share)
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
    roles={
        **dict.fromkeys(("alpha_lower", "beta_lower"), "flapping"),
        **dict.fromkeys(("eta_bar", "zeta_bar"), "bar"),
    },
    motors=("motor_lower", "motor_upper"),
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
}


def _checked_options(card: Card) -> dict[str, Any]:
    """The options with their defaults.

    Raises:
        CardError: naming the option that is not known or has no such value.
    """
    for name, value in card.options.items():
        if name not in _CHOICES:
            raise no_option(name, _CHOICES, where=card.where)
        if not any(value is choice or (isinstance(value, str) and value == choice) for choice in _CHOICES[name]):
            expected = ", ".join(map(repr, _CHOICES[name])).replace("True", "true").replace("False", "false")
            raise CardError(f"is {value!r}, expected one of {expected}.", where=card.where, channel=name)
    return {"bar": True, "mixing": "rotation", **card.options}


def coax(card: Card) -> Vehicle:
    """The CoaX with a card's numbers and options.

    Options are `bar` (True, False) and `mixing` ("rotation", "as_printed").

    Raises:
        CardError: for an unknown option, or a number that is missing, unknown, in another unit or impossible.
    """
    options = _checked_options(card)
    card = _symmetric_where_silent(card).checked_against(UNITS)
    bar = StabilizerBar(0.0, 0.0) if options["bar"] else None
    bar_names = ("eta_bar", "zeta_bar") if options["bar"] else ()
    return Vehicle(
        card=card,
        state=CoaxState(RigidBody(*(0.0,) * 12), TipPathPlane(0.0, 0.0), bar, Drive(0.0, 0.0)),
        inputs=CoaxInputs,
        parameters=CoaxParameters,
        state_names=(
            *RigidBody._fields,
            *("alpha_lower", "beta_lower", *bar_names, "omega_lower", "omega_upper"),
        ),
        state_units=(
            *BODY_UNITS,
            *("rad",) * (2 + len(bar_names)),
            *("rad/s", "rad/s"),
        ),
        input_names=CoaxInputs._fields,
        input_units=("1",) * 4,
        input_limits=((0.0, 1.0), (0.0, 1.0), (-1.0, 1.0), (-1.0, 1.0)),
        derivatives=partial(derivatives, mixing=options["mixing"]),
        specific_force=partial(specific_force, mixing=options["mixing"]),
        traits=TRAITS,
    )
