"""Newton-Euler equations of one rigid body in body axes (Fankhauser et al., sec. III-A and Fig. 3)."""

from __future__ import annotations

from typing import NamedTuple

from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.frames import Euler, Vector, body_to_local, euler_rates


class RigidBody(NamedTuple):
    """State of a rigid body: local position [m], body velocity [m/s], Euler angles [rad], body rates [rad/s]."""

    x: Scalar
    y: Scalar
    z: Scalar
    u: Scalar
    v: Scalar
    w: Scalar
    phi: Scalar
    theta: Scalar
    psi: Scalar
    p: Scalar
    q: Scalar
    r: Scalar

    @property
    def velocity(self) -> Vector:
        return Vector(self.u, self.v, self.w)

    @property
    def attitude(self) -> Euler:
        return Euler(self.phi, self.theta, self.psi)

    @property
    def rates(self) -> Vector:
        return Vector(self.p, self.q, self.r)


BODY_UNITS = ("m",) * 3 + ("m/s",) * 3 + ("rad",) * 3 + ("rad/s",) * 3
"""Units of `RigidBody`'s states, in their order."""


class Inertia(NamedTuple):
    """Mass [kg] and moments of inertia [kg m^2]; `xz` is None where the axes are principal ones."""

    mass: Scalar
    xx: Scalar
    yy: Scalar
    zz: Scalar
    xz: Scalar | None = None


def gravity(mass: Scalar, g: Scalar, attitude: Euler, xp: Backend) -> Vector:
    """Weight in body axes [N] (Fankhauser et al., sec. III-B7)."""
    weight = mass * g
    return Vector(
        -weight * xp.sin(attitude.theta),
        weight * xp.sin(attitude.phi) * xp.cos(attitude.theta),
        weight * xp.cos(attitude.phi) * xp.cos(attitude.theta),
    )


def rigid_body_rates(body: RigidBody, force: Vector, moment: Vector, inertia: Inertia, xp: Backend) -> RigidBody:
    """Time derivative of the rigid-body state under a force [N] and a moment [N m] in body axes at the CG.

    With `inertia.xz`: Bhandari et al. (2005), eqs 1 to 6, solved for the angular accelerations.
    """
    m, Ixx, Iyy, Izz, Ixz = inertia
    p, q, r = body.rates
    u, v, w = body.velocity
    position = body_to_local(body.velocity, body.attitude, xp)
    attitude = euler_rates(body.rates, body.attitude, xp)
    roll = moment.x - (Izz - Iyy) * q * r
    pitch = moment.y - (Ixx - Izz) * p * r
    yaw = moment.z - (Iyy - Ixx) * p * q
    if Ixz is None:
        pdot, qdot, rdot = roll / Ixx, pitch / Iyy, yaw / Izz
    else:
        roll, yaw = roll + Ixz * p * q, yaw - Ixz * q * r
        determinant = Ixx * Izz - Ixz * Ixz
        pdot = (Izz * roll + Ixz * yaw) / determinant
        qdot = (pitch - Ixz * (p * p - r * r)) / Iyy
        rdot = (Ixz * roll + Ixx * yaw) / determinant
    return RigidBody(
        position.x,
        position.y,
        position.z,
        force.x / m - q * w + r * v,
        force.y / m - r * u + p * w,
        force.z / m - p * v + q * u,
        attitude.phi,
        attitude.theta,
        attitude.psi,
        pdot,
        qdot,
        rdot,
    )
