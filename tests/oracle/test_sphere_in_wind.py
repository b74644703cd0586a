"""A sphere with drag over a turning ellipsoid, in still air, steady wind and shear, dropped and thrown.

The cases follow numbers 6 to 10 of Jackson et al. (NASA/TM-2015-218675): mass 1 slug, 0.1963 ft^2, drag coefficient
0.1, from 30,000 ft, or thrown from the ground eastward and northward. The report's own numbers were not at hand:
the other route is SciPy's integration in axes that do not turn, with gravitation, ellipsoid and air written anew.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import swashplate as sp
from swashplate.arrays import Array
from swashplate.models.card import Card, Parameter
from swashplate.models.vehicle import Vehicle
from swashplate.physics.earth import Earth
from swashplate.physics.frames import Vector, local_to_body
from swashplate.physics.rigid_body import BODY_UNITS, Inertia, RigidBody, gravity, rigid_body_rates

FOOT, SLUG = 0.3048, 14.593903
MASS, AREA, DRAG = SLUG, 0.1963495 * FOOT**2, 0.1
TURN, GM, J2, A, F = 7.292115e-5, 3.986004418e14, 1.082626684e-3, 6378137.0, 1.0 / 298.257223563
TOP = 30000.0 * FOOT


class Numbers(NamedTuple):
    mass: Any
    inertia: Any
    wind: Any
    shear: Any


class State(NamedTuple):
    body: RigidBody


class Inputs(NamedTuple):
    nothing: Any


def _push(state: State, par: Any, env: Any, xp: Any) -> Vector:
    body = state.body
    wind = env.wind + Vector(0.0, par.wind - par.shear * body.z, 0.0)
    air = body.velocity + local_to_body(wind, body.attitude, xp).scaled(-1.0)
    speed = xp.sqrt(air.x * air.x + air.y * air.y + air.z * air.z + 1e-12)
    return air.scaled(-0.5 * env.air_density * DRAG * AREA * speed)


def _derivatives(state: State, inputs: Any, par: Any, env: Any, xp: Any) -> State:
    force = gravity(par.mass, env.gravity, state.body.attitude, xp) + _push(state, par, env, xp)
    inertia = Inertia(par.mass, par.inertia, par.inertia, par.inertia)
    return State(rigid_body_rates(state.body, force, Vector(0.0, 0.0, 0.0), inertia, xp))


def _specific_force(state: State, inputs: Any, par: Any, env: Any, xp: Any) -> Vector:
    return _push(state, par, env, xp).scaled(1.0 / par.mass)


def _sphere(wind: float, shear: float) -> Vehicle:
    given = {"mass": (MASS, "kg"), "inertia": (4.88, "kg m^2"), "wind": (wind, "m/s"), "shear": (shear, "1/s")}
    return Vehicle(
        card=Card("sphere", "a sphere", "nothing", {}, {n: Parameter(*v, "made", "assumed") for n, v in given.items()}),
        parameters=Numbers,
        derivatives=_derivatives,
        specific_force=_specific_force,
        state=State(RigidBody(*(0.0,) * 12)),
        inputs=Inputs,
        state_names=RigidBody._fields,
        state_units=BODY_UNITS,
        input_names=("nothing",),
        input_units=("1",),
        input_limits=((0.0, 1.0),),
    )


# ---- the other route -------------------------------------------------------------------------------------------------
def _air(height: float) -> float:
    """US Standard Atmosphere 1976 up to 11 km, by geopotential height [kg/m^3]."""
    geopotential = height * 6356766.0 / (6356766.0 + height)
    warm = 288.15 - 0.0065 * geopotential
    return float(1.225 * (warm / 288.15) ** (9.80665 / (287.05287 * 0.0065) - 1.0))


def _axes(latitude: float, longitude: float) -> Array:
    s, c, sl, cl = np.sin(latitude), np.cos(latitude), np.sin(longitude), np.cos(longitude)
    return np.array([[-s * cl, -s * sl, c], [-sl, cl, 0.0], [-c * cl, -c * sl, -s]])


def _geodetic(at: Array) -> tuple[float, float, float]:
    """By repeating, not by Bowring's formula."""
    e2, level = F * (2.0 - F), np.hypot(at[0], at[1])
    latitude = np.arctan2(at[2], level)
    for _ in range(30):
        across = A / np.sqrt(1.0 - e2 * np.sin(latitude) ** 2)
        latitude = np.arctan2(at[2] + e2 * across * np.sin(latitude), level)
    across = A / np.sqrt(1.0 - e2 * np.sin(latitude) ** 2)
    height = level * np.cos(latitude) + at[2] * np.sin(latitude) - across * (1.0 - e2 * np.sin(latitude) ** 2)
    return float(latitude), float(np.arctan2(at[1], at[0])), float(height)


def _turned(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _theirs(case: dict[str, float], seconds: float) -> tuple[float, float, float]:
    across = A
    start = np.array([across + case["height"], 0.0, 0.0])  # on the equator, at Greenwich
    local = np.array([case["north"], case["east"], case["down"]]) @ _axes(0.0, 0.0)
    spin = np.array([0.0, 0.0, TURN])

    def rates(t: float, y: Array) -> Array:
        at, to_fixed = y[:3], _turned(-TURN * t)
        latitude, longitude, height = _geodetic(to_fixed @ at)
        r = np.linalg.norm(at)
        share, tilt = 1.5 * J2 * (A / r) ** 2, 5.0 * (at[2] / r) ** 2
        pull = -GM / r**3 * at * np.array([1.0 + share * (1.0 - tilt)] * 2 + [1.0 + share * (3.0 - tilt)])
        wind = np.array([0.0, case["wind"] + case["shear"] * (height - case["height"]), 0.0])
        air = y[3:] - np.cross(spin, at) - to_fixed.T @ (wind @ _axes(latitude, longitude))
        drag = -0.5 * _air(height) * DRAG * AREA / MASS * np.linalg.norm(air) * air
        return np.concatenate([y[3:], pull + drag])

    begin = np.concatenate([start, local + np.cross(spin, start)])
    end = solve_ivp(rates, (0.0, seconds), begin, rtol=1e-11, atol=1e-6, method="DOP853").y[:, -1]
    return _geodetic(_turned(-TURN * seconds) @ end[:3])


STILL = {"height": TOP, "north": 0.0, "east": 0.0, "down": 0.0, "wind": 0.0, "shear": 0.0}
UP = 1000.0 * FOOT * np.sqrt(0.5)
CASES = {
    "6, dropped": STILL,
    "7, in a steady wind": {**STILL, "wind": 20.0 * FOOT},
    "8, in shear": {**STILL, "wind": (0.003 * 30000.0 - 20.0) * FOOT, "shear": 0.003},
    "9, thrown eastward": {**STILL, "height": 0.0, "east": UP, "down": -UP},
    "10, thrown northward": {**STILL, "height": 0.0, "north": UP, "down": -UP},
}


def _ours(case: dict[str, float], seconds: float, **changes: Any) -> Array:
    begin = dict.fromkeys(RigidBody._fields, 0.0) | {"u": case["north"], "v": case["east"], "w": case["down"]}
    flight = sp.simulate(
        _sphere(case["wind"], case["shear"]),
        {"nothing": np.zeros(round(seconds * 20.0) + 1)},
        start=begin,
        rate=20.0,
        earth=Earth(0.0, 0.0, case["height"], **changes),
    )
    return np.array([flight.values(name)[-1] for name in ("latitude", "longitude", "altitude")])


def _feet_off(found: Array, right: tuple[float, float, float]) -> float:
    return float(
        np.abs((found - np.degrees([*right[:2], 0.0]) - [0.0, 0.0, right[2]]) * [111e3, 111e3, 1.0]).max() / FOOT
    )


@pytest.mark.parametrize("name", CASES)
def test_a_sphere_falls_and_drifts_as_in_axes_that_do_not_turn(name: str) -> None:
    assert _feet_off(_ours(CASES[name], 30.0), _theirs(CASES[name], 30.0)) < 0.1


@pytest.mark.parametrize("name", ["7, in a steady wind", "8, in shear"])
def test_wind_and_air_show(name: str) -> None:
    right = _theirs(CASES[name], 30.0)
    assert _feet_off(_ours(STILL, 30.0), right) > 1.0
    assert _feet_off(_ours(CASES[name], 30.0, standard_air=False), right) > 1.0
