"""What a small change of a rotor's flight state does to its flap moments and loads: `blade_element`, differentiated.

The product rule applied by hand to the closed forms, line by line in their order, so that a table of derivatives needs
no automatic differentiation and each can check the other. In hover this is Padfield (2007), sec. 4.3.2.
"""

from __future__ import annotations

from typing import NamedTuple

from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.blade_element import Disc, DiscLoads, FlapMoments
from swashplate.physics.inflow import RING, mass_flow, wake_skew


def _product(a: Scalar, da: Scalar, b: Scalar, db: Scalar) -> Scalar:
    return a * db + da * b


class _Harmonics(NamedTuple):
    """Incidence theta U_T + U_P and flow U_P as in `blade_element`: mean, cos, sin, cos 2, sin 2 by power of x."""

    m0: Scalar
    c0: Scalar
    c1: Scalar
    s0: Scalar
    s1: Scalar
    c2: Scalar
    s2: Scalar


def _flow(d: Disc) -> _Harmonics:
    return _Harmonics(
        d.mu_z - d.lam0 + 0.5 * (d.a1 * d.mu_x - d.b1 * d.mu_y),
        -d.a0 * d.mu_x,
        d.q - d.lam_c + d.b1,
        d.a0 * d.mu_y,
        d.p - d.lam_s - d.a1,
        0.5 * (d.a1 * d.mu_x + d.b1 * d.mu_y),
        0.5 * (d.b1 * d.mu_x - d.a1 * d.mu_y),
    )


def _flow_change(d: Disc, e: Disc) -> _Harmonics:
    a1x, a1y = _product(d.a1, e.a1, d.mu_x, e.mu_x), _product(d.a1, e.a1, d.mu_y, e.mu_y)
    b1x, b1y = _product(d.b1, e.b1, d.mu_x, e.mu_x), _product(d.b1, e.b1, d.mu_y, e.mu_y)
    return _Harmonics(
        e.mu_z - e.lam0 + 0.5 * (a1x - b1y),
        -_product(d.a0, e.a0, d.mu_x, e.mu_x),
        e.q - e.lam_c + e.b1,
        _product(d.a0, e.a0, d.mu_y, e.mu_y),
        e.p - e.lam_s - e.a1,
        0.5 * (a1x + b1y),
        0.5 * (b1x - a1y),
    )


def _pitch(d: Disc) -> _Harmonics:
    """Theta U_T without theta0 x + twist x^2."""
    return _Harmonics(
        -0.5 * (d.A1 * d.mu_y + d.B1 * d.mu_x),
        d.mu_y * d.theta0,
        d.mu_y * d.twist - d.A1,
        d.mu_x * d.theta0,
        d.mu_x * d.twist - d.B1,
        0.5 * (d.B1 * d.mu_x - d.A1 * d.mu_y),
        -0.5 * (d.A1 * d.mu_x + d.B1 * d.mu_y),
    )


def _pitch_change(d: Disc, e: Disc) -> _Harmonics:
    a_x, a_y = _product(d.A1, e.A1, d.mu_x, e.mu_x), _product(d.A1, e.A1, d.mu_y, e.mu_y)
    b_x, b_y = _product(d.B1, e.B1, d.mu_x, e.mu_x), _product(d.B1, e.B1, d.mu_y, e.mu_y)
    return _Harmonics(
        -0.5 * (a_y + b_x),
        _product(d.mu_y, e.mu_y, d.theta0, e.theta0),
        e.mu_y * d.twist - e.A1,
        _product(d.mu_x, e.mu_x, d.theta0, e.theta0),
        e.mu_x * d.twist - e.B1,
        0.5 * (b_x - a_y),
        -0.5 * (a_x + b_y),
    )


def _sum(a: _Harmonics, b: _Harmonics) -> _Harmonics:
    return _Harmonics(*(x + y for x, y in zip(a, b, strict=True)))


def _over_blade(h: _Harmonics, theta0: Scalar, twist: Scalar, power: int) -> tuple[Scalar, Scalar, Scalar]:
    """Integrals of x^power times mean, cos and sin part."""
    n = power
    return (
        h.m0 / (n + 1) + theta0 / (n + 2) + twist / (n + 3),
        h.c0 / (n + 1) + h.c1 / (n + 2),
        h.s0 / (n + 1) + h.s1 / (n + 2),
    )


def disc_differential(
    d: Disc, e: Disc, *, solidity: Scalar, lift_slope: Scalar, drag: Scalar, drag_change: Scalar
) -> tuple[FlapMoments, DiscLoads]:
    """Changes of the flap moments and of the loads' coefficients at the state `d` for the change `e` of it.

    `drag` is the profile drag coefficient and `drag_change` its change.
    """
    flow, dflow = _flow(d), _flow_change(d, e)
    h, dh = _sum(flow, _pitch(d)), _sum(dflow, _pitch_change(d, e))
    mean0, cos0, sin0 = _over_blade(h, d.theta0, d.twist, 0)
    mean1, cos1, sin1 = _over_blade(h, d.theta0, d.twist, 1)
    _, cos2, sin2 = _over_blade(h, d.theta0, d.twist, 2)
    dmean0, dcos0, dsin0 = _over_blade(dh, e.theta0, e.twist, 0)
    dmean1, dcos1, dsin1 = _over_blade(dh, e.theta0, e.twist, 1)
    dmean2, dcos2, dsin2 = _over_blade(dh, e.theta0, e.twist, 2)
    x, dx, y, dy = d.mu_x, e.mu_x, d.mu_y, e.mu_y

    lift = mean1 + 0.5 * (x * sin0 + y * cos0)
    dlift = dmean1 + 0.5 * (_product(x, dx, sin0, dsin0) + _product(y, dy, cos0, dcos0))
    lift_c = cos1 + y * mean0 + 0.5 * (x * h.s2 + y * h.c2)
    dlift_c = (
        dcos1 + _product(y, dy, mean0, dmean0) + 0.5 * (_product(x, dx, h.s2, dh.s2) + _product(y, dy, h.c2, dh.c2))
    )
    lift_s = sin1 + x * mean0 + 0.5 * (y * h.s2 - x * h.c2)
    dlift_s = (
        dsin1 + _product(x, dx, mean0, dmean0) + 0.5 * (_product(y, dy, h.s2, dh.s2) - _product(x, dx, h.c2, dh.c2))
    )
    lift_c2 = 0.5 * h.c2 + 0.5 * (y * cos0 - x * sin0)
    dlift_c2 = 0.5 * dh.c2 + 0.5 * (_product(y, dy, cos0, dcos0) - _product(x, dx, sin0, dsin0))
    lift_s2 = 0.5 * h.s2 + 0.5 * (x * cos0 + y * sin0)
    dlift_s2 = 0.5 * dh.s2 + 0.5 * (_product(x, dx, cos0, dcos0) + _product(y, dy, sin0, dsin0))

    f_c, df_c = flow.c0 + 0.5 * flow.c1, dflow.c0 + 0.5 * dflow.c1
    f_s, df_s = flow.s0 + 0.5 * flow.s1, dflow.s0 + 0.5 * dflow.s1
    dlean_s = 0.5 * (
        _product(flow.m0, dflow.m0, sin0, dsin0)
        + _product(flow.s0, dflow.s0, mean0, dmean0)
        + _product(flow.s1, dflow.s1, mean1, dmean1)
    ) + 0.25 * (
        _product(f_c, df_c, h.s2, dh.s2)
        - _product(f_s, df_s, h.c2, dh.c2)
        + _product(flow.s2, dflow.s2, cos0, dcos0)
        - _product(flow.c2, dflow.c2, sin0, dsin0)
    )
    dlean_c = 0.5 * (
        _product(flow.m0, dflow.m0, cos0, dcos0)
        + _product(flow.c0, dflow.c0, mean0, dmean0)
        + _product(flow.c1, dflow.c1, mean1, dmean1)
    ) + 0.25 * (
        _product(f_c, df_c, h.c2, dh.c2)
        + _product(f_s, df_s, h.s2, dh.s2)
        + _product(flow.c2, dflow.c2, cos0, dcos0)
        + _product(flow.s2, dflow.s2, sin0, dsin0)
    )
    dlean_x = _product(flow.m0, dflow.m0, mean1, dmean1) + 0.5 * (
        _product(flow.c0, dflow.c0, cos1, dcos1)
        + _product(flow.c1, dflow.c1, cos2, dcos2)
        + _product(flow.s0, dflow.s0, sin1, dsin1)
        + _product(flow.s1, dflow.s1, sin2, dsin2)
        + 0.5 * (_product(flow.c2, dflow.c2, h.c2, dh.c2) + _product(flow.s2, dflow.s2, h.s2, dh.s2))
    )

    scale = 0.5 * lift_slope * solidity
    profile, dprofile = drag / lift_slope, drag_change / lift_slope
    outer_a, douter_a = lift + 0.5 * lift_c2, dlift + 0.5 * dlift_c2
    outer_b, douter_b = lift - 0.5 * lift_c2, dlift - 0.5 * dlift_c2
    moments = FlapMoments(
        dmean2 + 0.5 * (_product(x, dx, sin1, dsin1) + _product(y, dy, cos1, dcos1)),
        dcos2 + _product(y, dy, mean1, dmean1) + 0.25 * (_product(x, dx, h.s2, dh.s2) + _product(y, dy, h.c2, dh.c2)),
        dsin2 + _product(x, dx, mean1, dmean1) + 0.25 * (_product(y, dy, h.s2, dh.s2) - _product(x, dx, h.c2, dh.c2)),
    )
    loads = DiscLoads(
        scale * dlift,
        scale
        * (
            dlean_s
            - 0.5 * _product(profile, dprofile, x, dx)
            + 0.5 * (_product(d.a0, e.a0, lift_c, dlift_c) - _product(d.a1, e.a1, outer_a, douter_a))
            - 0.25 * _product(d.b1, e.b1, lift_s2, dlift_s2)
        ),
        scale
        * (
            dlean_c
            - 0.5 * _product(profile, dprofile, y, dy)
            - 0.5 * (_product(d.a0, e.a0, lift_s, dlift_s) - _product(d.b1, e.b1, outer_b, douter_b))
            + 0.25 * _product(d.a1, e.a1, lift_s2, dlift_s2)
        ),
        scale * (0.25 * (dprofile * (1.0 + x * x + y * y) + 2.0 * profile * (x * dx + y * dy)) - dlean_x),
    )
    return moments, loads


def inflow_change(
    lam0: Scalar, free_change: Scalar, loss: Scalar, mu_z: Scalar, mu2: Scalar, dmu_z: Scalar, dmu2: Scalar, xp: Backend
) -> Scalar:
    """Change of the momentum inflow when C_T = free - loss lam0 and the flow change (implicit function theorem)."""
    v, _, slope = mass_flow(lam0, mu_z, mu2, xp)
    dv2 = flow_change(lam0, mu_z, mu2, (0.0, dmu_z, dmu2), xp)
    return (free_change - lam0 * dv2 / v) / (2.0 * v + lam0 * slope / v + loss)


def flow_change(lam0: Scalar, mu_z: Scalar, mu2: Scalar, change: tuple[Scalar, Scalar, Scalar], xp: Backend) -> Scalar:
    """Change of `inflow.mass_flow`'s V^2 when (lam0, mu_z, mu^2) change."""
    dlam0, dmu_z, dmu2 = change
    _, _, slope = mass_flow(lam0, mu_z, mu2, xp)
    ring = xp.maximum(0.0, mu_z * (2.0 * lam0 - mu_z))
    dv2 = dmu2 - 2.0 * (lam0 - mu_z) * dmu_z
    if ring:
        dv2 += 4.0 * RING * ring * (lam0 - mu_z) / (lam0 * lam0) * dmu_z
    return dv2 + slope * dlam0


def skew_change(
    lam0: Scalar, mu_x: Scalar, mu_y: Scalar, mu_z: Scalar, change: tuple[Scalar, Scalar, Scalar, Scalar], xp: Backend
) -> tuple[Scalar, Scalar]:
    """Change of `inflow.wake_skew` when (lam0, mu_x, mu_y, mu_z) change."""
    dlam0, dx, dy, dz = change
    sx, sy = wake_skew(lam0, mu_x, mu_y, mu_z, xp)
    through = xp.abs(lam0 - mu_z)
    dthrough = (dlam0 - dz) if lam0 >= mu_z else (dz - dlam0)
    whole = xp.sqrt(mu_x * mu_x + mu_y * mu_y + through * through + 1e-16)
    dwhole = (mu_x * dx + mu_y * dy + through * dthrough) / whole
    below = whole + through
    return (dx - sx * (dwhole + dthrough)) / below, (dy - sy * (dwhole + dthrough)) / below
