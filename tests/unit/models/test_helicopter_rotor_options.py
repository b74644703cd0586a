"""Tip loss, uneven induced power and ground effect of single-rotor helicopters; power verdicts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import CardError
from swashplate.models.catalogue import from_card, vehicle
from swashplate.models.conventional.helicopter import HelicopterLoads, loads
from swashplate.models.nesting import rebuild
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.physics.environment import Environment
from swashplate.simulation.trim_curve import TrimCurve

XP = FloatBackend()
CALM = Environment(air_density=1.225)


def acting(flown: Vehicle, x: np.ndarray, u: np.ndarray) -> HelicopterLoads:
    state = rebuild(flown.state, [float(value) for value in x])
    return loads(state, flown.inputs(*map(float, u)), flown.values(), CALM, XP, options=flown.options)


@pytest.fixture(scope="module")
def hover() -> sp.Trim:
    return sp.trim(vehicle("raptor50"))


def at_hover(hover: sp.Trim, height: float = 10.0, **options: object) -> tuple[float, float]:
    """Lift [N] and shaft power [W] at the plain hover's controls."""
    row = np.array(hover.state)
    row[2] = -height
    found = acting(vehicle("raptor50", **options), row, hover.inputs)
    return -found.main_rotor.force.z, float(found.power)


def test_tip_loss_and_cutout_take_thrust(hover: sp.Trim) -> None:
    """At the same collective 5 to 8 %: blade elements and momentum, written here for a rotor that hovers."""
    whole, ends = at_hover(hover)[0], at_hover(hover, tip_loss=True)[0]
    assert 0.05 < 1.0 - ends / whole < 0.08
    p, theta = vehicle("raptor50").values(), hover.commands()["theta0"]

    def thrust(tip: float, root: float) -> float:
        sigma = p.rotor_blades * p.rotor_chord / (math.pi * p.rotor_radius)
        k = 0.5 * p.rotor_lift_slope * sigma
        pitch = theta * (tip**3 - root**3) / 3.0 + p.rotor_twist * (tip**4 - root**4) / 4.0
        m1 = 0.5 * (tip**2 - root**2)
        lam = (-k * m1 + math.sqrt((k * m1) ** 2 + 8.0 * k * pitch)) / 4.0  # 2 lam^2 = k (pitch - m1 lam)
        return 2.0 * lam * lam

    assert ends / whole == pytest.approx(thrust(0.97, 0.15) / thrust(1.0, 0.0), abs=2e-3)


def test_uneven_inflow_takes_power_and_no_thrust(hover: sp.Trim) -> None:
    plain, uneven = at_hover(hover), at_hover(hover, induced_factor=True)
    assert uneven[0] == pytest.approx(plain[0], rel=1e-12)
    p = vehicle("raptor50").values()
    area = math.pi * p.rotor_radius**2
    ideal = plain[0] ** 1.5 / math.sqrt(2.0 * CALM.air_density * area)
    assert uneven[1] - plain[1] == pytest.approx(0.15 * ideal, rel=5e-3)
    assert 0.05 < uneven[1] / plain[1] - 1.0 < 0.11


@pytest.mark.parametrize("form", ["cheeseman-bennett", "hayden"])
@pytest.mark.parametrize("inflow", ["glauert", "pitt-peters"])
def test_ground_makes_lift_where_it_is_near(hover: sp.Trim, form: str, inflow: str) -> None:
    plain = vehicle("raptor50", inflow=inflow)
    row = np.concatenate([hover.state, [0.03, 0.0, 0.0] if inflow == "pitt-peters" else []])
    lift = {}
    for name, height in (("far", 30.0), ("near", 0.3)):
        row[2] = -height
        free, felt = (
            -acting(one, row, hover.inputs).main_rotor.force.z
            for one in (plain, vehicle("raptor50", inflow=inflow, ground_effect=form))
        )
        lift[name] = felt / free
    assert lift["far"] == pytest.approx(1.0, abs=1e-3)
    assert 1.03 < lift["near"] < 1.25


@pytest.mark.parametrize("form", ["cheeseman-bennett", "hayden"])
def test_ground_effect_fades_with_speed(hover: sp.Trim, form: str) -> None:
    p = vehicle("raptor50").values()
    height = 0.8 * p.rotor_radius - p.hub_height  # of the CG, with the hub at 0.8 R
    gains = []
    for speed in (0.0, 4.0, 20.0):
        row = np.array(hover.state)
        row[2:4] = -height, speed
        free, felt = (
            -acting(one, row, hover.inputs).main_rotor.force.z
            for one in (vehicle("raptor50"), vehicle("raptor50", ground_effect=form))
        )
        gains.append(felt / free - 1.0)
    assert gains[0] > 1.5 * gains[1] > 0.0
    assert 0.0 < gains[2] < 0.1 * gains[0]


@pytest.mark.parametrize("options", [{"tip_loss": True}, {"induced_factor": True}, {"ground_effect": "hayden"}])
def test_a_mirrored_helicopter_does_the_same(options: dict[str, object]) -> None:
    right = vehicle("raptor50", rotation="cw", **options)
    left = vehicle("raptor50", rotation="ccw", **options)
    left = left.with_values({"hub_y": -right.card.values()["hub_y"]})
    mirror = {"y", "v", "phi", "psi", "p", "r", "b1"}
    signs = np.array([-1.0 if name in mirror else 1.0 for name in right.state_names])
    x = np.array([0.0, 0.0, -0.5, 3.0, 1.0, 0.3, 0.05, -0.04, 0.2, 0.1, -0.2, 0.3, 0.02, -0.01])
    u, turned = np.array([0.1, 0.01, 0.02, 0.15]), np.array([0.1, 0.01, -0.02, 0.15])
    rates = np.array(right.rates(x, u, right.values()))
    other = np.array(left.rates(signs * x, turned, left.values()))
    np.testing.assert_allclose(other, signs * rates, rtol=1e-11, atol=1e-11)


def test_more_power_than_the_engine_has_is_said(hover: sp.Trim) -> None:
    weak = vehicle("raptor50").with_values({"engine_power": 400.0})
    assert TrimCurve(vehicle("raptor50"), (hover,)).remarks == ()
    (words,) = TrimCurve(weak, (hover,)).remarks
    assert "need 4" in words
    assert "engine_power on the card is 400 W: not to be held" in words


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(CardError, match="ground_effect: is 'true', expected one of 'none'"):
        vehicle("raptor50", ground_effect="true")
    card = vehicle("raptor50").card
    for name, value in (("rotor_tip_loss", 1.2), ("rotor_root_cutout", 0.9), ("rotor_induced_factor", 0.8)):
        wrong = replace(card, parameters={**card.parameters, name: replace(card.parameters[name], value=value)})
        with pytest.raises(CardError, match=r"rotor_(tip_loss|induced_factor): is"):
            from_card(wrong)


def test_usual_numbers_are_marked_as_assumed() -> None:
    flown = vehicle("raptor50", tip_loss=True, induced_factor=True)
    for name, value in (("rotor_tip_loss", 0.97), ("rotor_root_cutout", 0.15), ("rotor_induced_factor", 1.15)):
        entry = flown.card.parameters[name]
        assert (entry.value, entry.status) == (value, "assumed")
        assert "older than this parameter" in entry.source
