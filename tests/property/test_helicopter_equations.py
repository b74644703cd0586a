"""The single-rotor helicopter's equations: floats and CasADi alike, mirror image, moving frames, bad cards."""

from __future__ import annotations

from dataclasses import replace

import casadi
import numpy as np
import pytest

from swashplate.errors import CardError
from swashplate.models import catalogue
from swashplate.models.conventional.helicopter import Controls, loads
from swashplate.models.nesting import leaves, rebuild
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import CasadiBackend, FloatBackend
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Euler, Vector, local_to_body

FLOATS = FloatBackend()
EVERYTHING = {
    "delay": True,
    "engine_lag": True,
    "bar": True,
    "inflow": "pitt-peters",
    "rotor_speed": "throttle",
    "gyro": True,
    "servos": True,
    "ground": True,
    "grip": True,
    "coning": True,
}
FORMS = [
    {},
    {"inflow": "pitt-peters", "phase_lag": True, "in_plane": "thrust-tilt"},
    {"inflow": "uniform", "rotor_speed": "governed", "yaw_at_blades": True, "precession_torque": True},
    EVERYTHING,
]
MIRRORED = (
    "grip_fr_y",
    "grip_fl_y",
    "grip_ar_y",
    "grip_al_y",
    "y",
    "v",
    "phi",
    "psi",
    "p",
    "r",
    "b1",
    "d",
    "lam_s",
    "r_gyro",
    "A1_servo",
    "A1",
    "A1_late",
    "A1_late_rate",
)


def other_side(name: str) -> str:
    """The same skid end of the other side; any other name is itself."""
    return f"{name[:6]}{'l' if name[6] == 'r' else 'r'}{name[7:]}" if name.startswith("grip") else name


def random_case(vehicle: Vehicle, seed: int) -> tuple[np.ndarray, np.ndarray, Environment, Vehicle]:
    """A state near the template's, inputs, surroundings, and a card without a zero."""
    rng = np.random.default_rng(seed)
    template = np.array(list(leaves(vehicle.state)))
    small = np.array([0.1 if unit in ("rad", "1") else 1.0 for unit in vehicle.state_units])
    x = template * rng.uniform(0.8, 1.2, template.size) + 0.5 * small * rng.uniform(-1.0, 1.0, template.size)
    u = np.array([rng.uniform(low, high) for low, high in vehicle.input_limits])
    around = Environment(*rng.uniform(-2.0, 2.0, 3), rng.uniform(1.0, 1.3), 9.81, 12.0)
    zero = [name for name, value in vehicle.card.values().items() if value == 0.0]
    return x, u, around, vehicle.with_values({name: rng.uniform(0.0, 0.02) for name in zero})


@pytest.mark.parametrize("options", FORMS)
def test_floats_and_casadi_compute_the_same(options: dict[str, object]) -> None:
    vehicle = catalogue.vehicle("raptor50", **options)
    x, u = casadi.SX.sym("x", len(vehicle.state_names)), casadi.SX.sym("u", len(vehicle.input_names))
    p, e = casadi.SX.sym("p", len(vehicle.parameter_names)), casadi.SX.sym("e", len(Environment._fields))
    parameters = vehicle.parameters(*casadi.vertsplit(p))
    traced = vehicle.rates(x, u, parameters, Environment(*casadi.vertsplit(e)), CasadiBackend())
    with_casadi = casadi.Function("rates", [x, u, p, e], [casadi.vertcat(*traced)])
    for seed in range(8):
        state, inputs, around, flown = random_case(vehicle, seed)
        floats = np.array(flown.rates(state.tolist(), inputs.tolist(), flown.values(), around, FLOATS))
        casadied = np.asarray(with_casadi(state, inputs, np.array(flown.values()), np.array(around))).ravel()
        np.testing.assert_allclose(casadied, floats, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("options", FORMS)
def test_a_clockwise_helicopter_flies_the_exact_mirror_image(options: dict[str, object]) -> None:
    """To the last bit: left and right swapped, the rotor turning the other way."""
    right = catalogue.vehicle("raptor50", **options)
    for seed in range(10):
        x, u, around, flown = random_case(right, seed)
        card = replace(flown.card, options={**flown.card.options, "rotation": "ccw"})
        left = catalogue.from_card(card).with_values({"hub_y": -flown.card.values()["hub_y"]})
        sign = np.array([-1.0 if name in MIRRORED else 1.0 for name in right.state_names])
        swap = [right.index(other_side(name)) for name in right.state_names]
        commands = u * np.array([-1.0 if name in MIRRORED else 1.0 for name in right.input_names])
        here = np.array(flown.rates(x.tolist(), u.tolist(), flown.values(), around, FLOATS))
        air = around._replace(wind_east=-around.wind_east)
        there = np.array(left.rates((sign * x[swap]).tolist(), commands.tolist(), left.values(), air, FLOATS))
        np.testing.assert_array_equal(there, sign * here[swap])


def test_blades_that_feel_the_yaw_are_blades_of_a_slower_rotor() -> None:
    """A fuselage that yaws with a counter-clockwise rotor's reaction takes its yaw rate off the blades' speed."""
    yaw, plain = 0.8, catalogue.vehicle("lynx")
    speed = plain.card.values()["rotor_speed"]
    x, u = np.zeros(len(plain.state_names)), np.array([0.25, 0.0, 0.0, 0.2])
    turning = x.copy()
    turning[plain.index("r")] = yaw
    flown = plain.with_values({"shaft_tilt": 0.0, "hub_x": 0.0})
    feels = catalogue.from_card(replace(flown.card, options={**flown.card.options, "yaw_at_blades": True}))

    def rotor(vehicle: Vehicle, state: np.ndarray, omega: float) -> np.ndarray:
        par = vehicle.values()._replace(rotor_speed=omega)
        built = rebuild(vehicle.state, state.tolist())
        acting = loads(
            built, Controls(*u), par, environment_of(vehicle), FLOATS, options=vehicle.derivatives.keywords["options"]
        ).main_rotor
        return np.array([*acting.force, *acting.moment])

    np.testing.assert_allclose(rotor(feels, turning, speed), rotor(flown, x, speed - yaw), rtol=1e-12, atol=1e-9)
    np.testing.assert_array_equal(rotor(flown, turning, speed), rotor(flown, x, speed))


def test_the_air_knows_only_relative_motion() -> None:
    vehicle = catalogue.vehicle("raptor50", bar=True, inflow="pitt-peters")
    x, u, around, flown = random_case(vehicle, 3)
    places = [vehicle.index(name) for name in ("p", "q", "r")]
    x[places] = 0.0
    attitude = Euler(*(float(x[vehicle.index(name)]) for name in ("phi", "theta", "psi")))
    added, moved = Vector(1.3, -0.7, 0.4), x.copy()
    moved[[vehicle.index(name) for name in ("u", "v", "w")]] += np.array(local_to_body(added, attitude, FLOATS))
    windy = around._replace(
        wind_north=around.wind_north + added.x,
        wind_east=around.wind_east + added.y,
        wind_down=around.wind_down + added.z,
    )
    still = np.array(flown.rates(x.tolist(), u.tolist(), flown.values(), around, FLOATS))
    moving = np.array(flown.rates(moved.tolist(), u.tolist(), flown.values(), windy, FLOATS))
    np.testing.assert_allclose(moving[3:], still[3:], atol=1e-9)
    np.testing.assert_allclose(moving[:3] - still[:3], added, atol=1e-12)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"inertia_xx": -0.1}, r"inertia_xx: .*(outside|more than 0)"),
        ({"inertia_yy": 0.5}, "more than the two others together"),
        ({"rotor_chord": 0.0}, r"rotor_chord: .*(outside|more than 0)"),
        ({"shaft_tilt": 4.0}, "more than 57 deg. Angles in cards are in radians"),
        ({"inertia_xz": 0.2}, "the principal moments differ by"),
        ({"hinge_offset": 0.6}, "expected 0 to 0.5 of the radius"),
        ({"collective_low": 0.3}, "not below collective_high"),
        ({"rotor_drag": -0.01}, r"rotor_drag: .*(outside|0 or more)"),
    ],
)
def test_numbers_that_no_helicopter_has(changed: dict[str, float], said: str) -> None:
    card = catalogue.vehicle("raptor50").card
    with pytest.raises(CardError, match=said):
        catalogue.from_card(card.with_values(changed))
    bare = {name: replace(parameter, lower=None, upper=None) for name, parameter in card.parameters.items()}
    with pytest.raises(CardError):
        catalogue.from_card(replace(card, parameters=bare).with_values(changed))


def test_options_that_do_not_exist() -> None:
    with pytest.raises(CardError, match="inflow: is 'dynamic', expected one of 'glauert'"):
        catalogue.vehicle("raptor50", inflow="dynamic")
    with pytest.raises(CardError, match="flybar: is not an option"):
        catalogue.vehicle("raptor50", flybar=True)
    with pytest.raises(CardError, match="bar: is 1, expected one of True, False"):
        catalogue.vehicle("raptor50", bar=1)
