"""The lower rotor: swashplate tilt with phase lag, flap-back, coning and rotor damping (Fankhauser et al., III-C2)."""

from __future__ import annotations

from typing import NamedTuple

from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.frames import Vector
from swashplate.physics.rotor import TipPathPlane


class FlapResponse(NamedTuple):
    """Tilt of the lower tip-path plane to speed and rates.

    The first six are the paper's quadratic terms [rad s^2/m^2, rad s^2]; the linear ones [rad s/m, rad s] are not in
    the paper: flap-back is linear in the advance ratio at low speed, and rotor damping in the rate.
    """

    a_alpha_u: Scalar
    a_alpha_v: Scalar
    a_alpha_p: Scalar
    a_beta_u: Scalar
    a_beta_v: Scalar
    a_beta_q: Scalar
    a_alpha_u_linear: Scalar
    a_alpha_v_linear: Scalar
    a_alpha_p_linear: Scalar
    a_beta_u_linear: Scalar
    a_beta_v_linear: Scalar
    a_beta_q_linear: Scalar


def swashplate_tilt(
    servo_roll: Scalar,
    servo_pitch: Scalar,
    *,
    linkage: Scalar,
    lag: Scalar,
    mixing: str,
    xp: Backend,
    linkage_asymmetry: Scalar = 0.0,
    phase_asymmetry: Scalar = 0.0,
) -> TipPathPlane:
    """Steady tilt that the servos ask for [rad] (Fankhauser et al., eqs 13 and 14).

    Commands (+1, +1) ask for a lean to the right and forward, the vector (1, -1) in (alpha, beta). The lag turns it in
    the lower rotor's sense, clockwise from above, by +lag about body z (`mixing` = "rotation"). The paper prints a
    minus in (13) (`mixing` = "as_printed"); that pair is no rotation and singular at 45 deg.

    Not in the paper: `linkage_asymmetry` a gives the roll servo 1 + a and the pitch servo 1 - a times the linkage,
    `phase_asymmetry` d [rad] turns the roll servo's tilt by lag + d and the pitch servo's by lag - d: what a bent lever
    or two unlike servos do. Zeros give the paper's pair.
    """
    sign = -1.0 if mixing == "as_printed" else 1.0
    roll, pitch = (1.0 + linkage_asymmetry) * servo_roll, (1.0 - linkage_asymmetry) * servo_pitch
    of_roll, of_pitch = lag + phase_asymmetry, lag - phase_asymmetry
    return TipPathPlane(
        linkage * (roll * xp.cos(of_roll) + sign * pitch * xp.sin(of_pitch)),
        linkage * (roll * xp.sin(of_roll) - pitch * xp.cos(of_pitch)),
    )


def lower_rotor_rates(
    plane: TipPathPlane,
    commanded: TipPathPlane,
    air_velocity: Vector,
    rates: Vector,
    *,
    tau_f_lower: Scalar,
    flap: FlapResponse,
    turning: Scalar,
    xp: Backend,
) -> TipPathPlane:
    """Rates of the lower tip-path plane's tilt [rad/s] (Fankhauser et al., eqs 13 and 14).

    `turning` is the share of the tilt that the rotor takes up: 1 in flight, 0 at rest.

    1/tau multiplies the whole bracket. Speed tilts the disc away from the motion (speed stability) and, through
    coning and inflow, across it; a body rate leaves the disc behind (rotor damping).
    """
    u, v = air_velocity.x, air_velocity.y
    p, q = rates.x, rates.y
    uu, vv, pp, qq = u * xp.abs(u), v * xp.abs(v), p * xp.abs(p), q * xp.abs(q)
    away_alpha = (
        flap.a_alpha_v * vv
        + flap.a_alpha_u * uu
        + flap.a_alpha_p * pp
        + flap.a_alpha_v_linear * v
        + flap.a_alpha_u_linear * u
        + flap.a_alpha_p_linear * p
    )
    away_beta = (
        -flap.a_beta_u * uu
        + flap.a_beta_v * vv
        + flap.a_beta_q * qq
        - flap.a_beta_u_linear * u
        + flap.a_beta_v_linear * v
        + flap.a_beta_q_linear * q
    )
    return TipPathPlane(
        (turning * (commanded.alpha - away_alpha) - plane.alpha) / tau_f_lower,
        (turning * (commanded.beta - away_beta) - plane.beta) / tau_f_lower,
    )
