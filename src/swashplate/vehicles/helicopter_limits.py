"""Where a single-rotor helicopter's equations stop being true, said of a flight state or along a flight."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from swashplate.physics.backend import FloatBackend
from swashplate.physics.environment import Environment
from swashplate.physics.frames import local_to_body
from swashplate.vehicles.conventional import HelicopterState, Loads, loads
from swashplate.vehicles.derivatives import Array
from swashplate.vehicles.helicopter_options import HelicopterOptions
from swashplate.vehicles.structure import rebuild
from swashplate.vehicles.vehicle import Vehicle

_LOOKS = 200
_TURNING = 0.5
"""Share of the governed speed below which a rotor carries nothing that could be doubted."""
_ADVANCE = 0.35
_LOADING = 0.13
_FLAPPING = 0.21
_THROUGH = 0.15
"""Advance ratio, C_T / sigma, flapping [rad] and share of the tip speed at which air comes through the disc, beyond
which reversed flow, stall and large angles count (0.15: the air meets the blades at 0.2 rad at three quarters)."""


def doubts(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> tuple[str, ...]:
    """What of the equations does not hold at a state; empty where they may be trusted, or for other vehicles.

    Vortex ring (Leishman 2006, sec. 2.13), reversed flow, blade stall, large angles of inflow and flapping.
    """
    return tuple(_doubts(vehicle, x, u, environment).values())


def shaft_power(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> float | None:
    """Power [W] that main and tail rotor take from the engine at a state; None for other vehicles."""
    acting = _loads(vehicle, x, u, environment)
    return None if acting is None else float(acting.power)


def _loads(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> Loads | None:
    """What acts at a state; None for other vehicles."""
    options = vehicle.derivatives.keywords.get("options") if isinstance(vehicle.derivatives, partial) else None
    if not isinstance(options, HelicopterOptions):
        return None
    state: HelicopterState = rebuild(vehicle.state, [float(value) for value in x])
    inputs: Any = vehicle.inputs(*(float(value) for value in u))
    return loads(state, inputs, vehicle.values(), environment, FloatBackend(), options=options)


def doubts_along(vehicle: Vehicle, time: Array, x: Array, u: Array, wind: Array) -> tuple[str, ...]:
    """What of the equations does not hold somewhere along a flight, each with when that is first seen.

    Args:
        time: stamps [s], shape (n,); at most `_LOOKS` of them are looked at.
        x, u, wind: states (n, n_states), inputs (n, n_inputs) and wind (n, 3) by sample.
    """
    first: dict[str, str] = {}
    for k in np.unique(np.linspace(0, len(time) - 1, min(_LOOKS, len(time))).astype(int)):
        for kind, words in _doubts(vehicle, x[k], u[k], Environment(*(float(v) for v in wind[k]))).items():
            first.setdefault(kind, f"At {time[k]:.1f} s {words}")
    return tuple(first.values())


def _doubts(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> dict[str, str]:
    """The same by kind."""
    acting = _loads(vehicle, x, u, environment)
    if acting is None:
        return {}
    xp, par = FloatBackend(), vehicle.values()
    state: HelicopterState = rebuild(vehicle.state, [float(value) for value in x])
    body = state.body
    air = body.velocity + local_to_body(environment.wind, body.attitude, xp).scaled(-1.0)
    omega = par.rotor_speed if state.rotor is None else state.rotor.omega
    if omega < _TURNING * par.rotor_speed:
        return {}
    tip = omega * par.rotor_radius
    solidity = par.rotor_blades * par.rotor_chord / (np.pi * par.rotor_radius)
    force = acting.main_rotor.force
    thrust = float(np.sqrt(force.x**2 + force.y**2 + force.z**2))
    loading = thrust / (environment.air_density * np.pi * par.rotor_radius**2 * tip**2) / solidity
    hover = float(np.sqrt(thrust / (2.0 * environment.air_density * np.pi * par.rotor_radius**2)))
    across = float(np.hypot(air.x, air.y))
    found: dict[str, str] = {}
    if 0.5 * hover < air.z < 2.0 * hover and across < hover:
        found["vortex ring"] = (
            f"sinks at {air.z:.1f} m/s with {across:.1f} m/s across: the vortex ring ({0.5 * hover:.1f} to "
            f"{2.0 * hover:.1f} m/s below {hover:.1f} m/s of speed), where momentum theory is only a mean"
        )
    if across / tip > _ADVANCE:
        found["advance"] = (
            f"the advance ratio is {across / tip:.2f}, above {_ADVANCE}: reversed flow and stall are left out"
        )
    if loading > _LOADING:
        found["stall"] = f"C_T / sigma is {loading:.3f}, above {_LOADING}: blades would stall, lift here is linear"
    through = (float(acting.induced) - float(air.z)) / tip
    if abs(through) > _THROUGH:
        found["inflow"] = (
            f"air comes through the disc at {abs(through):.2f} of the tip speed, above {_THROUGH}: its angles at the "
            "blades are taken as small"
        )
    flap = max(abs(float(state.disc.a1)), abs(float(state.disc.b1)))
    if flap > _FLAPPING:
        found["flapping"] = f"the disc flaps by {np.degrees(flap):.0f} deg: angles are taken as small"
    return found
