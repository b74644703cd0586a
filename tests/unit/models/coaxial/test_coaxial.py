"""The coaxial helicopter with collective pitch: momentum theory by hand, energy, mirrors, signs, refusals."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq, root

import swashplate as sp
from swashplate.errors import CardError, LinkError
from swashplate.links.servos import servo_mapping
from swashplate.models.card import packaged_cards
from swashplate.models.catalogue import from_card
from swashplate.models.coaxial.coaxial_vehicle import acting_at
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment

CARDS = ("coaxial15", "ingenuity")
SOUGHT = ("theta0", "theta0d", "lam0_upper", "lam0_lower")


def hover(vehicle: Vehicle, *, climb: float = 0.0) -> tuple[list[float], list[float]]:
    """State and inputs of a level hover or climb, by SciPy on plain floats: collective, its split, both inflows."""

    def row(at: Any) -> tuple[list[float], list[float]]:
        named = dict(zip(SOUGHT, (float(value) for value in at), strict=True))
        x = [named.get(name, -climb if name == "w" else 0.0) for name in vehicle.state_names]
        return x, [named.get(name, 0.0) for name in vehicle.input_names]

    wanted = [vehicle.index(name) for name in ("w", "r", "lam0_upper", "lam0_lower")]

    def left(at: Any) -> list[float]:
        rates = vehicle.rates(*row(at), vehicle.values())
        return [rates[i] for i in wanted]

    found = root(left, [0.25, 0.0, 0.04, 0.04], tol=1e-13)
    x, u = row(found.x)
    assert np.max(np.abs(np.array(vehicle.rates(x, u, vehicle.values()))[3:])) < 1e-9
    return x, u


def fastest(vehicle: Vehicle) -> float:
    """Frequency of the fastest oscillation at hover [Hz], by central differences on plain floats."""
    x, u = hover(vehicle)
    par, columns = vehicle.values(), []
    for i in range(len(x)):
        ends = [vehicle.rates([v + step * (j == i) for j, v in enumerate(x)], u, par) for step in (1e-6, -1e-6)]
        columns.append((np.array(ends[0]) - np.array(ends[1])) / 2e-6)
    return float(np.max(np.abs(np.linalg.eigvals(np.stack(columns, axis=1)).imag))) / (2.0 * math.pi)


def test_the_discs_of_stiff_blades_move_as_second_order_blades_on_a_free_body() -> None:
    """Two counter-rotating discs with their inertia on a fuselage that they tilt: 48.2 Hz; 37.9 on a fixed hub."""
    vehicle = sp.vehicle("ingenuity")
    par = vehicle.values()
    turn, disc = par.rotor_speed, 0.5 * par.rotor_blades * par.blade_inertia
    spring, body = par.hub_stiffness, par.inertia_xx
    mass = np.array([[disc, 0.0, disc], [0.0, disc, disc], [0.0, 0.0, body]])
    damping = 2.0j * turn * disc * np.array([[-1.0, 0.0, -1.0], [0.0, 1.0, 1.0], [0.0, 0.0, 0.0]])
    stiffness = spring * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, -1.0, 0.0]])
    free = [np.linalg.solve(mass, part) for part in (stiffness, damping)]
    whole = np.block([[np.zeros((3, 3)), np.eye(3)], [-free[0], -free[1]]])
    modes = np.abs(np.linalg.eigvals(whole).imag) / (2.0 * math.pi)
    slow = float(np.min(modes[modes > 1.0]))
    assert fastest(vehicle) == pytest.approx(slow, rel=0.02)
    assert fastest(sp.vehicle("ingenuity", stiff_blades=False)) > 1.3 * slow


def acting(vehicle: Vehicle, x: list[float], u: list[float]) -> Any:
    return acting_at(vehicle, x, u, environment_of(vehicle))


def velocities(vehicle: Vehicle, x: list[float]) -> tuple[float, float]:
    par = vehicle.values()
    tip = par.rotor_speed * par.rotor_radius
    return tuple(x[vehicle.index(f"lam0_{side}")] * tip for side in ("upper", "lower"))  # type: ignore[return-value]


@pytest.mark.parametrize("form", ["none", "coplanar", "vortex-tube", "contracted-wake"])
def test_hover_power_of_two_rotors_is_that_of_momentum_theory(form: str) -> None:
    """Without drag and losses both rotors take what momentum and balanced torques say, against two rotors alone."""
    plain = {"tip_loss": False, "induced_factor": False}
    vehicle = sp.vehicle("coaxial15", interference=form, **plain).with_values({"rotor_drag": 0.0, "fuselage_wake": 0.0})
    x, u = hover(vehicle)
    par, air = vehicle.values(), environment_of(vehicle)
    disc = 2.0 * air.air_density * math.pi * par.rotor_radius**2
    s = (par.hub_height_upper - par.hub_height_lower) / par.rotor_radius
    # Glauert for each rotor, the other's flow given: T = disc v (v + given); torques balance where T (v + given) do.
    ahead = 1.0 / (1.0 + 2.35 * s + s * s)
    on_upper, on_lower = {
        "none": (0.0, 0.0),
        "coplanar": (1.0, 1.0),
        "vortex-tube": (ahead, 1.0),
        "contracted-wake": (0.0, 1.0),
    }[form]

    def torques(ratio: float) -> float:
        return float((1.0 + on_upper * ratio) ** 2 - ratio * (ratio + on_lower) ** 2)

    ratio = brentq(torques, 0.1, 3.0, xtol=1e-14)
    flow_upper, flow_lower = 1.0 + on_upper * ratio, ratio + on_lower
    thrusts = np.array([flow_upper, ratio * flow_lower])  # over disc v^2 of the upper rotor
    v = math.sqrt(par.mass * air.gravity / (disc * thrusts.sum()))
    power = disc * v**3 * float(thrusts @ [flow_upper, flow_lower])
    alone = 2.0 * (0.5 * par.mass * air.gravity) ** 1.5 / math.sqrt(disc)

    assert velocities(vehicle, x) == pytest.approx((v, ratio * v), rel=1e-8)
    assert acting(vehicle, x, u).power == pytest.approx(power, rel=1e-8)
    factor = power / alone
    if form == "none":
        assert factor == pytest.approx(1.0, abs=1e-12)
    elif form == "coplanar":  # sqrt(2), the upper end of theory (Leishman 2006, sec. 2.15)
        assert factor == pytest.approx(math.sqrt(2.0), rel=1e-9)
    elif form == "contracted-wake":  # Leishman 2006, sec. 2.15: 1.28 by the wake's energy, 1.16 measured
        assert factor == pytest.approx(1.28, abs=0.03)
    else:  # nearer than a contracted wake, further than one plane
        assert 1.28 < factor < math.sqrt(2.0)


@pytest.mark.parametrize("climb", [0.0, 1.5])
@pytest.mark.parametrize("name", CARDS)
def test_the_shaft_gives_what_air_and_drag_take(name: str, climb: float) -> None:
    """Energy: shaft power is thrust times the flow through each disc, uneven flow's share, and the profile's drag."""
    vehicle = sp.vehicle(name)
    x, u = hover(vehicle, climb=climb)
    par, air, now = vehicle.values(), environment_of(vehicle), acting(vehicle, x, u)
    tip = par.rotor_speed * par.rotor_radius
    given = (now.rotors.given_upper, now.rotors.given_lower)
    flow = 0.0
    for part, own, more in zip((now.upper_rotor, now.lower_rotor), velocities(vehicle, x), given, strict=True):
        flow += -part.force.z * (par.rotor_induced_factor * own + more + climb)
    solidity = par.rotor_blades * par.rotor_chord / (math.pi * par.rotor_radius)
    drag = solidity * par.rotor_drag * (1.0 - par.rotor_root_cutout**4) / 8.0
    profile = 2.0 * air.air_density * math.pi * par.rotor_radius**2 * tip**3 * drag
    assert now.power == pytest.approx(flow + profile, rel=1e-9)
    assert given[1] > given[0]  # the lower rotor is in the upper's wake
    carried = -now.upper_rotor.force.z / (par.mass * air.gravity)
    assert 0.5 < carried < 0.65  # balanced torques give the upper rotor more


@pytest.mark.parametrize("name", CARDS)
def test_thrust_by_strips_of_the_blades(name: str) -> None:
    """Quadrature over both rotors' blades in the flow that each sees carries the weight."""
    vehicle = sp.vehicle(name)
    x, u = hover(vehicle)
    par, air, now = vehicle.values(), environment_of(vehicle), acting(vehicle, x, u)
    named = dict(zip(vehicle.input_names, u, strict=True))
    r = np.linspace(par.rotor_root_cutout, par.rotor_tip_loss, 20_001) * par.rotor_radius
    total = 0.0
    for sign, own, more in zip((1.0, -1.0), velocities(vehicle, x), now.rotors[2:4], strict=True):
        pitch = named["theta0"] + sign * named["theta0d"] + par.rotor_twist * r / par.rotor_radius
        lift = par.rotor_lift_slope * (pitch - (own + more) / (par.rotor_speed * r)) * (par.rotor_speed * r) ** 2
        total += par.rotor_blades * 0.5 * air.air_density * par.rotor_chord * float(np.trapezoid(lift, r))
    down = -now.fuselage.force.z
    assert total - abs(down) == pytest.approx(par.mass * air.gravity, rel=1e-6)


@pytest.mark.parametrize("rotation", ["ccw", "cw"])
def test_more_differential_collective_turns_the_nose_right(rotation: str) -> None:
    vehicle = sp.vehicle("coaxial15", rotation=rotation)
    x, u = hover(vehicle)
    more = list(u)
    more[vehicle.input_names.index("theta0d")] += 0.01
    turn = np.array(vehicle.rates(x, more, vehicle.values()))
    assert turn[vehicle.index("r")] > 1.0
    assert abs(turn[vehicle.index("w")]) < 0.05 * turn[vehicle.index("r")]


@pytest.mark.parametrize("name", CARDS)
def test_stick_ahead_leans_forward_and_stick_right_to_the_right(name: str) -> None:
    """Steadily: stiff blades turn across the stick before they settle along it."""
    vehicle = sp.vehicle(name)
    x, u = hover(vehicle)
    for stick, rate, sign in (("B1", "a1", -1.0), ("A1", "b1", 1.0)):
        moved = list(u)
        moved[vehicle.input_names.index(stick)] += 0.01
        tilt = steady_tilt(vehicle, x, moved)
        for side in ("upper", "lower"):
            along, across = tilt[f"{rate}_{side}"], tilt[f"{'b1' if rate == 'a1' else 'a1'}_{side}"]
            assert sign * along > 1e-5
            assert abs(across) < 0.01 * abs(along)


def steady_tilt(vehicle: Vehicle, x: list[float], u: list[float]) -> dict[str, float]:
    """Where discs and inflow come to rest on a body that is held."""
    first = vehicle.index("a1_upper")

    def left(inner: Any) -> Any:
        return vehicle.rates([*x[:first], *(float(v) for v in inner)], u, vehicle.values())[first:]

    found = root(left, x[first:], tol=1e-12)
    assert found.success
    return dict(zip(vehicle.state_names[first:], found.x.tolist(), strict=True))


def test_a_mirrored_craft_flies_the_mirrored_flight() -> None:
    options = {"servos": True, "delay": True, "rotor_speed": "governed", "ground_effect": "hayden"}
    one = sp.vehicle("coaxial15", rotation="ccw", **options).with_values({"hub_y": 0.02, "hub_x": 0.01})
    other = sp.vehicle("coaxial15", rotation="cw", **options).with_values({"hub_y": -0.02, "hub_x": 0.01})
    odd = ("y", "v", "phi", "psi", "p", "r", "b1_", "lam_s", "A1", "theta0d")
    signs = np.array([-1.0 if name in odd or name.startswith(odd[6:]) else 1.0 for name in one.state_names])
    turned = np.array([-1.0 if name in odd else 1.0 for name in one.input_names])
    chance = np.random.default_rng(3)
    x = chance.uniform(-0.1, 0.1, len(one.state_names))
    x[one.index("omega")], x[one.index("z")], x[one.index("u")] = 108.0, -1.2, 4.0
    x[one.index("lam0_upper")], x[one.index("lam0_lower")] = 0.03, 0.02
    u = np.array([0.12, 0.02, -0.01, 0.015])
    wind = Environment(wind_north=1.0, wind_east=0.7)
    found = np.array(other.rates(signs * x, turned * u, other.values(), wind._replace(wind_east=-0.7)))
    expected = signs * np.array(one.rates(x, u, one.values(), wind))
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-10)


def test_equal_rotors_in_each_others_plane_share_alike_and_do_not_couple() -> None:
    """Coplanar rotors are their own mirror image: no split of collective, and no gyroscopic moment of a turning hub."""
    vehicle = sp.vehicle("coaxial15", interference="coplanar").with_values(
        {"hub_height_upper": 0.30001, "hub_height_lower": 0.3}
    )
    x, u = hover(vehicle)
    assert dict(zip(vehicle.input_names, u, strict=True))["theta0d"] == pytest.approx(0.0, abs=1e-12)
    nodding = list(x)
    nodding[vehicle.index("q")] = 0.5
    tilt = steady_tilt(vehicle, nodding, u)
    assert tilt["a1_upper"] == pytest.approx(tilt["a1_lower"], rel=1e-3)
    assert tilt["b1_upper"] == pytest.approx(-tilt["b1_lower"], rel=1e-3)  # each disc leans its own way
    settled = [*nodding[: vehicle.index("a1_upper")], *tilt.values()]
    moment = acting(vehicle, settled, u).total().moment
    assert abs(moment.x) < 1e-3 * abs(moment.y)


def test_differential_cyclic_leans_the_discs_against_each_other() -> None:
    vehicle = sp.vehicle("coaxial15", differential_cyclic=True)
    assert dict(vehicle.trim_held) == {"B1d": 0.0, "A1d": 0.0}
    x, u = hover(vehicle)
    u[vehicle.input_names.index("A1d")] = 0.02
    tilt = steady_tilt(vehicle, x, u)
    assert tilt["b1_upper"] > 0.01
    assert tilt["b1_lower"] == pytest.approx(-tilt["b1_upper"], rel=0.02)


def test_it_flies_in_the_air_and_gravity_of_its_card() -> None:
    mars = environment_of(sp.vehicle("ingenuity"))
    assert (mars.air_density, mars.gravity) == (0.017, 3.71)
    assert environment_of(sp.vehicle("raptor50")).gravity == 9.81
    assert environment_of(sp.vehicle("ingenuity"), Environment(gravity=9.81)).gravity == 9.81
    heavy = sp.vehicle("ingenuity").with_values({"gravity": 5.0})
    x, u = hover(heavy)
    assert -acting(heavy, x, u).total().force.z == pytest.approx(1.8 * 5.0, rel=1e-9)


def test_it_says_where_its_rotors_are_not_to_be_trusted() -> None:
    vehicle = sp.vehicle("coaxial15")
    x, u = hover(vehicle)
    doubts = vehicle.traits.doubts
    assert doubts is not None
    around = environment_of(vehicle)
    assert doubts(vehicle, np.array(x), np.array(u), around) == {}
    sinking = list(x)
    sinking[vehicle.index("w")] = 3.5
    assert "vortex ring upper" in doubts(vehicle, np.array(sinking), np.array(u), around)
    loaded = vehicle.with_values({"rotor_chord": 0.02})
    x, u = hover(loaded)
    assert "stall upper" in doubts(loaded, np.array(x), np.array(u), around)


@pytest.mark.parametrize(
    ("change", "options", "words"),
    [
        ({"hub_height_upper": 0.2}, {}, "hub_height_upper: is 0.2 m, not above hub_height_lower"),
        ({"rotor_blades": 2.5}, {}, "rotor_blades: is 2.5, expected a whole number"),
        ({"gravity": 0.0}, {}, "gravity: is 0, expected more than 0"),
        ({"collective_low": 0.3}, {}, "collective_low: is 0.3, not below"),
        ({"differential_limit": 4.0}, {}, "differential_limit: is 4 rad, more than 57 deg"),
        ({}, {"bar": True}, "bar: is not an option"),
        ({}, {"interference": "some"}, "interference: is 'some', expected one of 'vortex-tube'"),
        ({}, {"grip": True}, "grip: needs ground"),
    ],
)
def test_a_card_that_no_craft_has_is_refused(change: dict[str, float], options: dict[str, Any], words: str) -> None:
    card = packaged_cards()["coaxial15"]
    free = {name: replace(entry, lower=None, upper=None) for name, entry in card.parameters.items()}
    card = replace(card, parameters=free).with_values(change)
    with pytest.raises(CardError, match=words.replace("(", r"\(")):
        from_card(replace(card, options={**card.options, **options}))


def test_another_vehicles_servos_are_refused_in_words() -> None:
    with pytest.raises(LinkError, match="vehicle: is 'conventional', the vehicle has the equations of 'coaxial'"):
        servo_mapping("raptor50", sp.vehicle("coaxial15"))
