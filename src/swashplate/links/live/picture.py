"""What a helicopter looks like and how its discs stand: numbers for the page, taken from card, state and equations."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from swashplate.links.live import linear_picture
from swashplate.physics import rotor, stabilizer_bar
from swashplate.physics.backend import FloatBackend
from swashplate.physics.environment import LABORATORY_GRAVITY, Environment
from swashplate.physics.rotor import TipPathPlane
from swashplate.vehicles import coax, conventional
from swashplate.vehicles.linear import NAME as LINEAR
from swashplate.vehicles.structure import rebuild
from swashplate.vehicles.vehicle import Vehicle

Pose = Callable[[Sequence[float], Sequence[float], Environment], dict[str, Any]]

_XP = FloatBackend()


def picture(vehicle: Vehicle) -> dict[str, Any]:
    """Shapes in body axes (forward, right, down) [m]: rotors, bar, tail, fin and skids; size [m] and weight [N].

    What a card does not say (the fuselage's outline) is a plain shape of the rotor's size. `ground` is whether there is
    one, `rpm` whether rotor speeds are known.
    """
    if vehicle.name == LINEAR:
        return linear_picture.picture(vehicle)
    card = vehicle.card.values()
    radius, weight = card["rotor_radius"], card["mass"] * LABORATORY_GRAVITY
    known = {"ground": True, "rpm": True}
    if is_coaxial(vehicle):
        hubs = {"upper": (-1, card["hub_height_upper"]), "lower": (1, card["hub_height_lower"])}
        rotors = [
            {"name": name, "hub": [0.0, 0.0, -height], "radius": radius, "blades": 2, "sense": sense, "tilt": 0.0}
            for name, (sense, height) in hubs.items()
        ]
        height = card["hub_height_upper"] + 0.25 * radius
        bar = {"hub": [0.0, 0.0, -height], "radius": 0.55 * radius} if vehicle.card.options.get("bar", True) else None
        skids = {"length": 0.45 * radius, "width": 0.35 * radius, "depth": 0.55 * radius}
        parts = {"rotors": rotors, "bar": bar, "tail": None, "skids": skids, "fin": None}
        return {"size": radius, "weight": weight, **parts, **known}
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
    return {"size": radius, "weight": weight, **parts, **known}


def inputs_of(vehicle: Vehicle) -> list[dict[str, Any]]:
    """Name, unit and limits of each input: commands of a coaxial helicopter are pure numbers, blade pitch is in rad."""
    return [
        {"name": name, "unit": unit, "low": low, "high": high}
        for name, unit, (low, high) in zip(vehicle.input_names, vehicle.input_units, vehicle.input_limits, strict=True)
    ]


def pose_of(vehicle: Vehicle) -> Pose:
    """A function from state row, input row and surroundings to how the moving parts stand.

    It returns per rotor [alpha, beta, omega, fx, fy, fz] (tilt right and aft [rad], speed [rad/s], force [N] in body
    axes), the bar's tilt [alpha, beta] (None without) and the tail rotor's [omega, force to the right].
    """
    if vehicle.name == LINEAR:
        return linear_picture.pose_of(vehicle)
    parameters = vehicle.values()

    def coaxial(x: Sequence[float], u: Sequence[float], around: Environment) -> dict[str, Any]:
        state: coax.CoaxState = rebuild(vehicle.state, [float(value) for value in x])
        par, density = parameters, float(around.air_density) / parameters.air_density
        upper, bar = TipPathPlane(0.0, 0.0), None
        if state.bar is not None:
            body = state.body.attitude
            bar = [state.bar.eta - body.phi, state.bar.zeta - body.theta]
            upper = stabilizer_bar.upper_tip_path_plane(
                state.bar,
                body,
                linkage=par.linkage_upper,
                lag=stabilizer_bar.phase_lag(par.k_zeta_upper, par.o_zeta_upper, state.drive.omega_upper),
                mixing=vehicle.card.options.get("mixing", "rotation"),
                xp=_XP,
            )
        rotors = []
        for plane, k, omega in (
            (upper, par.k_thrust_upper, state.drive.omega_upper),
            (state.lower, par.k_thrust_lower, state.drive.omega_lower),
        ):
            force = rotor.thrust_direction(plane, _XP).scaled(rotor.thrust(k, omega, density))
            rotors.append([plane.alpha, plane.beta, omega, *force])
        return {"rotors": rotors, "bar": bar, "tail": None}

    def single(x: Sequence[float], u: Sequence[float], around: Environment) -> dict[str, Any]:
        state: conventional.HelicopterState = rebuild(vehicle.state, [float(value) for value in x])
        inputs = vehicle.inputs(*(float(value) for value in u))
        options = vehicle.derivatives.keywords["options"]  # type: ignore[attr-defined]
        acting = conventional.loads(state, inputs, parameters, around, _XP, options=options)
        omega = parameters.rotor_speed if state.rotor is None else state.rotor.omega
        main = [state.disc.b1, state.disc.a1, omega, *acting.main_rotor.force]
        bar = None if state.bar is None else [state.bar.d, state.bar.c]
        return {"rotors": [main], "bar": bar, "tail": [parameters.tail_gear * omega, acting.tail_rotor.force.y]}

    return coaxial if is_coaxial(vehicle) else single


def is_coaxial(vehicle: Vehicle) -> bool:
    """Whether it has the coaxial helicopter's own equations (a linear model with its inputs has not)."""
    return vehicle.name == "coax"
