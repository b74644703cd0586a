"""Single components against what mechanics says of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swashplate.models.coax import SENSE_LOWER, SENSE_UPPER
from swashplate.physics import rotor
from swashplate.physics.backend import FloatBackend
from swashplate.physics.frames import Euler, Vector, body_to_local, local_to_body
from swashplate.physics.fuselage import cross_flow_loads, flat_plate_drag, slender_body_moment
from swashplate.physics.rigid_body import Inertia, RigidBody, gravity, rigid_body_rates
from swashplate.physics.rotor import TipPathPlane
from swashplate.physics.stabilizer_bar import StabilizerBar, upper_tip_path_plane
from swashplate.physics.swashplate import swashplate_tilt

XP = FloatBackend()
ANGLE = st.floats(-1.4, 1.4)
NUMBER = st.floats(-3.0, 3.0)
VECTOR = st.builds(Vector, NUMBER, NUMBER, NUMBER)
ATTITUDE = st.builds(Euler, ANGLE, ANGLE, st.floats(-4.0, 4.0))
BODY = st.builds(RigidBody, *[NUMBER] * 6, ANGLE, ANGLE, ANGLE, NUMBER, NUMBER, NUMBER)
few = settings(max_examples=50, deadline=None)


def dot(a: Vector, b: Vector) -> float:
    return float(a.x * b.x + a.y * b.y + a.z * b.z)


@few
@given(VECTOR, ATTITUDE)
def test_rotating_there_and_back_changes_nothing(vector: Vector, attitude: Euler) -> None:
    there = body_to_local(vector, attitude, XP)
    assert dot(there, there) == pytest.approx(dot(vector, vector), abs=1e-12)
    assert local_to_body(there, attitude, XP) == pytest.approx(vector, abs=1e-12)


@few
@given(BODY, VECTOR, VECTOR)
def test_energy_changes_by_the_work_of_the_loads(body: RigidBody, force: Vector, moment: Vector) -> None:
    """d/dt (m v^2 + w I w - 2 m g z) / 2 = F v + M w, with the weight's work counted as height."""
    inertia, g = Inertia(0.3, 1.8e-3, 2.1e-3, 0.3e-3), 9.81
    weight = gravity(inertia.mass, g, body.attitude, XP)
    rates = rigid_body_rates(body, force + weight, moment, inertia, XP)
    kinetic = inertia.mass * dot(body.velocity, rates.velocity)
    turning = sum(i * w * a for i, w, a in zip(inertia[1:4], body.rates, rates.rates, strict=True))
    power = dot(force, body.velocity) + dot(moment, body.rates)
    assert kinetic + turning - inertia.mass * g * rates.z == pytest.approx(power, abs=1e-10)


@few
@given(BODY)
def test_angular_momentum_of_a_free_body_stays_in_space(body: RigidBody) -> None:
    """dh/dt in body axes is -w x h, whatever the inertias."""
    inertia, nothing = Inertia(0.3, 1.8e-3, 2.1e-3, 0.3e-3), Vector(0.0, 0.0, 0.0)
    rates = rigid_body_rates(body, nothing, nothing, inertia, XP).rates
    h = Vector(*(i * w for i, w in zip(inertia[1:4], body.rates, strict=True)))
    change = Vector(*(i * a for i, a in zip(inertia[1:4], rates, strict=True)))
    assert change == pytest.approx(body.rates.cross(h).scaled(-1.0), abs=1e-12)


@few
@given(ANGLE, ANGLE)
def test_thrust_direction_is_a_unit_vector_upwards(alpha: float, beta: float) -> None:
    n = rotor.thrust_direction(TipPathPlane(alpha, beta), XP)
    assert dot(n, n) == pytest.approx(1.0, abs=1e-14)
    assert n.z < 0.0


def test_thrust_moment_is_the_cross_product() -> None:
    force, height = Vector(0.3, -0.2, -1.8), 0.103
    assert rotor.thrust_moment(force, height) == pytest.approx(Vector(0.0, 0.0, -height).cross(force), abs=1e-15)


def test_a_rotor_that_spins_up_turns_the_fuselage_against_its_sense() -> None:
    assert rotor.yaw_moment(0.05, 1e-4, 10.0, SENSE_LOWER).z < 0.0 < rotor.yaw_moment(0.05, 1e-4, 10.0, SENSE_UPPER).z


def test_gyroscopic_moment_does_no_work() -> None:
    rates = Vector(0.7, -0.4, 0.2)
    assert dot(rotor.gyroscopic_moment(rates, 1e-4, 230.0, SENSE_LOWER), rates) == pytest.approx(0.0, abs=1e-16)


def turned(vector: tuple[float, float], angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]]) @ np.array(vector)


@few
@given(NUMBER, NUMBER, ANGLE)
def test_lower_phase_lag_turns_the_tilt_in_the_rotors_sense(roll: float, pitch: float, lag: float) -> None:
    """R(s D) applied to l (s1, -s2), s_lw = +1."""
    found = swashplate_tilt(roll, pitch, linkage=0.135, lag=lag, mixing="rotation", xp=XP)
    np.testing.assert_allclose(found, 0.135 * turned((roll, -pitch), SENSE_LOWER * lag), atol=1e-14)


@few
@given(NUMBER, NUMBER, ANGLE)
def test_upper_phase_lag_turns_the_tilt_in_the_rotors_sense(eta: float, zeta: float, lag: float) -> None:
    """R(s D) applied to l (eta - phi, zeta - theta), s_up = -1."""
    attitude = Euler(0.1, -0.2, 0.3)
    found = upper_tip_path_plane(StabilizerBar(eta, zeta), attitude, linkage=0.6, lag=lag, mixing="rotation", xp=XP)
    relative = (eta - attitude.phi, zeta - attitude.theta)
    np.testing.assert_allclose(found, 0.6 * turned(relative, SENSE_UPPER * lag), atol=1e-14)


def test_the_printed_mixing_is_no_rotation() -> None:
    """Determinant -cos(2 D): singular at 45 deg, where a rotation of a reflected pair has -1."""
    lag = math.radians(30.0)
    columns = [
        swashplate_tilt(*servos, linkage=1.0, lag=lag, mixing="as_printed", xp=XP)
        for servos in ((1.0, 0.0), (0.0, 1.0))
    ]
    assert np.linalg.det(np.array(columns).T) == pytest.approx(-math.cos(2.0 * lag), abs=1e-14)


def test_newton_finds_a_square_root() -> None:
    found = FloatBackend().newton(lambda x: (x * x - 2.0, 2.0 * x), 1.0, steps=6)
    assert found == pytest.approx(math.sqrt(2.0), abs=1e-15)


@few
@given(BODY)
def test_a_product_of_inertia_keeps_energy_and_angular_momentum(body: RigidBody) -> None:
    """Without loads: d/dt (w I w / 2) = 0 and h' + w x h = 0 with the full inertia matrix (eqs 4 to 6 of Bhandari)."""
    inertia = Inertia(2.0, 0.3, 0.7, 0.8, 0.1)
    matrix = np.array([[0.3, 0.0, -0.1], [0.0, 0.7, 0.0], [-0.1, 0.0, 0.8]])
    zero = Vector(0.0, 0.0, 0.0)
    moving = rigid_body_rates(body, zero, zero, inertia, FloatBackend())
    rates, change = np.array(body.rates), np.array(moving.rates)
    np.testing.assert_allclose(matrix @ change + np.cross(rates, matrix @ rates), 0.0, atol=1e-9)


@few
@given(VECTOR)
def test_air_turns_a_slender_body_across_its_way(air: Vector) -> None:
    """Munk's moment of an ideal fluid: V x (rho V_body K V) with a diagonal K, so it has no part along the air."""
    k = (1.0, 3.0, 4.0)
    moment = slender_body_moment(
        air, 0.0, pitch=2.0 * (k[2] - k[0]), yaw=2.0 * (k[1] - k[0]), pitch_zero=0.0, density=1.2
    )
    whole = 1.2 * np.cross(np.array(k) * np.array(air), np.array(air))
    np.testing.assert_allclose((moment.y, moment.z), whole[1:], rtol=1e-12, atol=1e-9)


def test_a_fuselage_in_cross_flow_is_pushed_the_airs_way() -> None:
    """Ahead it is the plates and Munk's moment to first order; in air across it a drag along the air, and no moment."""
    areas, volumes = Vector(1.0, 4.0, 2.5), {"pitch": 22.0, "yaw": 17.0, "pitch_zero": -2.0}

    def loads(air: Vector, downwash: float) -> tuple[Vector, Vector]:
        return cross_flow_loads(air, downwash, areas=areas, density=1.2, xp=FloatBackend(), **volumes)

    ahead = Vector(50.0, 0.05, -0.05)
    force, moment = loads(ahead, 0.0)
    plates = flat_plate_drag(ahead, 0.0, areas=areas, density=1.2, xp=FloatBackend())
    np.testing.assert_allclose(force, plates, rtol=1e-5)
    np.testing.assert_allclose(moment, slender_body_moment(ahead, 0.0, density=1.2, **volumes), rtol=1e-5)

    force, moment = loads(Vector(0.0, 3.0, 1.0), 10.0)
    speed = math.hypot(3.0, 9.0)
    np.testing.assert_allclose(force, [0.0, -0.6 * 2.5 * speed * 3.0, 0.6 * 2.5 * speed * 9.0], rtol=1e-9)
    assert moment == Vector(0.0, 0.0, 0.0)
    creeping = Vector(0.01, 0.0, 0.0)
    munk = slender_body_moment(creeping, 10.0, density=1.2, **volumes)
    assert abs(loads(creeping, 10.0)[1].y) < 1e-3 * abs(munk.y), "no M_u in the downwash of a hover"
