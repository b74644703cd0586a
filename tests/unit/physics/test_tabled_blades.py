"""Blades with an aerofoil table: against the closed forms, a loop over blade elements, energy, finite differences."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from swashplate.engine.slopes import slopes_of
from swashplate.models.card import packaged_cards
from swashplate.models.conventional.aerofoil_file import aerofoil_of, parse_aerofoil
from swashplate.physics import blade_element, inflow
from swashplate.physics.atmosphere import sound_speed, temperature_of, viscosity
from swashplate.physics.backend import FloatBackend
from swashplate.physics.blade_element import Disc
from swashplate.physics.tabled_blades import (
    AerofoilTable,
    TabledBlades,
    blade_doubts,
    section,
    tabled_inflow,
    tabled_loads,
)

XP = FloatBackend()
SOLIDITY, SLOPE, CHORD = 0.052, 5.5, 0.08
SEEDS = range(6)


def straight(drag: float) -> AerofoilTable:
    """c_l = 5.5 alpha and one drag coefficient, from a file's text."""
    rows = [f"0,1e6,{a},{SLOPE * math.radians(a)},{drag}" for a in range(-30, 31)]
    return parse_aerofoil("\n".join(["mach,reynolds,alpha_deg,cl,cd", *rows]), "straight.csv")


def packaged() -> AerofoilTable:
    return aerofoil_of("naca0012", packaged_cards()["raptor50"])[0]


def blades(table: AerofoilTable, *, root: float = 0.0, tip: float = 1.0, mach: float = 0.33) -> TabledBlades:
    return TabledBlades(table, SOLIDITY, SLOPE, CHORD, mach, 4.2e5, root, tip)


def some_disc(seed: int, size: float = 1.0) -> Disc:
    """A flight state in which no blade element outside a quarter of the radius sees air from behind; small angles."""
    rng = np.random.default_rng(seed)
    sizes = np.array([0.15, 0.1, 0.05, 0.06, 0.05, 0.05, 0.02, 0.02, 0.2, 0.15, 0.1, 0.1, 0.1, 0.1, 0.1])
    return Disc(*(rng.uniform(-1.0, 1.0, 15) * sizes * np.array([1.0, 1.0, *(size,) * 13])).tolist())


@pytest.mark.parametrize("seed", SEEDS)
def test_a_straight_line_gives_the_closed_forms(seed: int) -> None:
    """In the limit of small angles, in which these are written: what is left falls with the angles squared."""
    left = []
    for size in (1e-2, 1e-3):
        d, drag = some_disc(seed, size), 0.015 * size * size
        span = blade_element.span(0.97, 0.25)
        ours = tabled_loads(d, blades(straight(drag), root=0.25, tip=0.97), XP)
        closed = blade_element.disc_loads(d, SOLIDITY, SLOPE, drag, span)
        flaps = blade_element.flap_moments(d, span)
        scale = np.array([size, *(size * size,) * 3, *(size,) * 3])
        difference = np.array([*ours[:4], *ours.moments]) - np.array([*closed, *flaps])
        left.append(float(np.max(np.abs(difference / scale))))
        np.testing.assert_allclose(ours.slopes, np.array([1.0, 0.0, 0.0, 1.0]) * span.m3, atol=0.1 * size)
        loss = 0.5 * SOLIDITY * SLOPE * span.m1
        assert ours.loss == pytest.approx(loss, rel=0.1 * size)
    assert left[0] < 1e-4
    assert left[1] < 0.02 * left[0]


def curve(points: Callable[[np.ndarray], np.ndarray]) -> PchipInterpolator:
    degrees = np.arange(-180.0, 180.5, 1.0)
    return PchipInterpolator(degrees, points(np.radians(degrees)))


def test_against_a_loop_over_blade_elements() -> None:
    """A profile that stalls at 12 deg, in fast flight with reversed flow: element by element, as a textbook says it."""

    def lifts(a: np.ndarray) -> np.ndarray:
        return np.sin(2.0 * a) + 4.0 * a * np.exp(-((a / 0.25) ** 2))

    def drags(a: np.ndarray) -> np.ndarray:
        return 0.012 + 1.8 * np.sin(a) ** 2

    degrees = np.arange(-180, 181)
    lines = [
        f"0,1e6,{a},{lifts(np.radians(a)):.17g},{drags(np.radians(a)):.17g},{0.02 * np.cos(np.radians(a)):.17g}"
        for a in degrees
    ]
    table = parse_aerofoil("\n".join(["mach,reynolds,alpha_deg,cl,cd,cm", *lines]), "stalls.csv")
    lift, drag, twisting = curve(lifts), curve(drags), curve(lambda a: 0.02 * np.cos(a))
    d = Disc(0.3, 0.05, -0.02, 0.03, 0.02, 0.01, 0.01, -0.01, 0.16, -0.1, 0.02, 0.06, 0.06, 0.05, 0.02)
    root, tip, n, m = 0.15, 0.97, 340, 180  # the tip's loss begins between two elements
    found = np.zeros(9)
    for k in range(m):
        psi = 2.0 * math.pi * (k + 0.5) / m
        c, s = math.cos(psi), math.sin(psi)
        flap, flapping = d.a0 - d.a1 * c - d.b1 * s, d.a1 * s - d.b1 * c
        x = root + (1.0 - root) * (np.arange(n) + 0.5) / n
        across = x + d.mu_x * s + d.mu_y * c
        up = d.mu_z - d.lam0 - x * (d.lam_c * c + d.lam_s * s) - flap * (d.mu_x * c - d.mu_y * s)
        up = up + x * (d.q * c + d.p * s) - x * flapping
        speed, angle = np.hypot(across, up), np.arctan2(up, across)
        alpha = (np.degrees(d.theta0 + d.twist * x - d.A1 * c - d.B1 * s + angle) + 180.0) % 360.0 - 180.0
        cl, cd, cm = np.where(x < tip, lift(alpha), 0.0), drag(alpha), np.where(x < tip, twisting(alpha), 0.0)
        vertical = speed**2 * (cl * np.cos(angle) + cd * np.sin(angle))
        back = speed**2 * (cd * np.cos(angle) - cl * np.sin(angle))
        rows = [
            vertical,
            vertical * flap * c - back * s,
            -vertical * flap * s - back * c,
            back * x,
            -CHORD * speed**2 * cm * c,
            CHORD * speed**2 * cm * s,
            x * vertical,
            2.0 * x * vertical * c,
            2.0 * x * vertical * s,
        ]
        found += (1.0 - root) / n / m * np.sum(rows, axis=1)
    found *= np.array([*(0.5 * SOLIDITY,) * 6, *(1.0 / SLOPE,) * 3])
    ours = tabled_loads(d, blades(table, root=root, tip=tip), XP, radial=60, azimuthal=180)
    np.testing.assert_allclose([*ours[:6], *ours.moments], found, rtol=2e-4, atol=1e-8)


@pytest.mark.parametrize("seed", SEEDS)
def test_power_is_induced_profile_parasite_and_climb(seed: int) -> None:
    """The air's force does no work but drag's: pointwise, so at any number of nodes; profile power by its own sum."""
    d, b = some_disc(seed), blades(straight(0.015))
    loads = tabled_loads(d, b, XP, radial=40, azimuthal=72)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    x, weights = 0.5 * (nodes + 1.0)[:, None], 0.5 * weights[:, None] / 72
    psi = 2.0 * np.pi * (np.arange(72) + 0.5)[None, :] / 72
    c, s = np.cos(psi), np.sin(psi)
    flap = d.a0 - d.a1 * c - d.b1 * s
    u_t = x + d.mu_x * s + d.mu_y * c
    u_p = d.mu_z - d.lam0 - flap * (d.mu_x * c - d.mu_y * s)
    u_p = u_p + x * ((d.q - d.lam_c + d.b1) * c + (d.p - d.lam_s - d.a1) * s)
    u = np.hypot(u_t, u_p)
    angle = d.theta0 + d.twist * x - d.A1 * c - d.B1 * s + np.arctan2(u_p, u_t)
    at = section(b.table, angle, u, u * 1e6, np)
    profile = 0.5 * SOLIDITY * np.sum(weights * at.drag * u**3)
    gradient = SLOPE * 0.5 * SOLIDITY * 0.5
    pushing = d.mu_x * loads.CX + d.mu_y * loads.CY - (d.mu_z - d.lam0) * loads.CT
    turning = (d.q - d.lam_c + d.b1) * loads.moments.cos + (d.p - d.lam_s - d.a1) * loads.moments.sin
    assert pytest.approx(profile + pushing - gradient * turning, abs=2e-9) == loads.CQ


def test_slopes_are_those_of_finite_differences() -> None:
    d, step = some_disc(3), 1e-6
    b = blades(straight(0.015))

    def at(**there: float) -> object:
        return tabled_loads(d._replace(**there), b, XP)

    by = {n: (at(**{n: getattr(d, n) + step}), at(**{n: getattr(d, n) - step})) for n in ("lam0", "q", "p")}
    here = tabled_loads(d, b, XP)
    assert -(by["lam0"][0].CT - by["lam0"][1].CT) / (2 * step) == pytest.approx(here.loss, rel=1e-6)
    found = [
        (getattr(up.moments, part) - getattr(down.moments, part)) / (2 * step)
        for part in ("cos", "sin")
        for up, down in (by["q"], by["p"])
    ]
    np.testing.assert_allclose(found, here.slopes, rtol=1e-6, atol=1e-8)


def test_slopes_through_the_table_are_exact() -> None:
    b, here = blades(packaged(), root=0.15, tip=0.97), some_disc(2)

    def loads(x: Any, w: Any, p: Any, xp: Any) -> list[Any]:
        at = tabled_loads(here._replace(lam0=x[0]), b, xp)
        return [at.CT, at.CX, at.CQ, at.moments.cos, at.moments.sin]

    values, slopes, _ = slopes_of(loads, (1, 0, 0), where="blades")(np.array([here.lam0]), np.zeros(0), np.zeros(0))
    found = []
    for lam0 in (here.lam0, here.lam0 + 1e-6, here.lam0 - 1e-6):
        at = tabled_loads(here._replace(lam0=lam0), b, XP)
        found.append(np.array([at.CT, at.CX, at.CQ, at.moments.cos, at.moments.sin]))
    np.testing.assert_allclose(values, found[0], rtol=1e-10)
    np.testing.assert_allclose(slopes[:, 0], (found[1] - found[2]) / 2e-6, rtol=1e-5)


@pytest.mark.parametrize("mu", [0.0, 0.15, 0.3])
def test_few_nodes_are_enough(mu: float) -> None:
    d = Disc(
        mu, 0.0, -0.1 * mu, 0.04 - 0.08 * mu, 0.02, 0.0, 0.0, 0.0, 0.12, -0.05, 0.01, 0.02 + 0.2 * mu, 0.04, 0.01, 0.01
    )
    b = blades(packaged(), root=0.15, tip=0.97)
    for _ in range(10):  # the collective of a usual thrust
        d = d._replace(theta0=d.theta0 + (0.004 - tabled_loads(d, b, XP).CT) / 0.05)
    few, many = tabled_loads(d, b, XP), tabled_loads(d, b, XP, radial=40, azimuthal=90)
    np.testing.assert_allclose([few.CT, few.CQ, few.moments.mean], [many.CT, many.CQ, many.moments.mean], rtol=2e-3)
    np.testing.assert_allclose([few.CX, few.CY], [many.CX, many.CY], atol=0.01 * abs(many.CX) + 2e-6)


def hover_loads(collective: float, b: TabledBlades) -> tuple[float, float]:
    """C_T and C_Q of a hovering rotor at a collective, by momentum theory."""
    d = Disc(*(0.0,) * 8, collective, *(0.0,) * 6)
    lam0 = tabled_inflow(d, b, 0.05, 1.0, mu2=0.0, xp=XP)
    at = tabled_loads(d._replace(lam0=lam0), b, XP)
    return at.CT, at.CQ


def test_thrust_saturates_as_collective_grows() -> None:
    """C_T / sigma follows collective up to stall, then hardly grows; a straight line goes on, and power rises."""
    tabled, line = blades(packaged()), blades(straight(0.009))
    low, high = (hover_loads(c, tabled) for c in (0.15, 0.40))
    first, last = (hover_loads(c, line) for c in (0.15, 0.40))
    early, _ = hover_loads(0.05, tabled)
    assert (low[0] - early) / 0.10 > 3.0 * (high[0] - low[0]) / 0.25
    assert high[0] / SOLIDITY < 0.2 < last[0] / SOLIDITY
    assert high[1] > 1.3 * last[1] * high[0] / last[0]  # more torque for its thrust than unstalled blades
    assert first[0] == pytest.approx(low[0], rel=0.12)


def test_momentum_is_balanced() -> None:
    for collective, left in ((0.1, 1e-9), (0.25, 2e-6), (0.3, 2e-4)):
        d, b = Disc(*(0.0,) * 8, collective, *(0.0,) * 6), blades(packaged())
        free = blade_element.thrust_coefficient(d, SOLIDITY, SLOPE)
        start = inflow.momentum_inflow(free, 0.25 * SLOPE * SOLIDITY, 0.0, 0.0, XP)
        lam0 = tabled_inflow(d, b, start, 1.0, mu2=0.0, xp=XP)
        assert abs(tabled_loads(d._replace(lam0=lam0), b, XP).CT - 2.0 * lam0 * lam0) < left


def test_the_advancing_tip_pays_for_its_mach_number() -> None:
    """At the same thrust in fast flight, drag's rise takes power at a tip Mach number of 0.65 and none at 0.3."""
    d = Disc(0.3, 0.0, -0.03, 0.01, 0.01, 0.0, 0.0, 0.0, 0.12, -0.1, 0.02, 0.08, 0.04, 0.0, 0.0)
    table, coefficients = packaged(), {}
    for mach in (0.3, 0.5, 0.65):
        b = blades(table, mach=mach)
        at = d
        for _ in range(20):  # the collective that gives the same thrust
            at = at._replace(theta0=at.theta0 + (0.004 - tabled_loads(at, b, XP).CT) / 0.05)
        loads = tabled_loads(at, b, XP)
        assert pytest.approx(0.004, rel=1e-4) == loads.CT
        coefficients[mach] = loads.CQ + 0.03 * loads.CT - 0.3 * loads.CX
    assert abs(coefficients[0.5] / coefficients[0.3] - 1.0) < 0.03
    assert coefficients[0.65] > 1.1 * coefficients[0.5]
    assert blade_doubts(d, blades(table, mach=0.65)).diverged > 0.05
    assert blade_doubts(d, blades(table, mach=0.3)).diverged == 0.0


def test_air_of_the_standard_day() -> None:
    """ISO 2533:1975: 288.15 K, 340.29 m/s and 1.7894e-5 Pa s at sea level; 223.25 K and 299.53 m/s at 10 km."""
    for density, kelvin, sound, mu in ((1.225, 288.15, 340.29, 1.7894e-5), (0.41271, 223.15, 299.46, 1.4571e-5)):
        temperature = temperature_of(density, XP)
        assert temperature == pytest.approx(kelvin, rel=5e-4)
        assert sound_speed(temperature, XP) == pytest.approx(sound, rel=5e-4)
        assert viscosity(temperature, XP) == pytest.approx(mu, rel=1e-3)
    assert temperature_of(0.02, XP) == pytest.approx(216.65)
