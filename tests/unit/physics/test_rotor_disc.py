"""The main rotor's closed forms against numerical quadrature of the blade element's definition, and its energy."""

from __future__ import annotations

import math

import casadi
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from swashplate.physics import blade_element, flapping, inflow
from swashplate.physics.backend import CasadiBackend, FloatBackend
from swashplate.physics.blade_element import Disc
from swashplate.physics.flapping import Flapping, Hinge

XP = FloatBackend()
SOLIDITY, SLOPE, DRAG = 0.052, 5.5, 0.015
SEEDS = range(20)
HINGE = Hinge(0.05, 3.8, 27.0)


def some_disc(seed: int) -> Disc:
    """Any flight state: fast, sideways, climbing or sinking, any flapping and cyclic."""
    rng = np.random.default_rng(seed)
    sizes = Disc(0.35, 0.2, 0.05, 0.06, 0.05, 0.05, 0.02, 0.02, 0.2, 0.15, 0.1, 0.1, 0.1, 0.1, 0.1)
    return Disc(*(float(rng.uniform(-size, size)) for size in sizes))


def blade(d: Disc) -> dict[str, np.ndarray]:
    """U_T, U_P, theta, beta and the inflow on a grid that integrates these trigonometric polynomials exactly."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    x, weights = 0.5 * (nodes + 1.0)[:, None], 0.5 * weights[:, None]
    psi = np.arange(16)[None, :] * 2.0 * np.pi / 16
    c, s = np.cos(psi), np.sin(psi)
    beta = d.a0 - d.a1 * c - d.b1 * s
    beta_dash = d.a1 * s - d.b1 * c
    induced = d.lam0 + x * (d.lam_c * c + d.lam_s * s)
    u_t = x + d.mu_x * s + d.mu_y * c
    u_p = d.mu_z - induced + beta * (-d.mu_x * c + d.mu_y * s) - x * beta_dash + x * (d.p * s + d.q * c)
    theta = d.theta0 + d.twist * x - d.A1 * c - d.B1 * s
    mean = lambda f: float(np.sum(weights * f) / 16)  # noqa: E731
    return {"x": x, "c": c, "s": s, "u_t": u_t, "u_p": u_p, "theta": theta, "beta": beta, "in": induced, "mean": mean}


@pytest.mark.parametrize("seed", SEEDS)
def test_closed_forms_are_the_quadrature(seed: int) -> None:
    d = some_disc(seed)
    b = blade(d)
    lift = b["u_t"] ** 2 * b["theta"] + b["u_t"] * b["u_p"]
    against = DRAG / SLOPE * b["u_t"] ** 2 - b["u_p"] * (b["u_t"] * b["theta"] + b["u_p"])
    scale = 0.5 * SLOPE * SOLIDITY
    expected = (
        scale * b["mean"](lift),
        scale * b["mean"](-against * b["s"] + lift * b["beta"] * b["c"]),
        scale * b["mean"](-against * b["c"] - lift * b["beta"] * b["s"]),
        scale * b["mean"](against * b["x"]),
    )
    np.testing.assert_allclose(blade_element.disc_loads(d, SOLIDITY, SLOPE, DRAG), expected, atol=1e-15)
    assert blade_element.thrust_coefficient(d, SOLIDITY, SLOPE) == pytest.approx(expected[0], abs=1e-16)
    moments = [b["mean"](b["x"] * lift * weight) for weight in (1.0, 2.0 * b["c"], 2.0 * b["s"])]
    np.testing.assert_allclose(blade_element.flap_moments(d), moments, atol=1e-15)


def steady(d: Disc, **kept: object) -> Disc:
    """The disc with the flapping at which its tip-path plane stands still in space."""

    def rates(a1: float, b1: float) -> np.ndarray:
        there = d._replace(a1=a1, b1=b1, p=0.0, q=0.0)
        arguments = {"wake_distortion": 0.0, "phase_lag": None, **kept}
        return np.array(flapping.plane_rates(Flapping(a1, b1), blade_element.flap_moments(there), HINGE, **arguments))

    at_rest = rates(0.0, 0.0)
    slope = np.stack([rates(1.0, 0.0) - at_rest, rates(0.0, 1.0) - at_rest], axis=1)
    a1, b1 = np.linalg.solve(slope, -at_rest)
    return d._replace(a1=float(a1), b1=float(b1), p=0.0, q=0.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_shaft_power_is_induced_profile_parasite_and_climb(seed: int) -> None:
    d = steady(some_disc(seed))
    loads, b = blade_element.disc_loads(d, SOLIDITY, SLOPE, DRAG), blade(d)
    lift = 0.5 * SLOPE * SOLIDITY * (b["u_t"] ** 2 * b["theta"] + b["u_t"] * b["u_p"])
    induced = b["mean"](lift * b["in"])
    profile = 0.5 * SOLIDITY * DRAG * b["mean"](b["u_t"] ** 3)
    pushing = d.mu_x * loads.CX + d.mu_y * loads.CY - d.mu_z * loads.CT
    assert pytest.approx(induced + profile + pushing, abs=1e-15) == loads.CQ


def test_shaft_power_in_hover_by_momentum_theory() -> None:
    """The ideal power C_T^1.5 / sqrt 2 and the profile's sigma delta / 8, to 1e-9 of the power."""
    solidity_loss = 0.25 * SLOPE * SOLIDITY
    d = Disc(*(0.0,) * 8, 0.1, *(0.0,) * 6)
    free = blade_element.thrust_coefficient(d, SOLIDITY, SLOPE)
    lam0 = inflow.momentum_inflow(free, solidity_loss, 0.0, 0.0, XP)
    loads = blade_element.disc_loads(d._replace(lam0=lam0), SOLIDITY, SLOPE, DRAG)
    assert pytest.approx(loads.CT**1.5 / math.sqrt(2.0) + SOLIDITY * DRAG / 8.0, rel=1e-9) == loads.CQ
    assert lam0 == pytest.approx(math.sqrt(loads.CT / 2.0), rel=1e-9)


def test_momentum_balance_in_every_flow_state() -> None:
    """Thrust through zero, climb, descent, vortex ring, windmilling, any speed: one answer, and it balances."""
    rng = np.random.default_rng(1)
    worst = 0.0
    for _ in range(3000):
        free, loss, mu_z = rng.uniform(-0.02, 0.03), rng.uniform(0.02, 0.25), rng.uniform(-0.2, 0.2)
        mu2 = float(rng.choice([0.0, rng.uniform(0.0, 0.16)]))
        lam0 = inflow.momentum_inflow(free, loss, mu_z, mu2, XP)
        v, _, _ = inflow.mass_flow(lam0, mu_z, mu2, XP)
        worst = max(worst, abs(2.0 * v * lam0 + loss * lam0 - free))
    assert worst < 1e-12


def test_thrust_grows_with_inflow_everywhere() -> None:
    """Why the equation has one answer: 2 V lam0 rises everywhere, through the vortex ring too."""
    lam0 = np.linspace(-0.2, 0.2, 4001)
    for mu_z in (-0.1, -0.03, 0.0, 0.02, 0.07, 0.15):
        mass = [2.0 * x * inflow.mass_flow(float(x), mu_z, 0.0, XP)[0] for x in lam0]
        assert np.all(np.diff(mass) > -1e-12)


@pytest.mark.parametrize("sink", [0.5, 1.0, 1.5, 1.75, 2.0])
def test_descent_lies_within_the_stated_distance_of_measurements(sink: float) -> None:
    """Leishman (2006), eq. 2.96 with kappa = 1: v_i / v_h = 1 - 1.125 x - 1.372 x^2 - 1.718 x^3 - 0.655 x^4."""
    v_h, x = 0.04, -sink
    lam0 = inflow.momentum_inflow(2.0 * v_h**2, 0.0, sink * v_h, 0.0, XP)
    measured = 1.0 - 1.125 * x - 1.372 * x**2 - 1.718 * x**3 - 0.655 * x**4
    assert abs(lam0 / v_h - measured) < 0.45


def test_quasi_steady_flapping_is_the_textbooks() -> None:
    """Teetering rotor in forward flight (Bramwell 2001, eqs 3.68, 3.69): a1 and b1 in the wind's axes."""
    mu, a0, lag = 0.2, 0.05, 0.012
    free = HINGE._replace(excess=0.0)
    d = Disc(mu, 0.0, -0.01, 0.03, lag, 0.0, 0.0, 0.0, 0.12, -0.05, 0.02, 0.03, a0, 0.0, 0.0)
    a1 = (8 / 3 * mu * 0.12 + 2 * mu * -0.05 + 2 * mu * (-0.01 - 0.03) - (1 + 1.5 * mu**2) * 0.03) / (1 - mu**2 / 2)
    b1 = (4 / 3 * mu * a0 + lag + (1 + mu**2 / 2) * 0.02) / (1 + mu**2 / 2)
    moments = blade_element.flap_moments(d._replace(a1=a1, b1=b1))
    rates = flapping.plane_rates(Flapping(a1, b1), moments, free, wake_distortion=0.0, phase_lag=None)
    np.testing.assert_allclose(rates, 0.0, atol=1e-15)


def test_off_axis_flapping_reverses_at_a_wake_distortion_of_one() -> None:
    """Pitching at q: b1 = -(1 - K_R) q, as measured helicopters do above K_R = 1 (Keller 1996)."""
    for k_r in (0.0, 1.0, 2.0):
        # In a steady pitch rate the disc follows the shaft: its rate in space is the body's.
        q, free = 0.01, HINGE._replace(excess=0.0)
        b1 = -(1.0 - k_r) * q
        a1 = -16.0 / free.lock * q
        d = Disc(*(0.0,) * 3, 0.03, *(0.0,) * 4, 0.1, *(0.0,) * 4, a1, b1)
        p_plane, q_plane = flapping.plane_rates(
            Flapping(a1, b1), blade_element.flap_moments(d), free, wake_distortion=k_r, phase_lag=None
        )
        assert (p_plane, q_plane) == pytest.approx((0.0, q), abs=1e-15)


def flap_residual(
    e: float, lock: float, tilt: tuple[float, float], shaft: tuple[float, float], B1: float, heavier: float = 0.0
) -> np.ndarray:
    """First harmonics of the moments about a hinge at e of a blade in hover, from its motion in space.

    Its mass per length grows from 1 at the hinge to 1 + `heavier` at the tip; 0 is a uniform blade.

    Every element's acceleration by differences of its place: the shaft rolls and pitches at (p, q), the rotor turns,
    the blade flaps. Axes aft, right, up.
    """
    (a1, b1), (p, q) = tilt, shaft
    nodes, weights = np.polynomial.legendre.leggauss(6)
    x, weights = e + (1.0 - e) * 0.5 * (nodes + 1.0), 0.5 * (1.0 - e) * weights
    turning = np.array([[0.0, 0.0, q], [0.0, 0.0, p], [-q, -p, 0.0]])  # of the vector (-p, q, 0)

    def flap(psi: float) -> float:
        return -a1 * math.cos(psi) - b1 * math.sin(psi)

    def place(psi: float, t: float) -> np.ndarray:
        out, up = e + (x - e) * math.cos(flap(psi + t)), (x - e) * math.sin(flap(psi + t))
        hub = np.stack([out * math.cos(psi + t), out * math.sin(psi + t), up])
        return np.asarray(hub + turning @ hub * t + 0.5 * turning @ turning @ hub * t * t)

    found, h, count = np.zeros(2), 1e-3, 12
    for psi in 2.0 * math.pi * np.arange(count) / count:
        acceleration = (place(psi, h) - 2.0 * place(psi, 0.0) + place(psi, -h)) / h**2
        tip, beta = np.array([math.cos(psi), math.sin(psi)]), flap(psi)
        normal = acceleration[2] * math.cos(beta) - tip @ acceleration[:2] * math.sin(beta)
        mass = 1.0 + heavier * (x - e) / (1.0 - e)
        inertia = float(weights * mass @ ((x - e) * normal)) / float(weights * mass @ (x - e) ** 2)
        rate = a1 * math.sin(psi) - b1 * math.cos(psi)
        flow = -(x - e) * rate + x * (p * math.sin(psi) + q * math.cos(psi)) - B1 * math.sin(psi) * x
        air = 0.5 * lock * float(weights @ ((x - e) * x * flow))
        found += 2.0 / count * (air - inertia) * tip
    return found


@pytest.mark.parametrize(("e", "heavier"), [(0.0, 0.0), (0.05, 0.0), (0.15, 0.0), (0.05, 2.0), (0.15, -0.9)])
def test_flapping_about_an_offset_hinge_balances_every_element(e: float, heavier: float) -> None:
    """Steady roll, pitch and cyclic: the closed form's tilt leaves no moment about the hinge (to the small angles)."""
    inertia, shaft, B1 = 0.7, (4e-5, -6e-5), 3e-5
    held = flapping.hinge(
        blade_inertia=inertia,
        blades=4.0,
        hub_stiffness=0.0,
        hinge_offset=e,
        omega=1.0,
        density=1.2,
        lift_slope=5.7,
        chord=0.06,
        radius=1.0,
        first_moment=(0.5 + heavier / 3.0) / (1.5 * (1.0 / 3.0 + heavier / 4.0)),
    )

    def rates(a1: float, b1: float) -> np.ndarray:
        d = Disc(*(0.0,) * 11, B1, 0.0, held.damping * a1, held.damping * b1)
        given = {"wake_distortion": 0.0, "phase_lag": None}
        return np.array(flapping.plane_rates(Flapping(a1, b1), blade_element.flap_moments(d), held, shaft, **given))

    at_rest = rates(0.0, 0.0)
    slope = np.stack([rates(1.0, 0.0) - at_rest, rates(0.0, 1.0) - at_rest], axis=1)
    tilt = np.linalg.solve(slope, np.array(shaft) - at_rest)
    left = flap_residual(e, 1.2 * 5.7 * 0.06 / inertia, (tilt[0], tilt[1]), shaft, B1, heavier)
    assert np.max(np.abs(left)) < 1e-8


@pytest.mark.parametrize("frequency", [1.04, 1.4, 1.9])
def test_stiff_blades_move_their_disc_in_the_regressing_mode(frequency: float) -> None:
    """Beside second-order blades: the mode within 1e-3 in thin air, nearer in thick; steady tilts alike."""
    held = HINGE._replace(excess=frequency**2 - 1.0)
    shaft, level = (3e-3, -2e-3), Disc(*(0.0,) * 3, 0.03, *(0.0,) * 4, 0.1, *(0.0,) * 6)

    def system(lock: float, pace: float) -> tuple[np.ndarray, np.ndarray]:
        own = held._replace(lock=lock, stiffness_pace=pace)

        def rates(a1: float, b1: float) -> np.ndarray:
            moments = blade_element.flap_moments(level._replace(a1=a1, b1=b1))
            given = {"wake_distortion": 0.0, "phase_lag": None}
            p, q = flapping.plane_rates(Flapping(a1, b1), moments, own, shaft, **given)
            return np.array([q - shaft[1], p - shaft[0]])  # of a1 and b1 against the shaft

        rest = rates(0.0, 0.0)
        return np.stack([rates(1.0, 0.0) - rest, rates(0.0, 1.0) - rest], axis=1), rest

    pace = flapping.regressing_pace(held.excess, FloatBackend())
    for lock, kept in ((1e-3, 1e-3), (2.0, 0.3)):
        g = lock / 8.0
        exact = np.roots([1.0, g - 2.0j, frequency**2 - 1.0 - 1.0j * g])
        exact = exact[np.argmin(np.abs(exact.imag))]
        off = []
        for by in (1.0, pace):
            modes = np.linalg.eigvals(system(lock, by)[0])
            off.append(float(np.min(np.abs(modes - complex(exact.real, abs(exact.imag))))) / abs(exact))
        assert off[1] < kept
        assert off[1] < off[0]
    (slope, rest), (paced, paced_rest) = system(2.0, 1.0), system(2.0, pace)
    np.testing.assert_allclose(np.linalg.solve(paced, paced_rest), np.linalg.solve(slope, rest), rtol=1e-12)


def test_an_aerodynamic_phase_lag_is_a_wake_distortion() -> None:
    """Off-axis response alike for K_R = (16 / gamma) tan(lag) (small lag; Mansur and Tischler 1998)."""
    free, lag, turn = HINGE._replace(excess=0.0), 0.05, 0.01
    k_r = 16.0 / free.lock * math.tan(lag)

    def held_disc(**arguments: object) -> np.ndarray:
        """The tilt with which the disc turns at q = turn."""

        def rates(a1: float, b1: float) -> np.ndarray:
            d = Disc(*(0.0,) * 3, 0.03, *(0.0,) * 4, 0.1, *(0.0,) * 4, a1, b1)
            given = {"wake_distortion": 0.0, "phase_lag": None, **arguments}
            return np.array(flapping.plane_rates(Flapping(a1, b1), blade_element.flap_moments(d), free, **given))

        at_rest = rates(0.0, 0.0)
        slope = np.stack([rates(1.0, 0.0) - at_rest, rates(0.0, 1.0) - at_rest], axis=1)
        return np.linalg.solve(slope, np.array([0.0, turn]) - at_rest)

    lagging, bending = held_disc(phase_lag=(math.cos(lag), math.sin(lag))), held_disc(wake_distortion=k_r)
    assert lagging == pytest.approx(bending, rel=0.02)


def test_dynamic_inflow_settles_at_momentum_theory_and_the_static_gradient() -> None:
    """In hover the three states come to rest where the static form is."""
    lam0, moment = 0.03, 0.004
    v, _, _ = inflow.mass_flow(lam0, 0.0, 0.0, XP)
    flow = inflow.gradient_flow(lam0, 0.0, 0.0, v)
    gradient = 2.0 * (0.25 * SLOPE * SOLIDITY * moment) / flow
    at = inflow.Inflow(lam0, gradient, 0.0)
    moments = blade_element.FlapMoments(0.0, moment, 0.0)
    rates = inflow.pitt_peters_rates(
        at,
        2 * v * lam0,
        moments,
        (0.0, 0.0),
        (0.0, 0.0),
        (v, flow),
        wake_distortion=0.0,
        solidity=SOLIDITY,
        lift_slope=SLOPE,
    )
    np.testing.assert_allclose(rates, 0.0, atol=1e-15)


def test_regressing_flap_mode_against_the_second_order_equation() -> None:
    """Exact: -gamma/16 + i (1 - sqrt(lambda^2 - (gamma/16)^2)) Omega; the first-order form is within 0.04 Omega."""
    lock, excess = 3.8, 0.05
    held = Hinge(excess, lock, 0.0)

    def rates(a1: float, b1: float) -> np.ndarray:
        d = Disc(*(0.0,) * 3, 0.03, *(0.0,) * 4, 0.1, *(0.0,) * 4, a1, b1)
        p, q = flapping.plane_rates(
            Flapping(a1, b1), blade_element.flap_moments(d), held, wake_distortion=0.0, phase_lag=None
        )
        return np.array([q, p])

    at_rest = rates(0.0, 0.0)
    matrix = np.stack([rates(1.0, 0.0) - at_rest, rates(0.0, 1.0) - at_rest], axis=1)
    found = np.linalg.eigvals(matrix)[0]
    exact = complex(-lock / 16.0, 1.0 - math.sqrt(1.0 + excess - (lock / 16.0) ** 2))
    assert abs(complex(found.real, abs(found.imag)) - complex(exact.real, abs(exact.imag))) < 0.04


def test_first_and_second_derivatives_through_the_inflow_are_exact() -> None:
    free = casadi.SX.sym("free")
    by = [inflow.momentum_inflow(free, 0.07, 0.005, 0.002, CasadiBackend())]
    for _ in range(2):
        by.append(casadi.jacobian(by[-1], free))
    solved, first, second = (casadi.Function("by", [free], [value]) for value in by)
    at, h = 0.004, 1e-5
    values = [float(solved(at + k * h)) for k in (-1, 0, 1)]
    assert float(first(at)) == pytest.approx((values[2] - values[0]) / (2 * h), rel=1e-5)
    slopes = [float(first(at + k * h)) for k in (-1, 1)]
    assert float(second(at)) == pytest.approx((slopes[1] - slopes[0]) / (2 * h), rel=1e-4)


def test_the_precession_torque_is_what_the_blades_masses_need() -> None:
    """Rods that turn, tilted, on a shaft that rolls and pitches: mass times acceleration times arm, along the shaft."""
    a1, b1, p, q, omega, length, step = 2e-3, -3e-3, 0.7, -0.4, 35.0, 2.0, 1e-4
    psi = np.arange(4) * np.pi / 2.0 + 0.3
    radii, weights = np.polynomial.legendre.leggauss(4)
    radii, weights = 0.5 * length * (radii + 1.0), 0.5 * length * weights  # one kilogram a metre

    def place(t: float) -> np.ndarray:
        """Inertial axes, (blade, element, 3): azimuth from the tail, counter-clockwise from above; z down."""
        at = psi + omega * t
        rods = np.stack([-np.cos(at), np.sin(at), a1 * np.cos(at) + b1 * np.sin(at)], axis=-1)
        turned = Rotation.from_rotvec([p * t, q * t, 0.0]).apply(rods)
        return np.asarray(radii[None, :, None] * turned[:, None, :])

    acceleration = (place(step) - 2.0 * place(0.0) + place(-step)) / step**2
    needed = float((np.cross(place(0.0), acceleration)[..., 2] * weights).sum())
    polar = 4.0 * length**3 / 3.0
    found = flapping.precession_torque(Flapping(a1, b1), p, q, inertia=polar, omega=omega)
    assert needed == pytest.approx(found, rel=1e-4)
