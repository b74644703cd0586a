"""Induced flow through a rotor: momentum theory in every flow state, gradients over the disc, dynamic inflow.

Dimensionless (by Omega R), counter-clockwise rotor, lam0 + x (lam_c cos + lam_s sin) down through the disc positive.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.blade_element import FlapMoments

RING = 0.125
"""Weight of the recirculation term: the least that leaves one induced velocity for every thrust and descent."""
NEWTON_STEPS = 9
_TINY = 1e-16
APPARENT_GRADIENT = 16.0 / (45.0 * math.pi)
"""Air that a gradient of the inflow moves along, in Pitt and Peters' theory."""


class Inflow(NamedTuple):
    """Mean and gradient of the induced flow."""

    lam0: Scalar
    lam_c: Scalar
    lam_s: Scalar


def mass_flow(lam0: Scalar, mu_z: Scalar, mu2: Scalar, xp: Backend) -> tuple[Scalar, Scalar, Scalar]:
    """Resultant flow V through the disc, as (V, V^2 and its slope by lam0).

    V^2 = mu^2 + (lam0 - mu_z)^2 + ring (Glauert 1926, with a term of ours). Glauert's momentum theory has no answer,
    or three, where a disc sinks through its own wake (0 < mu_z < 2 lam0). There the ring term
    (1/8) [mu_z (2 lam0 - mu_z) / lam0]^2 stands for the air that goes round with the vortex ring. It vanishes in hover,
    climb and windmilling, and 1/8 is the least weight with which thrust grows with lam0 everywhere. It is no model of
    the vortex ring's unsteadiness: between half and twice the hover's induced velocity of sink it follows the mean of
    measurements (Leishman 2006, eq. 2.96) within 0.45 of that velocity, and cards are not to be trusted there.
    """
    through = lam0 - mu_z
    square = xp.maximum(lam0 * lam0, _TINY)
    ring = xp.maximum(0.0, mu_z * (2.0 * lam0 - mu_z))
    v2 = mu2 + through * through + RING * ring * ring / square + _TINY
    slope = 2.0 * through + RING * ring * (4.0 * mu_z - 2.0 * ring * lam0 / square) / square
    return xp.sqrt(v2), v2, slope


def momentum_inflow(free: Scalar, loss: Scalar, mu_z: Scalar, mu2: Scalar, xp: Backend) -> Scalar:
    """lam0 with which 2 V lam0 equals the thrust C_T = free - loss lam0.

    Newton's method from the answer in still air; seven steps reach rounding for |mu_z| up to 0.2, any advance ratio and
    either sign of thrust (tested), because the equation rises everywhere.
    """
    size = xp.abs(free)
    start = 0.25 * (xp.sqrt(loss * loss + 8.0 * size) - loss)
    start = xp.where(free < 0.0, -start, start)

    def residual(lam0: Scalar) -> tuple[Scalar, Scalar]:
        v, _, slope = mass_flow(lam0, mu_z, mu2, xp)
        return 2.0 * lam0 * v + loss * lam0 - free, 2.0 * v + lam0 * slope / v + loss

    return xp.newton(residual, start, steps=NEWTON_STEPS)


def wake_skew(lam0: Scalar, mu_x: Scalar, mu_y: Scalar, mu_z: Scalar, xp: Backend) -> tuple[Scalar, Scalar]:
    """tan(chi/2) of the wake's skew angle chi as a vector in the disc: ahead and right, smooth through hover."""
    through = xp.abs(lam0 - mu_z)
    speed = xp.sqrt(mu_x * mu_x + mu_y * mu_y + through * through + _TINY)
    return mu_x / (speed + through), mu_y / (speed + through)


def glauert_gradient(lam0: Scalar, skew: tuple[Scalar, Scalar]) -> Inflow:
    """More inflow at the rear of the disc: lam0 tan(chi/2) against the flight (Coleman, Feingold and Stempin 1945)."""
    return Inflow(lam0, lam0 * skew[0], -lam0 * skew[1])


_COUPLING = 15.0 * math.pi / 64.0


def gradient_flow(lam0: Scalar, mu_z: Scalar, mu2: Scalar, v: Scalar) -> Scalar:
    """Flow parameter of the gradients: (mu^2 + (lam0 - mu_z)(2 lam0 - mu_z)) / V (Pitt and Peters 1981)."""
    return (mu2 + (lam0 - mu_z) * (2.0 * lam0 - mu_z)) / v


def pitt_peters_rates(
    inflow: Inflow,
    CT: Scalar,
    moments: FlapMoments,
    tip_path_rates: tuple[Scalar, Scalar],
    skew: tuple[Scalar, Scalar],
    flows: tuple[Scalar, Scalar],
    *,
    wake_distortion: Scalar,
    solidity: Scalar,
    lift_slope: Scalar,
) -> Inflow:
    """d/d(Omega t) of dynamic inflow: M lam' + V L^-1 (lam - K_R w) = loading (Pitt and Peters 1981; K_R: Keller 1996).

    Args:
        inflow: the states.
        CT, moments: what the blades carry now; the moments with the tip-path plane's rates in them.
        tip_path_rates: (p, q) in space, w of the wake's distortion.
        skew: `wake_skew`.
        flows: V and `gradient_flow`.
        wake_distortion: K_R.
    """
    p, q = tip_path_rates
    c, s = skew[0], -skew[1]
    X2 = c * c + s * s
    det = 1.0 - X2 + _COUPLING * _COUPLING * X2
    e0, ec, es = inflow.lam0, inflow.lam_c - wake_distortion * q, inflow.lam_s - wake_distortion * p
    along = c * ec + s * es
    # L^-1 in shaft axes: the mean couples with the gradient along the flight only.
    across = 0.5 / (1.0 + X2)
    turned = 0.5 * (2.0 - _COUPLING * _COUPLING) / (det * (1.0 + X2)) * along
    mean = (2.0 * (1.0 - X2) * e0 + _COUPLING * along) / det
    grad_c = -_COUPLING * c * e0 / det + across * ec + turned * c
    grad_s = -_COUPLING * s * e0 / det + across * es + turned * s
    load = 0.25 * lift_slope * solidity  # C_1c = (a sigma / 4) M_c
    apparent = 128.0 / (75.0 * math.pi)
    return Inflow(
        (CT - flows[0] * mean) / apparent,
        (load * moments.cos - flows[1] * grad_c) / APPARENT_GRADIENT,
        (load * moments.sin - flows[1] * grad_s) / APPARENT_GRADIENT,
    )
