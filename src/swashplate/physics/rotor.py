"""Forces and moments of one rotor whose thrust follows its tip-path plane (Fankhauser et al., sec. III-B1 to B5)."""

from __future__ import annotations

from typing import NamedTuple

from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.frames import Vector


class TipPathPlane(NamedTuple):
    """Tilt of a tip-path plane: about body x (positive leans right), about body y (positive leans aft) [rad]."""

    alpha: Scalar
    beta: Scalar


def thrust(k_thrust: Scalar, omega: Scalar, density_ratio: Scalar) -> Scalar:
    """Thrust [N] = k Omega^2, k = c_T pi rho R^4 at the card's air density (Fankhauser et al., eq. 3)."""
    return k_thrust * density_ratio * omega * omega


def drag_torque(k_torque: Scalar, omega: Scalar, density_ratio: Scalar) -> Scalar:
    """Rotor drag torque [N m] = k Omega^2, k = c_Q pi rho R^5 at the card's air density (Fankhauser et al., eq. 4)."""
    return k_torque * density_ratio * omega * omega


def thrust_direction(plane: TipPathPlane, xp: Backend) -> Vector:
    """Unit vector of the thrust in body axes: the disc normal Rx(alpha) Ry(beta) (0, 0, -1)."""
    ca, sa = xp.cos(plane.alpha), xp.sin(plane.alpha)
    cb, sb = xp.cos(plane.beta), xp.sin(plane.beta)
    return Vector(-sb, sa * cb, -ca * cb)


def thrust_moment(force: Vector, hub_height: Scalar) -> Vector:
    """Moment r x T [N m] of a thrust force at a hub `hub_height` above the CG (Fankhauser et al., eq. 2)."""
    return Vector(hub_height * force.y, -hub_height * force.x, 0.0)


def flapping_moment(hub_stiffness: Scalar, plane: TipPathPlane) -> Vector:
    """Moment [N m] of the blades' elasticity, as a torsion spring of the whole hub (Fankhauser et al., eq. 6)."""
    return Vector(hub_stiffness * plane.alpha, hub_stiffness * plane.beta, 0.0)


def yaw_moment(torque: Scalar, inertia: Scalar, omega_dot: Scalar, sense: float) -> Vector:
    """Drag and reaction torque on the fuselage [N m] (Fankhauser et al., eqs 4 and 5).

    Both act against the rotor's sense: a rotor that turns clockwise from above (`sense` = +1 about body z, which
    points down) and its acceleration `omega_dot` [rad/s^2] push the fuselage counter-clockwise.
    """
    return Vector(0.0, 0.0, -sense * (torque + inertia * omega_dot))


def gyroscopic_moment(rates: Vector, inertia: Scalar, omega: Scalar, sense: float) -> Vector:
    """Moment [N m] that precessing the rotor's angular momentum takes from the fuselage: -w x (s J Omega e_z)."""
    momentum = sense * inertia * omega
    return Vector(-rates.y * momentum, rates.x * momentum, 0.0)
