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


class Inertia(NamedTuple):
    """Mass [kg] and principal moments of inertia [kg m^2]."""

    mass: Scalar
    xx: Scalar
    yy: Scalar
    zz: Scalar


def gravity(mass: Scalar, g: Scalar, attitude: Euler, xp: Backend) -> Vector:
    """Weight in body axes [N] (Fankhauser et al., sec. III-B7)."""
    weight = mass * g
    return Vector(
        -weight * xp.sin(attitude.theta),
        weight * xp.sin(attitude.phi) * xp.cos(attitude.theta),
        weight * xp.cos(attitude.phi) * xp.cos(attitude.theta),
    )


def rigid_body_rates(body: RigidBody, force: Vector, moment: Vector, inertia: Inertia, xp: Backend) -> RigidBody:
    """Time derivative of the rigid-body state under a force [N] and a moment [N m] in body axes at the CG."""
    m, Ixx, Iyy, Izz = inertia
    p, q, r = body.rates
    u, v, w = body.velocity
    position = body_to_local(body.velocity, body.attitude, xp)
    attitude = euler_rates(body.rates, body.attitude, xp)
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
        (moment.x - (Izz - Iyy) * q * r) / Ixx,
        (moment.y - (Ixx - Izz) * p * r) / Iyy,
        (moment.z - (Iyy - Ixx) * p * q) / Izz,
    )
