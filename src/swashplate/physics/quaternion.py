"""Attitude as a unit quaternion, scalar first: where Euler angles have no rates, as a body that tumbles has.

Nothing here needs the length to be one: it cancels in every angle.
"""

from __future__ import annotations

from typing import NamedTuple

from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.frames import Euler, Vector


class Quaternion(NamedTuple):
    """Rotation from body to local axes: w, and x, y, z about forward, right and down."""

    w: Scalar
    x: Scalar
    y: Scalar
    z: Scalar


def quaternion_of(attitude: Euler, xp: Backend) -> Quaternion:
    """The quaternion of Euler angles ZYX (Stevens, Lewis and Johnson 2016, sec. 1.3)."""
    cf, sf = xp.cos(0.5 * attitude.phi), xp.sin(0.5 * attitude.phi)
    ct, st = xp.cos(0.5 * attitude.theta), xp.sin(0.5 * attitude.theta)
    cp, sp = xp.cos(0.5 * attitude.psi), xp.sin(0.5 * attitude.psi)
    return Quaternion(
        cf * ct * cp + sf * st * sp,
        sf * ct * cp - cf * st * sp,
        cf * st * cp + sf * ct * sp,
        cf * ct * sp - sf * st * cp,
    )


def euler_of(rotation: Quaternion, xp: Backend) -> Euler:
    """Euler angles ZYX [rad], roll and yaw within +-pi; at theta = +-90 deg only their sum or difference has a meaning.

    From the entries of the rotation matrix (Stevens, Lewis and Johnson 2016, sec. 1.3), each times the quaternion's
    length squared.
    """
    w, x, y, z = rotation
    ahead_north, ahead_east, ahead_down = w * w + x * x - y * y - z * z, 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)
    right_down, down_down = 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z
    level = xp.sqrt(right_down * right_down + down_down * down_down)
    return Euler(xp.atan2(right_down, down_down), xp.atan2(-ahead_down, level), xp.atan2(ahead_east, ahead_north))


def quaternion_rates(rotation: Quaternion, rates: Vector) -> Quaternion:
    """Rates [1/s] under body rates p, q, r [rad/s]: half the product with (0, p, q, r) (ibid., sec. 1.8)."""
    w, x, y, z = rotation
    p, q, r = rates
    return Quaternion(
        -0.5 * (x * p + y * q + z * r),
        0.5 * (w * p + y * r - z * q),
        0.5 * (w * q + z * p - x * r),
        0.5 * (w * r + x * q - y * p),
    )
