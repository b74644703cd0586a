"""A rotor disc by blade elements, integrated in closed form: thrust, in-plane forces, torque and flapping moments.

Straight untapered blades with linear twist and lift slope a, no stall, no reversed flow, small angles; the inflow is
uniform plus a gradient. Within that the integrals over radius and azimuth are exact (Bramwell 2001, ch. 3 and 5;
Padfield 2007, sec. 3.2.1), for any advance ratio and any direction of flight, and any sign of the thrust. Blades lift
over their whole length, or from a root cut-out to a tip loss factor (`Span`).

Everything is dimensionless (lengths by R, speeds by Omega R, rates by Omega) and for a rotor that turns counter-
clockwise from above; azimuth psi counts from aft. Pitch theta0 + twist x - A1 cos - B1 sin, flapping
a0 - a1 cos - b1 sin: a1 > 0 leans the disc aft, b1 > 0 right; B1 > 0 is stick forward, A1 > 0 stick right.
"""

from __future__ import annotations

from typing import NamedTuple

from swashplate.physics.backend import Scalar


class Span(NamedTuple):
    """Integrals over the part of a blade that lifts, m_n of x^n, and over the part that drags, d_n."""

    m0: Scalar
    m1: Scalar
    m2: Scalar
    m3: Scalar
    m4: Scalar
    d1: Scalar
    d3: Scalar


WHOLE = Span(1.0, 0.5, 1.0 / 3.0, 0.25, 0.2, 0.5, 0.25)
"""Blades that lift from the centre to the tip."""


def span(tip_loss: Scalar, root_cutout: Scalar) -> Span:
    """Blades that begin at a root cut-out and lift to B of the radius, dragging to the tip (Prandtl and Betz 1919).

    Args:
        tip_loss: B, 0.95 to 0.98, or 1 - sqrt(2 C_T) / blades (Leishman 2006, eq. 3.122); 1 for none.
        root_cutout: radius of the first profile over that of the rotor; 0 for none.
    """
    b, e = tip_loss, root_cutout
    b2, e2 = b * b, e * e
    b4, e4 = b2 * b2, e2 * e2
    return Span(
        b - e,
        (b2 - e2) / 2.0,
        (b2 * b - e2 * e) / 3.0,
        (b4 - e4) / 4.0,
        (b4 * b - e4 * e) / 5.0,
        (1.0 - e2) / 2.0,
        (1.0 - e4) / 4.0,
    )


class Disc(NamedTuple):
    """What the blades see.

    Attributes:
        mu_x, mu_y, mu_z: velocity of the hub through the air ahead, right and down.
        lam0, lam_c, lam_s: inflow lam0 + x (lam_c cos + lam_s sin), down through the disc positive.
        p, q: angular velocity of the tip-path plane in space, roll right and pitch up positive.
        theta0, twist, A1, B1: blade pitch.
        a0, a1, b1: flapping.
    """

    mu_x: Scalar
    mu_y: Scalar
    mu_z: Scalar
    lam0: Scalar
    lam_c: Scalar
    lam_s: Scalar
    p: Scalar
    q: Scalar
    theta0: Scalar
    twist: Scalar
    A1: Scalar
    B1: Scalar
    a0: Scalar
    a1: Scalar
    b1: Scalar


class DiscLoads(NamedTuple):
    """Coefficients of thrust (up), force ahead and force right, by rho A (Omega R)^2, and of torque, by that and R."""

    CT: Scalar
    CX: Scalar
    CY: Scalar
    CQ: Scalar


class FlapMoments(NamedTuple):
    """Integral of x U_T (theta U_T + U_P) over the blade: its mean and its cosine and sine parts."""

    mean: Scalar
    cos: Scalar
    sin: Scalar


class _Incidence(NamedTuple):
    """theta U_T + U_P and U_P as polynomials of x by harmonic of azimuth (first index harmonic, second power of x)."""

    m0: Scalar  # mean: m0 + theta0 x + twist x^2
    c0: Scalar  # cos: c0 + c1 x
    c1: Scalar
    s0: Scalar  # sin: s0 + s1 x
    s1: Scalar
    c2: Scalar  # cos 2 psi
    s2: Scalar  # sin 2 psi
    up_m: Scalar  # U_P: mean
    up_c0: Scalar  # its cos: up_c0 + up_c1 x
    up_c1: Scalar
    up_s0: Scalar
    up_s1: Scalar
    up_c2: Scalar
    up_s2: Scalar


def _incidence(d: Disc) -> _Incidence:
    """U_T = x + mu_x sin + mu_y cos; U_P counts air that comes from below as positive."""
    up_m = d.mu_z - d.lam0 + 0.5 * (d.a1 * d.mu_x - d.b1 * d.mu_y)
    up_c0, up_c1 = -d.a0 * d.mu_x, d.q - d.lam_c + d.b1
    up_s0, up_s1 = d.a0 * d.mu_y, d.p - d.lam_s - d.a1
    up_c2 = 0.5 * (d.a1 * d.mu_x + d.b1 * d.mu_y)
    up_s2 = 0.5 * (d.b1 * d.mu_x - d.a1 * d.mu_y)
    return _Incidence(
        m0=up_m - 0.5 * (d.A1 * d.mu_y + d.B1 * d.mu_x),
        c0=d.mu_y * d.theta0 + up_c0,
        c1=d.mu_y * d.twist - d.A1 + up_c1,
        s0=d.mu_x * d.theta0 + up_s0,
        s1=d.mu_x * d.twist - d.B1 + up_s1,
        c2=0.5 * (d.B1 * d.mu_x - d.A1 * d.mu_y) + up_c2,
        s2=-0.5 * (d.A1 * d.mu_x + d.B1 * d.mu_y) + up_s2,
        up_m=up_m,
        up_c0=up_c0,
        up_c1=up_c1,
        up_s0=up_s0,
        up_s1=up_s1,
        up_c2=up_c2,
        up_s2=up_s2,
    )


def thrust_coefficient(d: Disc, solidity: Scalar, lift_slope: Scalar, blade: Span = WHOLE) -> Scalar:
    """C_T (Padfield 2007, eq. 3.90, with both components of the advance ratio)."""
    mu2 = d.mu_x * d.mu_x + d.mu_y * d.mu_y
    return (0.5 * lift_slope * solidity) * (
        d.theta0 * (blade.m2 + 0.5 * blade.m0 * mu2)
        + d.twist * (blade.m3 + 0.5 * blade.m1 * mu2)
        - blade.m1 * (d.mu_x * d.B1 + d.mu_y * d.A1)
        + blade.m1 * (d.mu_z - d.lam0)
        + 0.5 * blade.m1 * (d.mu_x * (d.p - d.lam_s) + d.mu_y * (d.q - d.lam_c))
    )


def flap_moments(d: Disc, blade: Span = WHOLE) -> FlapMoments:
    """Moments of the lift about the flapping hinge at the centre (Bramwell 2001, sec. 3.4)."""
    i, k = _incidence(d), blade
    mean1 = k.m1 * i.m0 + k.m2 * d.theta0 + k.m3 * d.twist  # integral of x times the mean incidence
    mean2 = k.m2 * i.m0 + k.m3 * d.theta0 + k.m4 * d.twist
    cos1, sin1 = k.m1 * i.c0 + k.m2 * i.c1, k.m1 * i.s0 + k.m2 * i.s1
    return FlapMoments(
        mean2 + 0.5 * (d.mu_x * sin1 + d.mu_y * cos1),
        k.m2 * i.c0 + k.m3 * i.c1 + d.mu_y * mean1 + 0.5 * k.m1 * (d.mu_x * i.s2 + d.mu_y * i.c2),
        k.m2 * i.s0 + k.m3 * i.s1 + d.mu_x * mean1 + 0.5 * k.m1 * (d.mu_y * i.s2 - d.mu_x * i.c2),
    )


def disc_loads(d: Disc, solidity: Scalar, lift_slope: Scalar, drag: Scalar, blade: Span = WHOLE) -> DiscLoads:
    """Thrust, in-plane forces and torque; `drag` is the blades' profile drag coefficient.

    Lift leans inwards with the blade's flapping and forwards or back with the inflow angle U_P / U_T.
    """
    i, k = _incidence(d), blade
    mean0 = k.m0 * i.m0 + k.m1 * d.theta0 + k.m2 * d.twist
    mean1 = k.m1 * i.m0 + k.m2 * d.theta0 + k.m3 * d.twist
    cos0, sin0 = k.m0 * i.c0 + k.m1 * i.c1, k.m0 * i.s0 + k.m1 * i.s1
    cos1, sin1 = k.m1 * i.c0 + k.m2 * i.c1, k.m1 * i.s0 + k.m2 * i.s1
    up_c, up_s = k.m0 * i.up_c0 + k.m1 * i.up_c1, k.m0 * i.up_s0 + k.m1 * i.up_s1

    # Harmonics of the lift per length U_T (theta U_T + U_P), integrated over the blade.
    lift = mean1 + 0.5 * (d.mu_x * sin0 + d.mu_y * cos0)
    lift_c = cos1 + d.mu_y * mean0 + 0.5 * k.m0 * (d.mu_x * i.s2 + d.mu_y * i.c2)
    lift_s = sin1 + d.mu_x * mean0 + 0.5 * k.m0 * (d.mu_y * i.s2 - d.mu_x * i.c2)
    lift_c2 = k.m1 * i.c2 + 0.5 * (d.mu_y * cos0 - d.mu_x * sin0)
    lift_s2 = k.m1 * i.s2 + 0.5 * (d.mu_x * cos0 + d.mu_y * sin0)

    # The forward lean of the lift, U_P (theta U_T + U_P): its sine and cosine part, and its mean times x.
    lean_s = 0.5 * (i.up_m * sin0 + i.up_s0 * mean0 + i.up_s1 * mean1) + 0.25 * (
        up_c * i.s2 - up_s * i.c2 + i.up_s2 * cos0 - i.up_c2 * sin0
    )
    lean_c = 0.5 * (i.up_m * cos0 + i.up_c0 * mean0 + i.up_c1 * mean1) + 0.25 * (
        up_c * i.c2 + up_s * i.s2 + i.up_c2 * cos0 + i.up_s2 * sin0
    )
    cos2, sin2 = k.m2 * i.c0 + k.m3 * i.c1, k.m2 * i.s0 + k.m3 * i.s1
    lean_x = i.up_m * mean1 + 0.5 * (
        i.up_c0 * cos1 + i.up_c1 * cos2 + i.up_s0 * sin1 + i.up_s1 * sin2 + k.m1 * (i.up_c2 * i.c2 + i.up_s2 * i.s2)
    )

    profile = drag / lift_slope
    scale = 0.5 * lift_slope * solidity
    mu2 = d.mu_x * d.mu_x + d.mu_y * d.mu_y
    return DiscLoads(
        scale * lift,
        scale
        * (
            lean_s
            - k.d1 * profile * d.mu_x
            + 0.5 * (d.a0 * lift_c - d.a1 * (lift + 0.5 * lift_c2))
            - 0.25 * d.b1 * lift_s2
        ),
        scale
        * (
            lean_c
            - k.d1 * profile * d.mu_y
            - 0.5 * (d.a0 * lift_s - d.b1 * (lift - 0.5 * lift_c2))
            + 0.25 * d.a1 * lift_s2
        ),
        scale * (profile * (k.d3 + 0.5 * k.d1 * mu2) - lean_x),
    )


def thrust_tilt_loads(d: Disc, solidity: Scalar, lift_slope: Scalar, drag: Scalar, blade: Span = WHOLE) -> DiscLoads:
    """The same with the thrust simply perpendicular to the tip-path plane, as classical derivative tables have it.

    A disc that turns in space carries its lift unevenly, and the lean of that lift takes up to half of the in-plane
    force away again; this form leaves that out (it is what reproduces the Lynx's published X_q and Y_p).
    """
    full = disc_loads(d, solidity, lift_slope, drag, blade)
    side = 0.5 * solidity * drag * blade.d1
    return DiscLoads(full.CT, -full.CT * d.a1 - side * d.mu_x, full.CT * d.b1 - side * d.mu_y, full.CQ)
