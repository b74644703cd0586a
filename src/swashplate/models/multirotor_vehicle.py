"""A multirotor as a vehicle: any number of rotors from a card, hover in closed form, axes from where the rotors are."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Mapping, Sequence
from functools import lru_cache, partial
from typing import Any

import numpy as np

from swashplate.errors import CardError
from swashplate.models.card import Card
from swashplate.models.multirotor import (
    Battery,
    MotorWarmth,
    MultirotorState,
    derivatives,
    faster_when_cold,
    shaft_power,
    specific_force,
    steady_speed,
)
from swashplate.models.traits import Axis, Choice, Free, PhysicalEffect, Pose, RecordingFit, Traits
from swashplate.models.vehicle import Vehicle
from swashplate.physics import rotor
from swashplate.physics.backend import Backend, Named, Scalar
from swashplate.physics.environment import LABORATORY_GRAVITY, Environment
from swashplate.physics.rigid_body import BODY_UNITS, RigidBody

UNITS: dict[str, str] = {
    "mass": "kg",
    "inertia_xx": "kg m^2",
    "inertia_yy": "kg m^2",
    "inertia_zz": "kg m^2",
    "air_density": "kg/m^3",
    "rotor_radius": "m",
    "k_thrust": "N s^2/rad^2",
    "k_torque": "N m s^2/rad^2",
    "thrust_damping": "N s^2/(m rad)",
    "rotor_drag": "N s^2/(m rad)",
    "flap_back": "N s^2/rad",
    "tau_drive": "s",
    "tau_shared": "s",
    "k_drive": "rad/s",
    "o_drive": "rad/s",
    "k_drive_voltage": "rad/s/V",
    "voltage_nominal": "V",
    "inertia_drive": "kg m^2",
    "drag_x": "kg/m",
    "drag_y": "kg/m",
    "drag_z": "kg/m",
    "damping_r": "N m s",
}
"""Every parameter that does not belong to one rotor or to the battery, and its unit."""

BATTERY_UNITS = {"battery_resistance": "ohm", "tau_battery": "s", "drive_efficiency": "1"}
WARMING_UNITS = {"o_cold": "rad/s", "tau_warm": "s"}
ROTOR_UNITS = {"rotor_{}_x": "m", "rotor_{}_y": "m", "rotor_{}_z": "m", "gain_{}": "1"}
"""Of each rotor: its place from the centre of gravity, and its thrust and torque against `k_thrust` and `k_torque`."""

EFFECTS = (
    PhysicalEffect("thrust that falls with climb", {"thrust_damping": 0.0}),
    PhysicalEffect("drag of the rotors across", {"rotor_drag": 0.0}),
    PhysicalEffect("flap-back", {"flap_back": 0.0}),
    PhysicalEffect("reaction and gyroscopic moment of the motors", {"inertia_drive": 0.0}),
    PhysicalEffect("rotors slower together, on one battery", {"tau_shared": 0.0}),
    PhysicalEffect("drag of the body", {"drag_x": 0.0, "drag_y": 0.0, "drag_z": 0.0}),
    PhysicalEffect("damping of yaw", {"damping_r": 0.0}),
)
"""Parts of the physics that numbers can leave out."""

WARMING = PhysicalEffect("motors that lose speed as they warm", {"o_cold": 0.0})
"""The same, where the card has it."""

PUSHES = {
    **dict.fromkeys(("push_u", "push_v", "push_w"), 0.5),
    **dict.fromkeys(("push_p", "push_q", "push_r"), 5.0),
}
"""Of every flight: accelerations that the equations lack all the time [m/s^2, rad/s^2], and how large they are."""

_BETWEEN = "between flights of one Crazyflie: where the battery lies, warm motors"

_VOLTAGE_SECONDS = 0.15
"""Averaging of a logged voltage: it is under load and follows the commands, which are shares of it."""


def units_of(senses: Sequence[float], *, battery: bool, warming: bool) -> dict[str, str]:
    """Every parameter of a multirotor with these rotors and its unit, in the order of the equations' tuple."""
    each = {name.format(i): unit for i in range(1, len(senses) + 1) for name, unit in ROTOR_UNITS.items()}
    return {**UNITS, **(BATTERY_UNITS if battery else {}), **(WARMING_UNITS if warming else {}), **each}


@lru_cache(maxsize=64)
def _tuple(name: str, fields: tuple[str, ...]) -> Any:
    """A named tuple type; the same one for the same names, so that compiled code is shared."""
    return namedtuple(name, fields)


def _options(card: Card) -> tuple[tuple[float, ...], bool, bool]:
    """Senses of the rotors, and whether the battery's resistance and the motors' warmth are in the equations."""
    options = {"battery": "measured", "motors": "steady", **card.options}
    senses = options.get("senses")
    if (
        set(options) - {"battery", "motors", "senses"}
        or not isinstance(senses, list | tuple)
        or any(sense not in (1, -1) for sense in senses)
        or options["battery"] not in ("measured", "resistance")
        or options["motors"] not in ("steady", "warming")
    ):
        raise CardError(
            f"options are {dict(card.options)}, expected senses = [1, -1, ...] (1: clockwise seen from above), one for "
            "each rotor, battery = 'measured' or 'resistance', and motors = 'steady' or 'warming'.",
            where=card.where,
            channel="options",
        )
    return tuple(float(sense) for sense in senses), options["battery"] == "resistance", options["motors"] == "warming"


def effectiveness(par: Named, senses: Sequence[float]) -> list[list[Scalar]]:
    """Lift and moments about x, y, z [N, N m] by each rotor's speed squared, as four rows."""
    gains = [getattr(par, f"gain_{i}") for i in range(1, len(senses) + 1)]
    lift = [gain * par.k_thrust for gain in gains]
    return [
        lift,
        [-getattr(par, f"rotor_{i}_y") * k for i, k in enumerate(lift, start=1)],
        [getattr(par, f"rotor_{i}_x") * k for i, k in enumerate(lift, start=1)],
        [-sense * gain * par.k_torque for sense, gain in zip(senses, gains, strict=True)],
    ]


def _least_norm(rows: list[list[Scalar]], wanted: Sequence[Scalar]) -> list[Scalar]:
    """The smallest x with rows x = wanted: rows' (rows rows')^-1 wanted by elimination (any backend's numbers)."""
    n = len(rows)
    table = [
        [sum(a * b for a, b in zip(p, q, strict=True)) for q in rows] + [w] for p, w in zip(rows, wanted, strict=True)
    ]
    for i in range(n):
        for j in range(i + 1, n):
            share = table[j][i] / table[i][i]
            table[j] = [a - share * b for a, b in zip(table[j], table[i], strict=True)]
    solved: list[Scalar] = [0.0] * n
    for i in reversed(range(n)):
        rest = sum((table[i][j] * solved[j] for j in range(i + 1, n)), start=0.0)
        solved[i] = (table[i][n] - rest) / table[i][i]
    return [sum(row[k] * value for row, value in zip(rows, solved, strict=True)) for k in range(len(rows[0]))]


def _terminal(par: Named, speeds: Sequence[Scalar], voltage: Scalar, xp: Backend) -> Scalar:
    """Voltage at the terminals under a steady load: V = E - R P / (eta V), the larger root; half of E beyond."""
    lost = par.battery_resistance * shaft_power(par, speeds, 1.0) / par.drive_efficiency
    return 0.5 * (voltage + xp.sqrt(xp.maximum(voltage * voltage - 4.0 * lost, 0.0)))


def hover(
    par: Named, voltage: Scalar, xp: Backend, *, senses: tuple[float, ...], battery: bool, warming: bool
) -> tuple[dict[str, Scalar], tuple[Scalar, ...]]:
    """Hover in closed form: level, thrusts carry the weight, moments vanish, with the least sum of speeds^4.

    Returns:
        The states that are not zero, by name, and the inputs.
    """
    squares = _least_norm(effectiveness(par, senses), (par.mass * LABORATORY_GRAVITY, 0.0, 0.0, 0.0))
    speeds = [xp.sqrt(xp.maximum(square, 0.0)) for square in squares]
    states = {f"omega_{i}": omega for i, omega in enumerate(speeds, start=1)}
    at = voltage
    if battery:
        at = _terminal(par, speeds, voltage, xp)
        states["voltage_sag"] = voltage - at
    if warming:
        states["warmth"] = 1.0
    share = par.voltage_nominal / (par.k_drive * at)
    zero = par.o_drive + par.k_drive_voltage * (at - par.voltage_nominal)
    return states, tuple((omega - zero) * share for omega in speeds)


def settled(
    inputs: Named, par: Named, voltage: Scalar, attitude: Named, running: Scalar, *, warming: bool
) -> dict[str, Scalar]:
    """Inner states in a slow flight: the rotor speeds that the measured voltage holds, and motors that have carried
    the weight for `running` seconds."""
    if not warming:
        return {f"omega_{i}": steady_speed(par, command, voltage) for i, command in enumerate(inputs, start=1)}
    motors = MotorWarmth(1.0 - np.e ** (-running / par.tau_warm))
    cold = faster_when_cold(par, motors)
    speeds = {f"omega_{i}": steady_speed(par, command, voltage) + cold for i, command in enumerate(inputs, start=1)}
    return speeds | motors._asdict()


def axes(par: Named, senses: Sequence[float], *, warming: bool) -> tuple[Axis, ...]:
    """Roll, pitch, yaw and heave with the rotors that make them, from where these are and how they turn."""
    names = [f"motor_{i}" for i in range(1, len(senses) + 1)]
    rows = np.asarray(effectiveness(par, senses), dtype=np.float64)
    rows /= np.abs(rows).sum(axis=1, keepdims=True)
    slow = tuple(WARMING_UNITS) if warming else ()
    lift, roll, pitch, yaw = (dict(zip(names, row.tolist(), strict=True)) for row in rows)
    return (
        Axis("roll", roll),
        Axis("pitch", pitch),
        Axis("yaw", yaw, ("k_torque", "inertia_drive", "inertia_zz")),
        Axis("heave", lift, ("thrust_damping", "tau_shared", "o_drive", "k_drive_voltage", *slow)),
    )


def choices(card: Card) -> Mapping[str, Choice]:
    """What a flight with logged voltage can tell of a multirotor whose rotor speeds were not logged.

    Speeds by themselves leave no trace: only `k_thrust` k_drive^2 does, and so `k_drive` is held. Masses scale all
    forces, and moments about z scale with `inertia_zz`: both are held. A card with the battery's resistance has no
    choice: what a log calls voltage is measured behind that resistance.
    """
    _, battery, warming = _options(card)
    if battery:
        return {}
    at = card.values()

    def near(name: str, sigma: float, source: str) -> Free:
        return Free(name, 0.5 * sigma, at[name], sigma, source=source)

    rotors = [name for name in at if name.startswith("gain_")]
    slow = (
        near("o_cold", 0.03 * at["k_drive"], "3 % of the full speed: a winding that warms by some 30 K"),
        near("tau_warm", 0.5 * at["tau_warm"], "the card, half its value"),
    ) if warming else ()  # fmt: skip
    free = (
        Free("k_thrust", 0.1 * at["k_thrust"]),
        Free("k_torque", 0.2 * at["k_torque"], at["k_torque"], at["k_torque"], source="the card, as much again"),
        *(near(name, 0.1, "rotors and motors of one kind, a tenth") for name in rotors),
        near("inertia_xx", 0.3 * at["inertia_xx"], "the card, three tenths"),
        near("inertia_yy", 0.3 * at["inertia_yy"], "the card, three tenths"),
        near("tau_drive", 0.5 * at["tau_drive"], "the card, half its value"),
        near("tau_shared", at["tau_drive"], "one battery for all motors: the time constant of one, as much again"),
        near("o_drive", 0.3 * at["k_drive"], "the card, three tenths of the full speed"),
        near("k_drive_voltage", 0.3 * at["k_drive"] / at["voltage_nominal"], "a third of what a share of it does"),
        *slow,
        near("inertia_drive", at["inertia_drive"], "the card, as much again"),
        near("thrust_damping", 2.0 * at["thrust_damping"], "the card, twice its value"),
        near("flap_back", 3.0 * at["flap_back"], "the card, three times its value"),
        near("rotor_drag", at["rotor_drag"], "the card, as much again"),
        *(Free(name, 0.4 * sigma, 0.0, sigma, source=_BETWEEN) for name, sigma in PUSHES.items()),
    )
    summary = (
        "what a flight with logged voltage can tell: thrust, torque, rotors' differences, drive, damping, inertia; and "
        "of each flight the accelerations that it has of its own"
    )
    return {"full": Choice("full", summary, free)}


def picture(vehicle: Vehicle) -> dict[str, Any]:
    """A disc at each rotor's place."""
    par, senses = vehicle.values(), _options(vehicle.card)[0]
    rotors = [
        {
            "name": str(i),
            "hub": [getattr(par, f"rotor_{i}_{axis}") for axis in "xyz"],
            "radius": par.rotor_radius,
            "blades": 2,
            "sense": int(sense),
            "tilt": 0.0,
        }
        for i, sense in enumerate(senses, start=1)
    ]
    size = max(float(np.hypot(*item["hub"][:2])) for item in rotors) + par.rotor_radius
    skids = {"length": 0.4 * size, "width": 0.3 * size, "depth": 0.3 * size}
    parts = {"rotors": rotors, "bar": None, "tail": None, "skids": skids, "fin": None}
    return {"size": size, "weight": par.mass * LABORATORY_GRAVITY, **parts, "ground": True, "rpm": True}


def pose(vehicle: Vehicle) -> Pose:
    """Every disc with its speed and thrust."""
    par = vehicle.values()
    n, first = len(vehicle.input_names), vehicle.index("omega_1")

    def discs(x: Sequence[float], u: Sequence[float], around: Environment) -> dict[str, Any]:
        density = float(around.air_density) / par.air_density
        speeds = [float(x[first + i]) for i in range(n)]
        thrusts = [
            getattr(par, f"gain_{i}") * rotor.thrust(par.k_thrust, omega, density)
            for i, omega in enumerate(speeds, start=1)
        ]
        rotors = [[0.0, 0.0, omega, 0.0, 0.0, -thrust] for omega, thrust in zip(speeds, thrusts, strict=True)]
        return {"rotors": rotors, "bar": None, "tail": None}

    return discs


def _power(vehicle: Vehicle, x: Any, u: Any, around: Environment) -> float:
    par, first = vehicle.values(), vehicle.index("omega_1")
    return float(shaft_power(par, x[first : first + len(vehicle.input_names)], around.air_density / par.air_density))


def multirotor(card: Card) -> Vehicle:
    """The multirotor of a card: options `senses` (one for each rotor) and `battery` ("measured" or "resistance").

    Raises:
        CardError: options or parameters that do not fit, or rotors that cannot lift and turn the body in every axis.
    """
    senses, battery, warming = _options(card)
    units = units_of(senses, battery=battery, warming=warming)
    card.checked_against(units)
    parameters = _tuple("MultirotorParameters", tuple(units))
    numbers = card.values()
    par = parameters(*(numbers[name] for name in units))
    rows = np.asarray(effectiveness(par, senses), dtype=np.float64)
    if np.linalg.matrix_rank(rows / np.linalg.norm(rows, axis=1, keepdims=True).clip(1e-300), tol=1e-6) < 4:
        raise CardError(
            f"{len(senses)} rotors with these places and senses cannot lift, roll, pitch and yaw it independently.",
            where=card.where,
            channel="senses",
            hint="It needs four or more, not all on one line, some of which turn the other way.",
        )
    numbered = range(1, len(senses) + 1)
    drive = _tuple("MultirotorDrive", tuple(f"omega_{i}" for i in numbered))
    inputs = _tuple("MultirotorInputs", tuple(f"motor_{i}" for i in numbered))
    inner = {**({"voltage_sag": "V"} if battery else {}), **({"warmth": "1"} if warming else {})}
    return Vehicle(
        card=card,
        state=MultirotorState(
            RigidBody(*(0.0,) * 12),
            drive(*(0.0,) * len(senses)),
            Battery(0.0) if battery else None,
            MotorWarmth(0.0) if warming else None,
        ),
        inputs=inputs,
        parameters=parameters,
        state_names=(*RigidBody._fields, *drive._fields, *inner),
        state_units=(*BODY_UNITS, *("rad/s",) * len(senses), *inner.values()),
        input_names=inputs._fields,
        input_units=("1",) * len(senses),
        input_limits=((0.0, 1.0),) * len(senses),
        derivatives=partial(derivatives, senses=senses),
        specific_force=partial(specific_force, senses=senses),
        traits=Traits(
            axes=axes(par, senses, warming=warming),
            motors=inputs._fields,
            observed=True,
            gyroscope=True,
            no_link="a multirotor's motors have no servo mapping; ArduPilot's and PX4's own multirotor simulators "
            "fly such a frame",
            choices=choices,
            effects=lambda card: (*EFFECTS, WARMING) if warming else EFFECTS,
            recording=RecordingFit(),
            picture=picture,
            pose=pose,
            hover=partial(hover, senses=senses, battery=battery, warming=warming),
            settled=None if battery else partial(settled, warming=warming),
            power=_power,
            voltage_seconds=_VOLTAGE_SECONDS,
        ),
    )
