"""The decoupling against the lower rotor's own equations, its lags, its limits and its bad input."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from swashplate.control.laws.decoupling import decouple, decoupler, estimated_lag, fit_into_limits
from swashplate.errors import SwashError
from swashplate.models.catalogue import vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend
from swashplate.simulation.trim import trim

XP = FloatBackend()
ON_AXIS = {f"a_{angle}{linear}": 0.0 for angle in ("alpha_v", "beta_u") for linear in ("", "_linear")}
LIMITS = {"lower": (-1.0, -1.0), "upper": (1.0, 1.0)}


def identified(seed: int, mixing: str) -> Vehicle:
    """A card with other numbers, as an identification would give."""
    random = np.random.default_rng(seed)
    coax = vehicle("coax", mixing=mixing)
    names = ("linkage_lower", "k_zeta_lower", "o_zeta_lower", "a_alpha_u", "a_beta_v", "k_drive_lower", "mass")
    changed = {name: coax.card.values()[name] * random.uniform(0.7, 1.3) for name in names}
    changed |= {"a_alpha_u_linear": random.normal(0.0, 0.01), "a_beta_v_linear": random.normal(0.0, 0.01)}
    return coax.with_values(changed, status="identified", source="a test")


def steady_tilt(
    aircraft: Vehicle, servos: tuple[float, float], u: float, v: float, omega: float
) -> tuple[float, float]:
    """Where the vehicle's own derivatives bring the lower disc to rest (their bracket is linear in the disc's tilt)."""
    row = np.zeros(len(aircraft.state_names))
    row[[aircraft.index(name) for name in ("u", "v", "omega_lower", "omega_upper")]] = u, v, omega, 226.0
    env = trim(vehicle("coax")).environment
    rates = aircraft.rates(row, (0.5, 0.5, *servos), aircraft.values(), env, XP)
    tau = aircraft.card.values()["tau_f_lower"]
    return tau * rates[aircraft.index("alpha_lower")], tau * rates[aircraft.index("beta_lower")]


@pytest.mark.parametrize("mixing", ["rotation", "as_printed"])
@pytest.mark.parametrize("seed", range(5))
def test_it_inverts_the_models_own_lower_rotor(seed: int, mixing: str) -> None:
    aircraft = identified(seed, mixing)
    card = aircraft.card.values()
    law = decoupler(aircraft, trim(aircraft, voltage=11.5), lag="battery")
    roll, pitch, u, v, motor, voltage = 0.2, -0.3, 1.4, -0.8, 0.55, 11.3
    omega = card["k_drive_lower"] * motor + card["o_drive_lower"]
    omega += card["k_drive_voltage"] * (voltage - card["voltage_nominal"])
    servos = decouple(law, roll, pitch, u=u, v=v, motor_lower=motor, voltage=voltage, xp=XP)
    only_across = aircraft.with_values(ON_AXIS)
    alpha, beta = steady_tilt(only_across, servos, u, v, omega)
    assert alpha == pytest.approx(card["linkage_lower"] * roll, rel=1e-12)
    assert beta == pytest.approx(-card["linkage_lower"] * pitch, rel=1e-12)


def test_the_printed_law_is_the_papers_implicit_pair() -> None:
    """(19) and (20) as printed, with the transformed inputs on the right solved by iteration."""
    aircraft = identified(3, "as_printed")
    law = decoupler(aircraft, trim(aircraft), lag="hover")
    d, length = law.o_zeta, law.linkage
    u, v, roll, pitch = 1.2, 0.7, 0.3, 0.1
    first = second = 0.0
    for _ in range(500):
        across_u = (law.across_u * u * abs(u) + law.across_u_linear * u) / length
        across_v = (law.across_v * v * abs(v) + law.across_v_linear * v) / length
        first = (roll + second * math.sin(d) + across_u) / math.cos(d)
        second = (pitch + first * math.sin(d) - across_v) / math.cos(d)
    found = decouple(law, roll, pitch, u=u, v=v, motor_lower=0.9, voltage=10.0, xp=XP)
    np.testing.assert_allclose(found, (first, second), rtol=1e-12)


def test_a_law_of_the_other_form_steers_across() -> None:
    aircraft = vehicle("coax").with_values({**ON_AXIS})
    hover = trim(aircraft)
    omega = hover.states()["omega_lower"]
    wrong = decoupler(aircraft, hover, lag="hover", mixing="as_printed")
    servos = decouple(wrong, 0.0, 0.2, u=0.0, v=0.0, motor_lower=0.55, voltage=12.22, xp=XP)
    alpha, beta = steady_tilt(aircraft, servos, 0.0, 0.0, omega)
    # (0, -s) through the inverse of [[c, -s], [s, -c]] and then through [[c, s], [s, -c]]: tan 2D of it goes across.
    assert abs(alpha / beta) == pytest.approx(math.tan(2.0 * wrong.o_zeta), rel=1e-9)
    assert abs(alpha / beta) > 0.6


def test_lags_from_constant_motor_and_battery() -> None:
    coax = vehicle("coax")
    full, low = trim(coax, voltage=12.22), trim(coax, voltage=10.8)
    omega = full.states()["omega_lower"]
    assert low.states()["omega_lower"] == pytest.approx(omega)
    card = coax.card.values()
    true = card["k_zeta_lower"] * omega + card["o_zeta_lower"]
    assert math.degrees(true) == pytest.approx(17.0, abs=0.1)  # Fankhauser's Delta zeta_lw at hover

    def lag(kind: object) -> float:
        law = decoupler(coax, full, lag=kind)  # type: ignore[arg-type]
        return float(estimated_lag(law, low.commands()["motor_lower"], 10.8))

    assert lag("hover") == pytest.approx(true)
    assert lag("battery") == pytest.approx(true)
    # Without the battery the empty battery's higher command reads as speed: k_zeta k_voltage times the missing volts.
    assert lag("motor") - true == pytest.approx(card["k_zeta_lower"] * card["k_drive_voltage"] * 1.42, rel=1e-9)
    assert lag(0.3) == 0.3


def test_a_payload_moves_the_lag_through_the_hover_speed() -> None:
    coax = vehicle("coax")
    loaded = coax.with_values({"mass": 0.402})
    hover = trim(loaded)
    by_card = decoupler(loaded, hover, lag="hover")
    by_motor = decoupler(coax, trim(coax), lag="battery")  # does not know the payload, sees the motor work
    assert math.degrees(by_card.o_zeta) == pytest.approx(19.7, abs=0.1)
    assert estimated_lag(by_motor, hover.commands()["motor_lower"], 12.22) == pytest.approx(by_card.o_zeta)


def test_saturation_keeps_the_direction_and_the_held_part() -> None:
    held, added = np.array([0.3, -0.2]), np.array([1.2, 0.6])
    wanted = tuple(held + added)
    servos = fit_into_limits(wanted, tuple(held), **LIMITS, xp=XP)  # type: ignore[arg-type]
    assert servos.roll == pytest.approx(1.0)
    assert 0.0 < servos.kept < 1.0
    given = np.array(servos[:2]) - held
    assert given[1] / given[0] == pytest.approx(added[1] / added[0])
    clipped = np.clip(wanted, -1.0, 1.0) - held  # what clipping each servo would give: another direction
    assert abs(clipped[1] / clipped[0] - added[1] / added[0]) > 0.3
    fits = fit_into_limits((0.5, -0.5), (0.1, 0.1), **LIMITS, xp=XP)  # type: ignore[arg-type]
    assert (*fits,) == pytest.approx((0.5, -0.5, 1.0))
    alone = fit_into_limits((2.5, 1.0), (2.0, 1.0), **LIMITS, xp=XP)  # type: ignore[arg-type]
    assert (*alone,) == pytest.approx((1.0, 0.5, 0.0))


def test_speed_terms_can_be_left_out() -> None:
    coax = vehicle("coax")
    law = decoupler(coax, trim(coax), speed=False)
    assert decouple(law, 0.0, 0.0, u=2.0, v=2.0, motor_lower=0.5, voltage=12.0, xp=XP) == (0.0, 0.0)


def test_bad_input_is_named() -> None:
    coax = vehicle("coax")
    hover = trim(coax)
    with pytest.raises(SwashError, match=r"lag: is 'hoover', expected hover, motor, battery"):
        decoupler(coax, hover, lag="hoover")  # type: ignore[arg-type]
    with pytest.raises(SwashError, match=r"lag: 43\.0 deg; .* no inverse at 45 deg"):
        decoupler(coax, hover, lag=math.radians(43.0), mixing="as_printed")
    with pytest.raises(SwashError, match="linkage_lower: is zero"):
        decoupler(coax.with_values({"linkage_lower": 0.0}), hover)
    poor = replace(coax, card=replace(coax.card, parameters={"mass": coax.card.parameters["mass"]}))
    with pytest.raises(SwashError, match="lacks linkage_lower, k_zeta_lower"):
        decoupler(poor, hover)
