"""Bodies without forces over a turning ellipsoid, against JSBSim's own Earth (one of NASA's reference simulators).

The cases are those of Jackson et al. (NASA/TM-2015-218675): dropped, tumbling, thrown eastward and northward from
30,000 ft, J2 gravity, 30 s. The bound of 0.1 ft is below the spread of the reference simulators there.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import pytest

import jsbsim_ball
import swashplate as sp
from jsbsim_ball import FOOT
from swashplate.models.card import Card, Parameter
from swashplate.models.vehicle import Vehicle
from swashplate.physics.atmosphere import density_at
from swashplate.physics.backend import FloatBackend
from swashplate.physics.earth import Earth, acceleration, geodetic, local_axes, place
from swashplate.physics.frames import Vector
from swashplate.physics.rigid_body import BODY_UNITS, Inertia, RigidBody, gravity, rigid_body_rates

pytest.importorskip("jsbsim", reason="JSBSim is not installed")
FLOATS = FloatBackend()


class Numbers(NamedTuple):
    mass: Any
    xx: Any
    yy: Any
    zz: Any


class State(NamedTuple):
    body: RigidBody


class Inputs(NamedTuple):
    nothing: Any


def _derivatives(state: State, inputs: Inputs, par: Numbers, env: Any, xp: Any) -> State:
    weight = gravity(par.mass, env.gravity, state.body.attitude, xp)
    return State(rigid_body_rates(state.body, weight, Vector(0.0, 0.0, 0.0), Inertia(*par), xp))


def _specific_force(state: State, inputs: Inputs, par: Numbers, env: Any, xp: Any) -> Vector:
    return Vector(0.0, 0.0, 0.0)


def _ball() -> Vehicle:
    """Without forces, with the moments of inertia of JSBSim's."""
    units, values = ("kg", "kg m^2", "kg m^2", "kg m^2"), (9000.0, 20.0, 10.0, 10.0)
    numbers = {n: Parameter(v, u, "made", "assumed") for n, v, u in zip(Numbers._fields, values, units, strict=True)}
    return Vehicle(
        card=Card("ball", "a ball", "nothing", {}, numbers),
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


CASES = {
    "dropped": {},
    "at a latitude": {"lat-geod-deg": 40.0, "long-gc-deg": -75.0},
    "tumbling": {"p-rad_sec": np.radians(10.0), "q-rad_sec": np.radians(20.0), "r-rad_sec": np.radians(30.0)},
    "eastward": {"psi-true-deg": 90.0, "u-fps": 1000.0},
    "northward": {"lat-geod-deg": 20.0, "u-fps": 1000.0},
}


@lru_cache(maxsize=8)
def _flown_by_them(named: tuple[tuple[str, float], ...]) -> tuple[dict[str, float], dict[str, float]]:
    """Start and end by JSBSim, whose attitude is of first order in its step: two steps, carried on to none."""
    case = dict(named)
    coarse, fine = (jsbsim_ball.fly(case, seconds=30.0, step=step) for step in (0.002, 0.001))
    return fine["first"], {name: 2.0 * value - coarse["last"][name] for name, value in fine["last"].items()}


def _theirs(case: dict[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    return _flown_by_them(tuple(case.items()))


def _ours(case: dict[str, float], first: dict[str, float], **changes: Any) -> sp.Flight:
    place = np.radians(case["lat-geod-deg"]), np.radians(case["long-gc-deg"]), first["altitude"] * FOOT
    begin = dict.fromkeys(RigidBody._fields, 0.0) | {n: first[n] for n in ("phi", "theta", "psi", "p", "q", "r")}
    begin["u"] = case.get("u-fps", 0.0) * FOOT
    return sp.simulate(_ball(), {"nothing": np.zeros(3001)}, start=begin, rate=100.0, earth=Earth(*place, **changes))


def _metres_off(flight: sp.Flight, last: dict[str, float]) -> float:
    north, east = (np.radians(flight.values(n)[-1] - last[n]) * 6.378e6 for n in ("latitude", "longitude"))
    return float(max(abs(north), abs(east), abs(flight.values("altitude")[-1] - last["altitude"] * FOOT)))


SLOWLY = [pytest.param(name, marks=pytest.mark.proof) for name in ("dropped", "at a latitude", "eastward")]
"""What a tumbling body and one that is thrown northward at a latitude need as well."""


@pytest.mark.parametrize("name", ["tumbling", "northward", *SLOWLY])
def test_a_body_falls_and_turns_as_jsbsims(name: str) -> None:
    case = {"lat-geod-deg": 0.0, "long-gc-deg": 0.0, "h-sl-ft": 30000.0, **CASES[name]}
    first, last = _theirs(case)
    flight = _ours(case, first)
    assert _metres_off(flight, last) < 0.1 * FOOT
    for rate in ("p", "q", "r"):
        assert flight.values(rate)[-1] == pytest.approx(last[rate], abs=1e-6)
    away = [np.remainder(flight.values(n)[-1] - last[n] + np.pi, 2.0 * np.pi) - np.pi for n in ("phi", "theta", "psi")]
    np.testing.assert_allclose(away, 0.0, atol=2e-5)


@pytest.mark.parametrize(
    "changes",
    [
        {"gravity": "inverse-square"},
        {"rotating": False},
        pytest.param({"gravity": "constant"}, marks=pytest.mark.proof),
    ],
)
def test_each_part_of_the_earth_shows(changes: dict[str, Any]) -> None:
    """Thrown eastward at 40 degrees; without J2, without turning, with one gravity everywhere it lands elsewhere."""
    case = {"lat-geod-deg": 40.0, "long-gc-deg": 0.0, "h-sl-ft": 30000.0, "psi-true-deg": 90.0, "u-fps": 1000.0}
    first, last = _theirs(case)
    assert _metres_off(_ours(case, first, **changes), last) > 1.0


def test_gravity_at_the_equator_and_the_pole_is_wgs_84s() -> None:
    """Normal gravity, NIMA TR8350.2 (2000), table 3.4."""
    for latitude, published in ((0.0, 9.7803253359), (np.pi / 2.0, 9.8321849378)):
        earth = Earth(latitude, 0.0)
        at, down = place(earth, latitude, 0.0, 0.0, FLOATS), local_axes(latitude, 0.0, FLOATS)[2]
        found = np.array(acceleration(earth, at, down, 0.0, FLOATS))
        assert found @ np.array(down) == pytest.approx(published, abs=2e-4)


def test_places_come_back() -> None:
    random = np.random.default_rng(0)
    for sphere in (False, True):
        earth = Earth(0.0, 0.0, sphere=sphere)
        for _ in range(20):
            given = (
                *(random.uniform(-1.0, 1.0, 2) * (np.pi / 2.0, np.pi)).tolist(),
                float(random.uniform(-400.0, 3e4)),
            )
            found = geodetic(earth, place(earth, *given, FLOATS), FLOATS)
            np.testing.assert_allclose(found, given, rtol=0.0, atol=1e-7)


@pytest.mark.parametrize("feet", [0.0, 15000.0, 36000.0, 55000.0])
def test_the_standard_atmosphere_is_jsbsims(feet: float) -> None:
    found = jsbsim_ball.fly({"h-sl-ft": feet, "lat-geod-deg": 0.0, "long-gc-deg": 0.0}, seconds=0.0)["first"]
    assert density_at(feet * FOOT, FLOATS) == pytest.approx(515.3788 * found["density"], rel=2e-4)
