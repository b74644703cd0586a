"""Pitch by flapping and the all-moving tail: quadrature over the blades, schedules by hand, off without a trace."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import root

from hand_buildup import build_up
from swashplate.errors import CardError, SwashError
from swashplate.models.card import Parameter, packaged_cards
from swashplate.models.catalogue import from_card, vehicle
from swashplate.models.conventional.main_rotor import main_rotor
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.physics.flapping import Flapping
from swashplate.physics.frames import Vector
from swashplate.physics.tail_surfaces import stabilator_incidence

XP = FloatBackend()
DENSITY = 1.2
STATE = [0.0, 0.0, -5.0, 9.0, 1.0, -0.3, 0.05, -0.04, 0.2, 0.1, -0.2, 0.3, 0.02, -0.01]
CONTROLS = (0.1, 0.01, 0.02, 0.15)
SCHEDULE = {
    "stabilator_low": (0.6, "rad"),
    "stabilator_high": (-0.1, "rad"),
    "stabilator_from": (5.0, "m/s"),
    "stabilator_to": (15.0, "m/s"),
    "stabilator_collective": (0.5, "1"),
    "stabilator_neutral": (0.1, "rad"),
    "stabilator_pitch_rate": (0.3, "s"),
}


def with_numbers(numbers: dict[str, tuple[float, str]], name: str = "raptor50", **options: Any) -> Vehicle:
    card = packaged_cards()[name]
    added = {key: Parameter(value, unit, "test", "assumed") for key, (value, unit) in numbers.items()}
    return from_card(replace(card, options={**card.options, **options}, parameters={**card.parameters, **added}))


def bent(value: float, **options: Any) -> Vehicle:
    return with_numbers({"rotor_delta3": (value, "1")}, delta3=True, coning=True, **options)


@pytest.mark.parametrize("gain", [-0.4, 0.25])
def test_the_disc_rests_where_quadrature_over_the_blades_says(gain: float) -> None:
    """Flapping's mean, cosine and sine balance, and momentum, with the pitch of every element from its own flapping."""
    flown = bent(gain, rotation="ccw", inflow="uniform")
    changed = {"hub_x": 0.0, "hub_y": 0.0, "shaft_tilt": 0.0, "wake_distortion": 0.0, "cyclic_phase": 0.0}
    flown = flown.with_values({**changed, "precone": 0.01, "rotor_twist": -0.05, "hinge_offset": 0.0})
    p, air, (theta0, A1, B1) = flown.values(), Vector(14.0, 3.0, -1.0), (0.11, 0.015, 0.03)
    omega, tip = p.rotor_speed, p.rotor_speed * p.rotor_radius
    mu_x, mu_y, mu_z = air.x / tip, air.y / tip, air.z / tip
    x = (np.arange(2000) + 0.5)[:, None] / 2000.0
    psi = 2.0 * np.pi * np.arange(64)[None, :] / 64.0
    c, s = np.cos(psi), np.sin(psi)
    lock = DENSITY * p.rotor_lift_slope * p.rotor_chord * p.rotor_radius**4 / p.blade_inertia
    excess = p.hub_stiffness / (0.5 * p.rotor_blades * p.blade_inertia * omega**2)
    solidity = p.rotor_blades * p.rotor_chord / (math.pi * p.rotor_radius)

    def lift(at: Any) -> Any:
        lam, a0, a1, b1 = at
        beta, turning = a0 - a1 * c - b1 * s, a1 * s - b1 * c
        along = x + mu_x * s + mu_y * c
        up = mu_z - lam - x * turning - beta * (mu_x * c - mu_y * s)
        pitch = theta0 + p.rotor_twist * x - A1 * c - B1 * s + gain * (beta - p.precone)
        return along * (pitch * along + up)

    def left(at: Any) -> list[float]:
        lam, a0, a1, b1 = at
        element = lift(at)
        CT = 0.5 * p.rotor_lift_slope * solidity * element.mean()
        moment = (x * element).mean(axis=0)
        through = math.sqrt(mu_x**2 + mu_y**2 + (lam - mu_z) ** 2)
        return [
            CT - 2.0 * lam * through,
            (1.0 + excess) * a0 - 0.5 * lock * moment.mean(),
            -excess * a1 - lock * (moment * c[0]).mean(),
            -excess * b1 - lock * (moment * s[0]).mean(),
        ]

    found = root(left, [0.03, 0.02, 0.02, 0.0], tol=1e-13)
    assert found.success
    CT = 0.5 * p.rotor_lift_slope * solidity * lift(found.x).mean()
    disc = Flapping(found.x[2], found.x[3])
    rotor = main_rotor(
        air, Vector(0.0, 0.0, 0.0), disc, None, (theta0, A1, B1), omega, p, DENSITY, XP, flown.options, 5.0
    )
    assert rotor.disc.a1 == pytest.approx(0.0, abs=2e-5 * omega)
    assert rotor.disc.b1 == pytest.approx(0.0, abs=2e-5 * omega)
    assert rotor.induced == pytest.approx(found.x[0] * tip, rel=2e-5)
    assert -rotor.acting.force.z == pytest.approx(DENSITY * math.pi * p.rotor_radius**2 * tip**2 * CT, rel=2e-5)
    other = bent(0.0, rotation="ccw", inflow="uniform").with_values(
        {**changed, "precone": 0.01, "rotor_twist": -0.05, "hinge_offset": 0.0}
    )
    plain = main_rotor(
        air, Vector(0.0, 0.0, 0.0), disc, None, (theta0, A1, B1), omega, other.values(), DENSITY, XP, flown.options, 5.0
    )
    assert abs(plain.disc.a1) + abs(plain.disc.b1) > 5e-4 * omega  # without it the disc would not rest there


@pytest.mark.parametrize("inflow", ["glauert", "pitt-peters"])
def test_no_angle_is_no_option(inflow: str) -> None:
    plain = vehicle("raptor50", coning=True, inflow=inflow)
    x = [*STATE, *((0.04, 0.01, -0.01) if inflow == "pitt-peters" else ())]
    off, on = (np.array(one.rates(x, CONTROLS, one.values())) for one in (plain, bent(0.0, inflow=inflow)))
    np.testing.assert_allclose(on, off, rtol=1e-12, atol=1e-12)
    moved = bent(-0.3, inflow=inflow)
    assert np.max(np.abs(np.array(moved.rates(x, CONTROLS, moved.values())) - off)) > 0.1


def test_negative_takes_pitch_off() -> None:
    lifts = [one.rates(STATE, CONTROLS, one.values())[5] for one in (bent(-0.5), bent(0.0), bent(0.5))]
    assert lifts[0] > lifts[1] > lifts[2]  # down is positive


def test_a_mirrored_helicopter_does_the_same() -> None:
    options = {"stabilator": True, "tip_loss": True, "inflow": "pitt-peters"}
    numbers = {**SCHEDULE, "rotor_delta3": (-0.3, "1")}
    right = with_numbers(numbers, rotation="cw", delta3=True, coning=True, **options)
    left = with_numbers(numbers, rotation="ccw", delta3=True, coning=True, **options)
    left = left.with_values({"hub_y": -right.card.values()["hub_y"]})
    mirror = {"y", "v", "phi", "psi", "p", "r", "b1", "lam_s"}
    signs = np.array([-1.0 if name in mirror else 1.0 for name in right.state_names])
    x = np.array([*STATE, 0.04, 0.01, -0.01])
    rates = np.array(right.rates(x, CONTROLS, right.values()))
    turned = np.array(left.rates(signs * x, np.array(CONTROLS) * [1.0, 1.0, -1.0, 1.0], left.values()))
    np.testing.assert_allclose(turned, signs * rates, rtol=1e-11, atol=1e-11)


def test_the_schedule_by_hand() -> None:
    def at(speed: float, collective: float = 0.1, pitch_rate: float = 0.0) -> float:
        return float(
            stabilator_incidence(
                speed,
                collective,
                pitch_rate,
                low=0.6,
                high=-0.1,
                begin=5.0,
                end=15.0,
                by_collective=0.5,
                neutral=0.1,
                by_pitch_rate=0.3,
                xp=XP,
            )
        )

    assert (at(-3.0), at(5.0), at(20.0)) == pytest.approx((0.6, 0.6, -0.1))
    assert at(10.0) == pytest.approx(0.25)
    assert at(10.0, 0.2, -0.5) == pytest.approx(0.25 + 0.05 - 0.15)
    assert (at(0.0, 0.9), at(20.0, 0.1, -2.0)) == pytest.approx((0.6, -0.1))  # its stops


def test_the_tail_stands_where_the_schedule_says() -> None:
    """A fixed tail at the incidence of this speed, collective and pitch rate has the same rates; another has not."""
    flown = with_numbers({**SCHEDULE, "tailplane_area": (0.02, "m^2")}, stabilator=True)
    u, q = STATE[3], STATE[10]
    wanted = 0.6 - 0.7 * (u - 5.0) / 10.0 + 0.5 * (CONTROLS[0] - 0.1) + 0.3 * q
    still = with_numbers({"tailplane_area": (0.02, "m^2"), "tailplane_incidence": (wanted, "rad")})
    moving = np.array(flown.rates(STATE, CONTROLS, flown.values()))
    np.testing.assert_allclose(moving, still.rates(STATE, CONTROLS, still.values()), rtol=1e-12, atol=1e-12)
    other = with_numbers({"tailplane_area": (0.02, "m^2")})
    assert abs(moving[10] - other.rates(STATE, CONTROLS, other.values())[10]) > 0.1


def test_what_is_missing_or_has_no_build_up_is_refused() -> None:
    with pytest.raises(CardError, match="rotor_delta3: is missing, and option 'delta3' needs it"):
        vehicle("raptor50", delta3=True)
    with pytest.raises(CardError, match="stabilator_low: is missing, and option 'stabilator' needs it"):
        vehicle("raptor50", stabilator=True)
    turned = {**SCHEDULE, "stabilator_to": (4.0, "m/s")}
    with pytest.raises(CardError, match="stabilator_from: is 5, not below stabilator_to = 4"):
        with_numbers(turned, stabilator=True)
    for flown in (bent(-0.3), with_numbers(SCHEDULE, stabilator=True)):
        with pytest.raises(SwashError, match="delta3 or stabilator have no closed-form build-up"):
            build_up(flown, np.array(STATE), np.array(CONTROLS), environment_of(flown))


def test_the_wake_reaches_a_tail_rotor_below_the_hub_where_flight_sweeps_it_there() -> None:
    """None in hover and at a tail as high as the hub; at speed a canted tail rotor feels air that comes down."""
    off, on = (with_numbers({"tail_cant": (0.3, "rad")}, tail_in_wake=chosen) for chosen in (False, True))
    hub = on.values().hub_height
    for speed, height, differs in ((0.0, 0.0, False), (12.0, 0.0, True), (12.0, hub, False)):
        state = [*STATE[:3], speed, *STATE[4:]]
        placed = [v.with_values({"tail_height": height}) for v in (off, on)]
        alone, swept = (np.array(v.rates(state, CONTROLS, v.values())) for v in placed)
        assert bool(np.max(np.abs(alone - swept)) > 1e-3) is differs
    with pytest.raises(SwashError, match="tail rotors in the main rotor's wake have no closed-form build-up"):
        build_up(on, np.array(STATE), np.array(CONTROLS), environment_of(on))
