"""The stabilizer bar and the upper rotor that it steers (Fankhauser et al., sec. III-C1)."""

from __future__ import annotations

from typing import NamedTuple

from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.frames import Euler
from swashplate.physics.rotor import TipPathPlane


class StabilizerBar(NamedTuple):
    """Roll and pitch of the bar's plane against the local level, in the helicopter's heading [rad]."""

    eta: Scalar
    zeta: Scalar


def phase_lag(k_zeta: Scalar, o_zeta: Scalar, omega: Scalar) -> Scalar:
    """Offset of the phase lag from the mechanical design angle [rad], linear in rotor speed (eqs 12 and 21)."""
    return k_zeta * omega + o_zeta


def stabilizer_bar_rates(
    bar: StabilizerBar, attitude: Euler, psi_dot: Scalar, *, tau_f_upper: Scalar, heading_transport: Scalar
) -> StabilizerBar:
    """Rates of the bar's angles [rad/s]: first-order following of the fuselage (Fankhauser et al., eq. 8).

    The printed equation lets the bar's tilt turn with the heading. A bar that keeps its plane in space instead moves
    by (zeta, -eta) psi_dot in heading axes; `heading_transport` = 1 adds that, 0 is the paper.
    """
    carried = heading_transport * psi_dot
    return StabilizerBar(
        (attitude.phi - bar.eta) / tau_f_upper + carried * bar.zeta,
        (attitude.theta - bar.zeta) / tau_f_upper - carried * bar.eta,
    )


def upper_tip_path_plane(
    bar: StabilizerBar,
    attitude: Euler,
    *,
    linkage: Scalar,
    lag: Scalar,
    mixing: str,
    xp: Backend,
    linkage_asymmetry: Scalar = 0.0,
) -> TipPathPlane:
    """Tilt of the upper rotor from the bar's tilt in body axes (Fankhauser et al., eqs 9 to 11).

    A lag in the upper rotor's sense (counter-clockwise from above) turns the tilt vector by -lag about body z
    (`mixing` = "rotation"). The paper prints a plus in (11) (`mixing` = "as_printed"), which is no rotation. Not in the
    paper: `linkage_asymmetry` a lets the bar's roll tilt act by 1 + a and its pitch tilt by 1 - a times the linkage.
    """
    alpha_bar = (1.0 + linkage_asymmetry) * (bar.eta - attitude.phi)
    beta_bar = (1.0 - linkage_asymmetry) * (bar.zeta - attitude.theta)
    c, s = xp.cos(lag), xp.sin(lag)
    sign = 1.0 if mixing == "as_printed" else -1.0
    return TipPathPlane(
        linkage * (alpha_bar * c + beta_bar * s),
        linkage * (beta_bar * c + sign * alpha_bar * s),
    )
