"""Where a single-rotor helicopter's equations stop being true, and the power that they take, at a flight state."""

from __future__ import annotations

from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.models.conventional.helicopter import HelicopterLoads, HelicopterState, loads
from swashplate.models.nesting import rebuild
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend, Named
from swashplate.physics.environment import Environment
from swashplate.physics.flapping import Flapping
from swashplate.physics.frames import Vector, local_to_body

_TURNING = 0.5
"""Share of the governed speed below which a rotor carries nothing that could be doubted."""
_CARRIES = 0.1
"""Of the weight: a rotor that lifts less has no wake that could come back, and no number of it is told."""
_ADVANCE = 0.35
_LOADING = 0.13
_FLAPPING = 0.21
_THROUGH = 0.15
"""Advance ratio, C_T / sigma, flapping [rad] and share of the tip speed at which air comes through the disc, beyond
which reversed flow, stall and large angles count (0.15: the air meets the blades at 0.2 rad at three quarters)."""


def shaft_power(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> float:
    """Power [W] that main and tail rotor take from the engine at a state."""
    return float(_loads(vehicle, x, u, environment).power)


def _loads(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> HelicopterLoads:
    """What acts at a state."""
    state: HelicopterState = rebuild(vehicle.state, [float(value) for value in x])
    inputs: Any = vehicle.inputs(*(float(value) for value in u))
    return loads(state, inputs, vehicle.values(), environment, FloatBackend(), options=vehicle.options)


def doubts_by_kind(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> dict[str, str]:
    """What of the equations does not hold at a state, in words by kind; empty where they may be trusted."""
    acting = _loads(vehicle, x, u, environment)
    xp, par = FloatBackend(), vehicle.values()
    state: HelicopterState = rebuild(vehicle.state, [float(value) for value in x])
    body = state.body
    air = body.velocity + local_to_body(environment.wind, body.attitude, xp).scaled(-1.0)
    omega = par.rotor_speed if state.rotor is None else state.rotor.omega
    return rotor_doubts(acting.main_rotor.force, air, float(acting.induced), omega, state.disc, par, environment)


def rotor_doubts(
    force: Vector, air: Vector, induced: float, omega: float, disc: Flapping, par: Named, environment: Environment
) -> dict[str, str]:
    """What of a rotor's equations does not hold, in words by kind; nothing of a rotor that hardly turns.

    Vortex ring (Leishman 2006, sec. 2.13), reversed flow, blade stall, large angles of inflow and flapping.

    Args:
        force: of the rotor [N].
        air: velocity through the air, body axes [m/s].
        induced: velocity through the disc beyond that of the flight [m/s].
        omega: rotor speed [rad/s].
        disc: its tip-path plane.
        par: the card's numbers.
        environment: for the air's density.
    """
    if omega < _TURNING * par.rotor_speed:
        return {}
    tip = omega * par.rotor_radius
    solidity = par.rotor_blades * par.rotor_chord / (np.pi * par.rotor_radius)
    thrust = float(np.sqrt(force.x**2 + force.y**2 + force.z**2))
    loading = thrust / (environment.air_density * np.pi * par.rotor_radius**2 * tip**2) / solidity
    hover = float(np.sqrt(thrust / (2.0 * environment.air_density * np.pi * par.rotor_radius**2)))
    across = float(np.hypot(air.x, air.y))
    doubts: dict[str, str] = {}
    carries = thrust > _CARRIES * par.mass * environment.gravity
    if carries and 0.5 * hover < air.z < 2.0 * hover and across < hover:
        doubts["vortex ring"] = (
            f"sinks at {air.z:.1f} m/s with {across:.1f} m/s across: the vortex ring ({0.5 * hover:.1f} to "
            f"{2.0 * hover:.1f} m/s below {hover:.1f} m/s of speed), where momentum theory is only a mean"
        )
    if across / tip > _ADVANCE:
        doubts["advance"] = (
            f"the advance ratio is {across / tip:.2f}, above {_ADVANCE}: reversed flow and stall are left out"
        )
    if loading > _LOADING:
        doubts["stall"] = f"C_T / sigma is {loading:.3f}, above {_LOADING}: blades would stall, lift here is linear"
    through = (induced - float(air.z)) / tip
    if abs(through) > _THROUGH:
        doubts["inflow"] = (
            f"air comes through the disc at {abs(through):.2f} of the tip speed, above {_THROUGH}: its angles at the "
            "blades are taken as small"
        )
    flap = max(abs(float(disc.a1)), abs(float(disc.b1)))
    if flap > _FLAPPING:
        doubts["flapping"] = f"the disc flaps by {np.degrees(flap):.0f} deg: angles are taken as small"
    return doubts
