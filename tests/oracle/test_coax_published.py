"""The CoaX's published and hand-derived numbers: hover, bench torque, modes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from swashplate.errors import TrimError
from swashplate.models.catalogue import vehicle
from swashplate.physics import rotor
from swashplate.physics.backend import FloatBackend
from swashplate.physics.environment import LABORATORY_GRAVITY
from swashplate.physics.rotor import TipPathPlane
from swashplate.simulation.linearize import linearize
from swashplate.simulation.trim import trim


@pytest.mark.parametrize(
    ("voltage", "lower", "upper"), [(12.22, 0.5526, 0.5386), (11.1, 0.587, 0.574), (10.5, 0.606, 0.594)]
)
def test_hover_inputs_lie_in_the_papers_band(voltage: float, lower: float, upper: float) -> None:
    """Fankhauser et al., Fig. 9: 0.55 to 0.75."""
    commands = trim(vehicle("coax"), voltage=voltage).commands()
    assert commands["motor_lower"] == pytest.approx(lower, abs=1e-3)
    assert commands["motor_upper"] == pytest.approx(upper, abs=1e-3)


def test_hover_speeds_are_the_closed_form() -> None:
    """Omega_lw^2 = m g / (kT_lw + kT_up kQ_lw / kQ_up): thrusts carry the weight, torques balance."""
    coax = vehicle("coax")
    card = coax.card.values()
    ratio = card["k_torque_lower"] / card["k_torque_upper"]
    squared = card["mass"] * LABORATORY_GRAVITY / (card["k_thrust_lower"] + card["k_thrust_upper"] * ratio)
    hover = trim(coax)
    assert hover.states()["omega_lower"] == pytest.approx(math.sqrt(squared), rel=1e-12)
    assert hover.states()["omega_upper"] == pytest.approx(math.sqrt(squared * ratio), rel=1e-12)
    assert hover.states()["omega_lower"] == pytest.approx(238.97, abs=0.01)
    assert hover.states()["omega_upper"] == pytest.approx(226.71, abs=0.01)
    thrusts = [card[f"k_thrust_{side}"] * hover.states()[f"omega_{side}"] ** 2 for side in ("lower", "upper")]
    assert thrusts == pytest.approx([1.801, 1.162], abs=1e-3)


def test_torque_of_the_tilted_lower_rotor_splits_as_in_figure_6() -> None:
    """At 6 deg: 44.8 N mm from flapping and 19.4 N mm from the tilted thrust (read off the figure: about 70)."""
    coax = vehicle("coax")
    card, hover, xp = coax.card.values(), trim(coax).states(), FloatBackend()
    plane = TipPathPlane(math.radians(6.0), 0.0)
    thrust = rotor.thrust(card["k_thrust_lower"], hover["omega_lower"], 1.0)
    tilted = rotor.thrust_moment(rotor.thrust_direction(plane, xp).scaled(thrust), card["hub_height_lower"])
    flapping = rotor.flapping_moment(card["hub_stiffness_lower"], plane)
    assert flapping.x * 1e3 == pytest.approx(44.8, abs=0.05)
    assert tilted.x * 1e3 == pytest.approx(19.4, abs=0.05)
    assert (flapping.x + tilted.x) * 1e3 == pytest.approx(64.2, abs=0.05)


def _sorted(values: np.ndarray) -> np.ndarray:
    """By modulus, the integrators at the origin (rounding's root of a Jordan block) left out."""
    moving = values[np.abs(values) > 1e-3]
    return moving[np.lexsort((moving.imag, np.round(moving.real, 6)))]


def test_hover_eigenvalues() -> None:
    model = linearize(vehicle("coax"))
    expected = [-12.5, -12.5, -8.696, -5.405, -0.872 - 9.99j, -0.872 + 9.99j, 0.247 - 9.99j, 0.247 + 9.99j]
    assert _sorted(np.linalg.eigvals(model.A)) == pytest.approx(np.array(expected), abs=0.005)
    assert len(model.states) == 18


def test_hover_eigenvalues_of_an_aligned_bar_are_the_hand_calculation() -> None:
    """s (1 + tau s) + tau k = 0 with k = l_up (k_up + T_up z_up) / Ixx, twice."""
    coax = vehicle("coax").with_values({"k_zeta_upper": 0.0, "o_zeta_upper": 0.0})
    card, tau = coax.card.values(), coax.card.values()["tau_f_upper"]
    thrust = card["k_thrust_upper"] * trim(coax).states()["omega_upper"] ** 2
    torque = card["hub_stiffness_upper"] + thrust * card["hub_height_upper"]
    stiffness = card["linkage_upper"] * torque / card["inertia_xx"]
    bar = np.roots([tau, 1.0, tau * stiffness])
    found = _sorted(np.linalg.eigvals(linearize(coax).A))
    np.testing.assert_allclose(found[4:], _sorted(np.array([*bar, *bar])), atol=1e-5)
    assert found[4].real == pytest.approx(-0.3125, abs=1e-6)


def test_without_the_bar_nothing_restores_the_attitude() -> None:
    model = linearize(vehicle("coax", bar=False))
    assert len(model.states) == 16
    np.testing.assert_allclose(_sorted(np.linalg.eigvals(model.A)), [-12.5, -12.5, -8.6957, -5.4054], atol=1e-4)


def test_payload_raises_rotor_speed_and_with_it_the_phase_lag() -> None:
    """The on-board computer weighs 31 g; (12) and (21) turn the speed into lag."""
    bare, loaded = vehicle("coax"), vehicle("coax").with_values({"mass": 0.333})
    card = bare.card.values()
    light, heavy = trim(bare).states()["omega_upper"], trim(loaded).states()["omega_upper"]
    assert heavy / light == pytest.approx(math.sqrt(0.333 / card["mass"]), rel=1e-12)
    lags = [math.degrees(card["k_zeta_upper"] * speed + card["o_zeta_upper"]) for speed in (light, heavy)]
    assert lags[0] == pytest.approx(6.4, abs=0.02)
    assert lags[1] - lags[0] == pytest.approx(math.degrees(card["k_zeta_upper"] * (heavy - light)), rel=1e-9)
    assert lags[1] > lags[0] + 0.8


def test_a_trim_names_the_limit_that_stops_it() -> None:
    with pytest.raises(TrimError, match=r"motor_lower = 1\.\d+, but its limit is 1"):
        trim(vehicle("coax").with_values({"mass": 1.2}))
    with pytest.raises(TrimError, match=r"servo_pitch = 1\.\d+, but its limit is 1"):
        trim(vehicle("coax"), speed=3.5)
    with pytest.raises(TrimError, match=r"30 m/s ahead.* needs servo_\w+ = \d+\.\d+, but its limit is 1"):
        trim(vehicle("coax"), speed=30.0)
