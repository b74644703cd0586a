"""Tables of derivatives: build-up against automatic differentiation, units, contributors."""

from __future__ import annotations

import numpy as np
import pytest

from hand_buildup import build_up
from swashplate.errors import SwashError
from swashplate.models.catalogue import vehicle
from swashplate.models.conventional.derivative_table import MOTIONS, ROWS, factor_to_feet, split_name, unit
from swashplate.physics.environment import Environment
from swashplate.simulation.derivatives import derivative_table
from swashplate.simulation.linearize import linearize
from swashplate.simulation.trim import trim

AIR = Environment(air_density=1.225)
COURSES = [{"speed": float(v)} for v in range(0, 21, 4)] + [
    {"climb": 2.0},
    {"climb": -3.0, "speed": 1.0},
    {"speed": 10.0, "turn": 0.4},
    {"lateral": 5.0},
]


@pytest.mark.parametrize("name", ["raptor50", "xcell60", "helion", "rmax"])
@pytest.mark.parametrize("course", COURSES, ids=str)
def test_build_up_is_automatic_differentiation(name: str, course: dict[str, float]) -> None:
    """Contributor by contributor, from hover to 20 m/s, climbing, sinking, turning and sideways: to rounding."""
    flown = vehicle(name)
    at = trim(flown, environment=AIR, **course)
    exact, closed = derivative_table(flown, at), build_up(flown, at.state, at.inputs, AIR)
    assert set(closed.parts) == set(exact.parts)
    for part, block in closed.parts.items():
        np.testing.assert_allclose(block, exact.parts[part], rtol=1e-10, atol=1e-10, err_msg=part)
    np.testing.assert_allclose(closed.flapping, exact.flapping, rtol=1e-10, atol=1e-12)


FORMS = [
    pytest.param(
        {"in_plane": "thrust-tilt", "inflow": "uniform", "bar": True, "yaw_at_hub": False},
        {"speed": 12.0},
        marks=pytest.mark.proof,
    ),
    pytest.param(
        {"yaw_at_blades": True, "precession_torque": True}, {"speed": 15.0, "turn": 0.3}, marks=pytest.mark.proof
    ),
    ({"yaw_at_blades": True, "coning": False, "in_plane": "thrust-tilt", "rotation": "cw"}, {"speed": 25.0}),
]


@pytest.mark.parametrize(("options", "course"), FORMS, ids=str)
def test_build_up_of_the_other_forms(options: dict[str, object], course: dict[str, float]) -> None:
    """A card without a zero: coning, shaft tilt, hinge offset, phasing, tail cant and twist, incidences, fuselage."""
    flown = vehicle("lynx", **options).with_values(
        {
            "cyclic_phase": 0.1,
            "wake_distortion": 1.2,
            "bar_gain": 0.5,
            "hinge_offset": 0.04,
            "precone": 0.03,
            "tail_cant": 0.3,
            "tail_twist": -0.1,
            "tail_flap_frequency": 1.03,
            "tailplane_incidence": -0.03,
            "tailplane_drop": 0.8,
            "tailplane_wake": 1.2,
            "fuselage_wake": 0.7,
            "fin_incidence": 0.05,
            "fin_wake": 0.5,
            "fuselage_area_x": 1.0,
            "fuselage_area_y": 4.0,
            "fuselage_area_z": 3.0,
            "fuselage_pitch_volume": 20.0,
            "fuselage_yaw_volume": 25.0,
            "fuselage_pitch_zero": -1.0,
        }
    )
    at = trim(flown, environment=AIR, **course)
    exact, closed = derivative_table(flown, at), build_up(flown, at.state, at.inputs, AIR)
    for part, block in closed.parts.items():
        np.testing.assert_allclose(block, exact.parts[part], rtol=1e-9, atol=1e-9, err_msg=part)
    np.testing.assert_allclose(closed.flapping, exact.flapping, rtol=1e-9, atol=1e-12)


def test_build_up_where_the_wake_is_too_slow_for_the_disc() -> None:
    """A hub so stiff that K_R has faded, in a turn, where its own change counts."""
    flown = vehicle("lynx", yaw_at_blades=True).with_values({"wake_distortion": 1.2, "hub_stiffness": 5e6})
    at = trim(flown, environment=AIR, speed=5.0, climb=1.0, turn=0.3)
    exact, closed = derivative_table(flown, at), build_up(flown, at.state, at.inputs, AIR)
    for part, block in closed.parts.items():
        np.testing.assert_allclose(block, exact.parts[part], rtol=1e-9, atol=1e-9, err_msg=part)
    np.testing.assert_allclose(closed.flapping, exact.flapping, rtol=1e-9, atol=1e-12)


def test_the_table_is_the_residualised_linear_model() -> None:
    """A of eq. 13: derivatives plus kinematics, once the disc follows without delay."""
    flown = vehicle("raptor50")
    at = trim(flown, environment=AIR, speed=8.0)
    model, found = linearize(flown, at), derivative_table(flown, at)
    slow = [flown.index(name) for name in MOTIONS]
    fast = [flown.index(name) for name in ("a1", "b1")]
    A = model.A
    reduced = A[np.ix_(slow, slow)] - A[np.ix_(slow, fast)] @ np.linalg.solve(
        A[np.ix_(fast, fast)], A[np.ix_(fast, slow)]
    )
    u, v, w = (at.states()[name] for name in ("u", "v", "w"))
    turning = np.zeros((6, 6))
    turning[:3, 3:] = [[0.0, -w, v], [w, 0.0, -u], [-v, u, 0.0]]
    aerodynamic = found.total[[0, 1, 2, 3, 4, 5], :6]
    np.testing.assert_allclose(reduced, aerodynamic + turning, atol=1e-9)


def test_wake_distortion_turns_the_off_axis_derivatives_round() -> None:
    """L_q and M_p change their sign near K_R = 1; L_p and M_q change by less than 5 % (as measured helicopters do)."""
    tables = {}
    for k_r in (0.0, 2.0):
        flown = vehicle("raptor50").with_values({"wake_distortion": k_r})
        tables[k_r] = derivative_table(flown, trim(flown, environment=AIR))
    for name in ("Lq", "Mp"):
        assert tables[0.0][name] * tables[2.0][name] < 0.0
    for name in ("Lp", "Mq"):
        assert tables[2.0][name] == pytest.approx(tables[0.0][name], rel=0.05)


def test_names_units_and_feet() -> None:
    assert split_name("Mu") == (ROWS.index("M"), 0)
    assert [unit(n) for n in ("Xu", "Xq", "Mu", "Mq", "ZB1", "Ltheta0T")] == [
        "1/s",
        "m/s",
        "1/(m s)",
        "1/s",
        "m/s^2/rad",
        "1/s^2/rad",
    ]
    assert unit("Mu", imperial=True) == "1/(ft s)"
    assert factor_to_feet(*split_name("Xu")) == pytest.approx(1.0)
    assert factor_to_feet(*split_name("Mu")) == pytest.approx(0.3048)
    assert factor_to_feet(*split_name("Xtheta0")) == pytest.approx(1.0 / 0.3048)
    with pytest.raises(SwashError, match="is no derivative"):
        split_name("Qu")


def test_vehicles_and_options_without_a_build_up() -> None:
    coax = vehicle("coax")
    hover = trim(coax)
    with pytest.raises(SwashError, match="needs a single-rotor card"):
        build_up(coax, hover.state, hover.inputs, AIR)
    with pytest.raises(SwashError, match="needs a single-rotor card"):
        derivative_table(coax, hover)
    dynamic = vehicle("raptor50", inflow="pitt-peters")
    x = np.array([0.0] * len(dynamic.state_names))
    with pytest.raises(SwashError, match="no closed-form build-up"):
        build_up(dynamic, x, np.zeros(4), AIR)
