"""Discs of flapping blades on the CoaX: one blade in NumPy, a turned and a mirrored helicopter, torque by speed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swashplate.errors import CardError
from swashplate.models import coax_discs
from swashplate.models.catalogue import vehicle
from swashplate.models.coax_discs import DiscPair, disc_pair
from swashplate.models.coax_rotors import InflowOptions, balanced_hover, rotor_pair
from swashplate.models.coax_vehicle import acting_at
from swashplate.models.nesting import leaves
from swashplate.models.surroundings import environment_of
from swashplate.physics.backend import FloatBackend
from swashplate.physics.frames import Vector
from swashplate.physics.rotor import TipPathPlane

XP = FloatBackend()
COAX = vehicle("coax", rotor="inflow", flapping="blades")
HOVER = balanced_hover(COAX.values(), COAX.options, XP)
LEVEL = (TipPathPlane(0.0, 0.0), TipPathPlane(0.0, 0.0))


def pair(
    air: tuple[float, float, float] = (0.0, 0.0, 0.0),
    rates: tuple[float, float, float] = (0.0, 0.0, 0.0),
    asked: tuple[TipPathPlane, TipPathPlane] = LEVEL,
    planes: tuple[TipPathPlane, TipPathPlane] | None = None,
    omegas: tuple[float, float] = (HOVER.omega_upper, HOVER.omega_lower),
    **more: Any,
) -> DiscPair:
    par, options = COAX.with_values(more).values(), COAX.options
    own, far = HOVER.induced, (50.0, 50.0)
    return disc_pair(Vector(*air), Vector(*rates), asked, planes, omegas, own, far, par, 1.2, options, XP)


def flown_blade(
    side: int, air: tuple[float, float, float], p: float, q: float, asked: TipPathPlane
) -> tuple[float, float]:
    """alpha, beta of one rotor's disc [rad]: one sprung blade in the rotating frame, by lift at its elements.

    psi counts from aft against the clock from above, and against it for the lower rotor, which is a mirror. Coriolis:
    at the aft blade the roll rate presses the blade up, at the right-hand one the pitch rate presses it down. The wake
    of a tilting moment C is 2 C / V (Pitt and Peters 1981, hover), that of the flight their skew's 15 pi / 64.
    """
    par, sense = COAX.values(), (1.0, -1.0)[side]
    name = ("upper", "lower")[side]
    own = HOVER.induced[side]
    height = (par.hub_height_upper, par.hub_height_lower)[side]
    air = (air[0] - q * height, air[1] + p * height, air[2])
    given, calm = _given(air)[side], _given()[side]
    omega = (HOVER.omega_upper, HOVER.omega_lower)[side]
    tip, R = omega * par.rotor_radius, par.rotor_radius
    mu_x, mu_y = air[0] / tip, sense * air[1] / tip
    p, q, lam0, down = sense * p / omega, q / omega, own / tip, (given - air[2]) / tip
    V = np.sqrt(mu_x**2 + mu_y**2 + (lam0 + down) ** 2)
    flow = (mu_x**2 + mu_y**2 + (lam0 + down) * (2.0 * lam0 + down)) / V
    across = np.hypot(mu_x, mu_y)
    skew = across / (np.hypot(across, lam0 + down) + lam0 + down)
    x, w = np.polynomial.legendre.leggauss(6)
    x = 0.5 * (par.tip_loss - par.root_cutout) * x + 0.5 * (par.tip_loss + par.root_cutout)
    w = 0.5 * (par.tip_loss - par.root_cutout) * w
    lock = 1.2 * par.rotor_lift_slope * par.rotor_chord * R**4 / par.blade_inertia
    lam2 = 1.0 + getattr(par, f"hub_stiffness_{name}") / (par.blade_inertia * omega**2)
    pitch = getattr(par, f"pitch_{name}")
    swash = coax_discs.cyclic_for(asked, omega, calm / HOVER.induced[1 - side], par, name, sense, 1.2, XP)
    A1, B1 = sense * swash[0], swash[1]
    solidity = par.rotor_blades * par.rotor_chord / (np.pi * R)
    psi = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)[:, None]
    c, s = np.cos(psi), np.sin(psi)
    U_T = x + mu_x * s + mu_y * c
    theta = pitch + par.rotor_twist * (x - 0.75) - A1 * c - B1 * s
    along = (mu_x * c - mu_y * s) / across if across else 0.0 * c  # towards the rear of the flight

    def lift(z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Elements' lift at flapping a0, a1, b1 and a wake with gradient c, s."""
        a0, a1, b1, lc, ls = z
        beta, slope = a0 - a1 * c - b1 * s, a1 * s - b1 * c
        U_P = -(lam0 + down) - x * (lc * c + ls * s) + x * (p * s + q * c) - x * slope - beta * (mu_x * c - mu_y * s)
        return U_T * (theta * U_T + U_P), beta, slope

    def unmet(z: np.ndarray) -> np.ndarray:
        """Harmonics of flapping's equation, and the wake's gradient less what moments and flight make of it."""
        elements, beta, _ = lift(z)
        curve = z[1] * c + z[2] * s
        left = curve + lam2 * beta - 2.0 * (p * c - q * s) - 0.5 * lock * np.sum(w * x * elements, axis=1)[:, None]
        moment = 0.5 * solidity * par.rotor_lift_slope * np.sum(w * x * elements, axis=1)[:, None]
        thrust = 2.0 * lam0 * V
        rear = 15.0 * np.pi / 64.0 * thrust / flow * skew * along
        cc, cs, ss = _gains(mu_x, mu_y, across, skew)
        mc, ms = np.mean(moment * c), np.mean(moment * s)
        wake = (cc * mc + cs * ms) / flow, (cs * mc + ss * ms) / flow
        return np.array(
            [
                np.mean(left),
                2.0 * np.mean(left * c),
                2.0 * np.mean(left * s),
                z[3] - 2.0 * np.mean(rear * c) - wake[0],
                z[4] - 2.0 * np.mean(rear * s) - wake[1],
            ]
        )

    z = np.zeros(5)
    for _ in range(3):  # straight in z
        J = np.stack([unmet(z + e) - unmet(z) for e in np.eye(5)], axis=1)
        z = z - np.linalg.solve(J, unmet(z))
    return sense * z[2], z[1]


def _gains(mu_x: float, mu_y: float, across: float, skew: float) -> tuple[float, float, float]:
    """2 (1 - X^2) along the flight and 2 (1 + X^2) across it, turned into the shaft's axes."""
    if not across:
        return 2.0, 0.0, 2.0
    c, s = mu_x / across, -mu_y / across
    ahead, aside = 2.0 * (1.0 - skew**2), 2.0 * (1.0 + skew**2)
    return ahead * c * c + aside * s * s, (ahead - aside) * c * s, ahead * s * s + aside * c * c


def _given(air: tuple[float, ...] = (0.0, 0.0, 0.0)) -> tuple[float, float]:
    """What the discs get of each other's flow [m/s]."""
    across2 = air[0] ** 2 + air[1] ** 2
    return coax_discs.air_between(-air[2], across2, HOVER.induced, COAX.values(), COAX.options, XP)[1]


@pytest.mark.parametrize(
    ("air", "p", "q", "tilt"),
    [
        ((0.0, 0.0, 0.0), 0.5, -0.8, TipPathPlane(0.0, 0.0)),
        ((1.0, 0.0, 0.0), 0.0, 0.0, TipPathPlane(0.0, 0.0)),
        ((-0.7, 0.6, 0.3), 0.4, 0.3, TipPathPlane(0.05, -0.03)),
        ((2.0, -1.5, -0.5), -0.3, 1.0, TipPathPlane(-0.04, 0.06)),
    ],
)
def test_discs_tilt_as_one_flown_blade_does(
    air: tuple[float, float, float], p: float, q: float, tilt: TipPathPlane
) -> None:
    """Settled tilts by rate, speed, climb and cyclic pitch, against the blade's own equation over azimuth and span."""
    found = pair(air, (p, q, 0.0), (tilt, tilt))
    for side in (0, 1):
        # The other disc's share is a mean over both hubs' air, which rates hardly move.
        np.testing.assert_allclose(found.planes[side], flown_blade(side, air, p, q, tilt), rtol=2e-3, atol=2e-5)
        assert max(map(abs, found.turning[side])) < 1e-9


def test_a_bench_sees_the_tilt_that_is_asked_for() -> None:
    """In hover, to what one half of the weight each leaves out of the wake's part: 1 % and 1 deg."""
    asked = TipPathPlane(0.08, -0.03)
    for plane in pair(asked=(asked, asked)).planes:
        miss = complex(*plane) / complex(*asked)
        assert abs(miss) == pytest.approx(1.0, abs=0.01)
        assert abs(np.degrees(np.angle(miss))) < 1.0


def loads_of(found: DiscPair) -> np.ndarray:
    return np.array([*found.acting.force, *found.acting.moment, *found.lift, *found.torque])


def test_a_turned_helicopter_flies_the_same() -> None:
    """Nothing of two discs knows the nose: air, rates and tilts turned about the shaft turn all loads with them."""
    c, s = np.cos(0.7), np.sin(0.7)

    def turned(x: float, y: float) -> tuple[float, float]:
        return c * x - s * y, s * x + c * y

    (u, v), (p, q), tilt = (1.2, -0.4), (0.5, 0.9), (0.05, -0.02)
    # A tilt's thrust leans by (-beta, alpha): tilts turn as (alpha, beta) do about the same axis.
    plain = pair((u, v, -0.3), (p, q, 0.4), (TipPathPlane(*tilt),) * 2)
    other = pair((*turned(u, v), -0.3), (*turned(p, q), 0.4), (TipPathPlane(*turned(*tilt)),) * 2)
    force, moment = plain.acting
    expected = [*turned(force.x, force.y), force.z, *turned(moment.x, moment.y), moment.z, *plain.lift, *plain.torque]
    np.testing.assert_allclose(loads_of(other), expected, rtol=1e-10, atol=1e-12)


def test_a_mirrored_helicopter_flies_the_mirrored_flight(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = pair((1.2, -0.4, -0.3), (0.5, 0.9, 0.4), (TipPathPlane(0.05, -0.02), TipPathPlane(-0.03, 0.04)))
    monkeypatch.setattr(coax_discs, "_SENSES", (-1.0, 1.0))
    mirror = pair((1.2, 0.4, -0.3), (-0.5, 0.9, -0.4), (TipPathPlane(-0.05, -0.02), TipPathPlane(0.03, 0.04)))
    signs = [1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, 1.0, 1.0, 1.0]
    np.testing.assert_allclose(loads_of(mirror), signs * loads_of(plain), rtol=1e-10, atol=1e-12)


def test_a_hovers_thrust_torque_and_inflow_are_those_without_flapping() -> None:
    level = Vector(0.0, 0.0, -1.0)
    speeds, far = (HOVER.omega_upper, HOVER.omega_lower), (50.0, 50.0)

    def plain(upper: float, lower: float) -> Any:
        still, par = Vector(0.0, 0.0, 0.0), COAX.values()
        return rotor_pair(still, (level, level), (upper, lower), HOVER.induced, far, par, 1.2, COAX.options, XP)

    found, before = pair(), plain(*speeds)
    np.testing.assert_allclose([*found.lift, *found.torque, *found.inflow], before[:4] + before.inflow, atol=1e-12)
    # Damping of yaw: blades meet the air at the rotor's speed less the yaw rate, each in its own sense.
    step = 1e-4
    slope = (pair(rates=(0.0, 0.0, step)).acting.moment.z - pair(rates=(0.0, 0.0, -step)).acting.moment.z) / (2 * step)
    faster, slower = plain(speeds[0] + step, speeds[1] + step), plain(speeds[0] - step, speeds[1] - step)
    expected = sum((faster[k] - slower[k]) / (2.0 * step) for k in (2, 3))
    assert slope == pytest.approx(-expected, rel=1e-6)


def test_what_a_climb_takes_is_thrust_times_speed() -> None:
    """Torque without profile drag and uneven inflow: thrust times the flow through the disc, climbing or not."""
    smooth = {"rotor_drag_upper": 0.0, "rotor_drag_lower": 0.0, "induced_factor": 1.0}
    found, given = pair((0.0, 0.0, -1.0), **smooth), _given((0.0, 0.0, -1.0))
    for side, omega in enumerate((HOVER.omega_upper, HOVER.omega_lower)):
        flow = HOVER.induced[side] + given[side] + 1.0
        assert found.torque[side] * omega == pytest.approx(found.lift[side] * flow, rel=1e-10)


def test_rotors_at_rest_and_settled_blades() -> None:
    still = pair(asked=(TipPathPlane(0.1, 0.1),) * 2, omegas=(0.0, -1.0))
    assert [*still.acting.force, *still.acting.moment, *still.lift, *still.torque] == [0.0] * 10
    settled = vehicle("coax", rotor="inflow", flapping="settled-blades")
    assert len(settled.state_names) == 20
    assert "alpha_upper" in COAX.state_names
    # With its discs at their settled tilts, the vehicle with a state for each moves as the other does.
    row = np.array(list(leaves(settled.state)))
    row[3:12] = 0.3, -0.2, 0.1, 0.02, -0.03, 0.0, 0.2, 0.1, -0.1
    row[12:14] = 0.03, -0.01
    u, around = (0.5, 0.5, 0.0, 0.0), environment_of(settled)
    at_once = acting_at(settled, row, u, around)
    asked = acting_at(COAX, [*row, 0.0, 0.0], u, around)
    assert at_once.upper is None
    assert asked.upper is not None
    planes = at_once.planes
    with_states = np.array([*row, *planes[0]])
    with_states[12:14] = planes[1]
    moved = acting_at(COAX, with_states, u, around)
    assert tuple(moved.upper) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert moved.force.z == pytest.approx(at_once.force.z, rel=5e-3)


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(CardError, match="flapping: is 'yes', expected one of 'paper', 'blades', 'settled-blades'"):
        vehicle("coax", rotor="inflow", flapping="yes")
    with pytest.raises(CardError, match="flapping: needs rotors with inflow"):
        vehicle("coax", flapping="blades")
    assert vehicle("coax", rotor="inflow").options == InflowOptions()
    assert "blade_inertia" not in vehicle("coax", rotor="inflow").parameter_names
