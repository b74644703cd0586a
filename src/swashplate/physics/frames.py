"""Rotations between body axes (forward-right-down) and local axes (north-east-down), Euler angles ZYX."""

from __future__ import annotations

from typing import NamedTuple

from swashplate.physics.backend import Backend, Scalar


class Vector(NamedTuple):
    """Three components in one frame."""

    x: Scalar
    y: Scalar
    z: Scalar

    def __add__(self, other: Vector) -> Vector:  # pyrefly: ignore[bad-override]
        return Vector(self.x + other.x, self.y + other.y, self.z + other.z)

    def cross(self, other: Vector) -> Vector:
        return Vector(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )

    def scaled(self, factor: Scalar) -> Vector:
        return Vector(self.x * factor, self.y * factor, self.z * factor)


class Euler(NamedTuple):
    """Roll, pitch and yaw [rad], ZYX."""

    phi: Scalar
    theta: Scalar
    psi: Scalar


def body_to_local(vector: Vector, attitude: Euler, xp: Backend) -> Vector:
    """R v: body components to local ones (Stevens, Lewis and Johnson 2016, eq. 1.3-18, transposed)."""
    cf, sf = xp.cos(attitude.phi), xp.sin(attitude.phi)
    ct, st = xp.cos(attitude.theta), xp.sin(attitude.theta)
    cp, sp = xp.cos(attitude.psi), xp.sin(attitude.psi)
    a, b, c = vector
    return Vector(
        ct * cp * a + (sf * st * cp - cf * sp) * b + (cf * st * cp + sf * sp) * c,
        ct * sp * a + (sf * st * sp + cf * cp) * b + (cf * st * sp - sf * cp) * c,
        -st * a + sf * ct * b + cf * ct * c,
    )


def local_to_body(vector: Vector, attitude: Euler, xp: Backend) -> Vector:
    """R^T v: local components to body ones."""
    cf, sf = xp.cos(attitude.phi), xp.sin(attitude.phi)
    ct, st = xp.cos(attitude.theta), xp.sin(attitude.theta)
    cp, sp = xp.cos(attitude.psi), xp.sin(attitude.psi)
    a, b, c = vector
    return Vector(
        ct * cp * a + ct * sp * b - st * c,
        (sf * st * cp - cf * sp) * a + (sf * st * sp + cf * cp) * b + sf * ct * c,
        (cf * st * cp + sf * sp) * a + (cf * st * sp - sf * cp) * b + cf * ct * c,
    )


def turned_about_z(attitude: Euler, angle: Scalar, xp: Backend) -> Euler:
    """Euler angles of a frame that is turned by `angle` [rad] about the z axis of a body with this attitude: R Rz."""
    cf, sf = xp.cos(attitude.phi), xp.sin(attitude.phi)
    ct, st = xp.cos(attitude.theta), xp.sin(attitude.theta)
    c, s = xp.cos(angle), xp.sin(angle)
    down_x, down_y, down_z = -st * c + ct * sf * s, st * s + ct * sf * c, ct * cf
    return Euler(
        xp.atan2(down_y, down_z),
        xp.atan2(-down_x, xp.sqrt(down_y * down_y + down_z * down_z)),
        attitude.psi + xp.atan2(cf * s, ct * c + st * sf * s),
    )


def euler_rates(rates: Vector, attitude: Euler, xp: Backend) -> Euler:
    """Rates of the Euler angles [rad/s] from body rates; singular at theta = +-90 deg."""
    p, q, r = rates
    cf, sf = xp.cos(attitude.phi), xp.sin(attitude.phi)
    turning = q * sf + r * cf
    return Euler(
        p + turning * xp.tan(attitude.theta),
        q * cf - r * sf,
        turning / xp.cos(attitude.theta),
    )
