"""Two rotors that share a wake: momentum limits that others published, vortex tubes by quadrature, and the ground."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import fsolve
from scipy.special import ellipe, ellipk

from swashplate.physics import coaxial_wake, ground_effect
from swashplate.physics.backend import FloatBackend
from swashplate.physics.coaxial_wake import Induced

XP = FloatBackend()


def shares(
    form: str, separation: float, *, axial: float = 0.0, across: float = 0.0, own: float = 1.0
) -> tuple[float, float]:
    found = coaxial_wake.wake_shares(
        axial, across**2, Induced(own, own), separation=separation, radius=1.0, form=form, xp=XP
    )
    return float(found.on_lower), float(found.on_upper)


def ideal(form: str, *, balanced: bool) -> tuple[float, float]:
    """Induced power over that of the two rotors apart at the same whole thrust, and the upper rotor's share of thrust.

    With equal thrusts, or with equal powers (equal torques at equal speeds); T = 2 v (flow) for each, nothing else.
    """
    on_lower, on_upper = shares(form, 0.3626)

    def unmet(z: np.ndarray) -> list[float]:
        upper, lower = z
        flows = upper + on_upper * lower, lower + on_lower * upper
        thrusts = upper * flows[0], lower * flows[1]
        power = thrusts[0] * flows[0] - thrusts[1] * flows[1]
        return [sum(thrusts) - 2.0, power if balanced else thrusts[0] - thrusts[1]]

    upper, lower = fsolve(unmet, [0.8, 0.6], xtol=1e-13)
    flows = upper + on_upper * lower, lower + on_lower * upper
    return 0.5 * (upper * flows[0] ** 2 + lower * flows[1] ** 2), 0.5 * upper * flows[0]


@pytest.mark.parametrize(
    ("form", "balanced", "power", "share"),
    [
        ("none", False, 1.0, 0.5),
        ("coplanar", False, 2.0**0.5, 0.5),  # Coleman 1997; Leishman 2006, sec. 2.15, case 1
        ("coplanar", True, 2.0**0.5, 0.5),  # case 2
        ("contracted-wake", False, 1.309, 0.5),  # case 3 mixes the far wake and has 1.281
        ("contracted-wake", True, 1.296, 0.594),  # case 4: 1.281 and T_u / T_l = 1.4376, a share of 0.590
    ],
)
def test_momentum_limits(form: str, balanced: bool, power: float, share: float) -> None:
    assert ideal(form, balanced=balanced) == pytest.approx((power, share), abs=6e-4)


def test_a_separation_lies_between_the_limits() -> None:
    """Upper share at balanced torques 0.55 to 0.56: what free wakes and Harrington's rotors have (Leishman 2006)."""
    power, share = ideal("vortex-tube", balanced=True)
    assert ideal("contracted-wake", balanced=True)[0] < power < ideal("coplanar", balanced=True)[0]
    assert 0.55 < share < 0.56


def test_the_contracted_wake_is_within_two_percent_of_leishman_and_ananthan() -> None:
    """Their energy balance of the mixed far wake, written here anew: T_l x = x w^2 / 2 - 2, 1 + T_l / T_u = x w / 2."""
    t = fsolve(lambda t: t * (1.0 + t) ** 2 - 2.0, 0.7)[0]  # equal torques: x = 1 / t
    assert 1.0 / t == pytest.approx(1.4376, abs=1e-4)
    power, share = ideal("contracted-wake", balanced=True)
    assert share == pytest.approx(1.0 / (1.0 + t), rel=0.01)
    assert power == pytest.approx((2.0 / (1.0 + t)) ** 1.5, rel=0.02)
    x = 0.5 * (np.sqrt(17.0) - 1.0)  # equal thrusts
    assert ideal("contracted-wake", balanced=False)[0] == pytest.approx(0.5 * (1.0 + x), rel=0.025)


def tube_ahead(separation: float) -> float:
    """Mean velocity over a disc ahead of a semi-infinite vortex tube over that in its mouth (mutual flux of rings)."""

    def flux(h: float) -> float:
        m = 4.0 / (4.0 + h * h)
        k = np.sqrt(m)
        return float((2.0 / k - k) * ellipk(m) - 2.0 / k * ellipe(m))

    return float(quad(flux, separation, np.inf, limit=200)[0] / (0.5 * np.pi))


@pytest.mark.parametrize("separation", [0.05, 0.1, 0.2, 0.3626, 0.7, 1.0, 2.0, 4.0])
def test_the_upstream_share_is_the_vortex_tubes(separation: float) -> None:
    own, exact = coaxial_wake.upstream_share(separation, 1.0), tube_ahead(separation)
    assert own == pytest.approx(exact, abs=0.026 if separation < 0.2 else 0.0105)


def test_prandtls_biplane_factor_is_the_same_number() -> None:
    """(1 - 0.66 g) / (1.05 + 3.7 g), g gap over span: a wake that goes straight aft."""
    gap = 0.5 * 0.3626
    prandtl = (1.0 - 0.66 * gap) / (1.05 + 3.7 * gap)
    fast = shares("vortex-tube", 0.3626, across=1e4)
    assert fast == pytest.approx((prandtl, prandtl), abs=0.01)


def skewed_tube(z: float, skew: float) -> float:
    """The same by Biot and Savart over rings along a skewed axis, `z` above the mouth (negative: below)."""
    r, weights = np.polynomial.legendre.leggauss(8)
    r, weights = 0.5 * (r + 1.0), 0.5 * weights * (r + 1.0)
    psi = (np.arange(12) + 0.5) * np.pi / 6.0
    x, y = (r[:, None] * f(psi) for f in (np.cos, np.sin))
    w = np.repeat(weights / 12.0, 12)
    points = np.stack([x.ravel(), y.ravel()], axis=1)
    t = (np.arange(48) + 0.5) * np.pi / 24.0
    s, ds = np.polynomial.legendre.leggauss(160)
    s, ds = 0.5 * (s + 1.0), 0.5 * ds
    along, step = 30.0 * s**3, 90.0 * s**2 * ds
    rx = points[:, 0, None, None] - along[None, :, None] * np.sin(skew) - np.cos(t)
    ry = points[:, 1, None, None] - np.sin(t)
    rz = (z + along * np.cos(skew))[None, :, None]
    swept = (-np.sin(t) * ry - np.cos(t) * rx) / (rx**2 + ry**2 + rz**2) ** 1.5
    return float(np.einsum("p,l,plt->", w, step, swept)) * np.pi / 24.0 / (4.0 * np.pi) / 0.5


@pytest.mark.parametrize("degrees", [0.0, 30.0, 60.0, 85.0])
def test_a_wake_that_is_blown_aside_covers_less(degrees: float) -> None:
    """An uncontracted tube, to which the code's is brought by an infinite climb: contraction is then none."""
    skew, ahead = np.radians(degrees), coaxial_wake.upstream_share(0.3626, 1.0)
    below = ahead + (2.0 - 2.0 * ahead) * np.cos(skew) ** 1.5
    assert below == pytest.approx(skewed_tube(-0.3626, skew), abs=0.08)
    climb = 1e6
    found = shares("vortex-tube", 0.3626, axial=climb, across=climb * np.tan(skew))
    assert found == pytest.approx((below, ahead), abs=1e-3)


@pytest.mark.parametrize("form", coaxial_wake.FORMS)
def test_what_goes_up_through_the_discs_exchanges_the_rotors(form: str) -> None:
    down, up = shares(form, 0.4, axial=50.0), shares(form, 0.4, axial=-50.0)
    assert up == pytest.approx(down[::-1], abs=0.06)
    assert (down[0] > down[1] + 0.2) == (form in ("vortex-tube", "contracted-wake"))


@pytest.mark.parametrize("form", ["vortex-tube", "contracted-wake"])
def test_continuity_of_the_contracted_wake(form: str) -> None:
    """What goes through the upper disc goes through its wake at the lower one: climb + v = area (climb + s v)."""
    for climb in (0.0, 0.3, 2.0):
        gain = 2.0 - (coaxial_wake.upstream_share(0.4, 1.0) if form == "vortex-tube" else 0.0)
        area = (climb + 1.0) / (climb + gain)
        assert shares(form, 0.4, axial=climb)[0] == pytest.approx(area * gain, rel=1e-9)


# ---- ground ----------------------------------------------------------------------------------------------------------
def share(height: float, form: str, across: float = 0.0) -> float:
    return float(ground_effect.induced_share(height, across**2, 3.0, radius=1.0, form=form, xp=XP))


@pytest.mark.parametrize("height", [0.5, 0.7, 1.0, 2.0, 5.0])
def test_thrust_at_the_same_power_is_cheesemans_and_bennetts(height: float) -> None:
    """P = share T^1.5 / sqrt(2 rho A): at the same power the thrust grows by share^(-2/3)."""
    assert share(height, "cheeseman-bennett") ** (-2.0 / 3.0) == pytest.approx(
        ground_effect.thrust_gain(height, radius=1.0), rel=1e-12
    )


def test_haydens_power_and_where_both_end() -> None:
    """1 / (0.9926 + 0.0379 (D / z)^2) at a height of one radius, 1 far away and in fast flight, half at V = v."""
    assert share(1.0, "hayden") == pytest.approx(1.0 / (0.9926 + 0.0379 * 4.0), rel=1e-4)
    for form in ("cheeseman-bennett", "hayden"):
        assert share(50.0, form) == pytest.approx(1.0, abs=1e-4)
        assert share(0.1, form) == share(0.5, form)
        assert share(0.7, form) < share(0.7, form, 3.0) < share(0.7, form, 20.0) < 1.0
        assert share(0.7, form, 20.0) > 0.99
        assert 1.0 - share(0.7, form, 3.0) == pytest.approx(0.5 * (1.0 - share(0.7, form)), rel=1e-9)
    assert share(0.5, "none") == 1.0
