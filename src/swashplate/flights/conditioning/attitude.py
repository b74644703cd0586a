"""Attitude: quaternions without sign flips, Euler angles ZYX, and interpolation on the sphere."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.flights.schema import ATTITUDE, QUATERNION
from swashplate.physics.backend import ArrayBackend
from swashplate.physics.frames import Euler
from swashplate.physics.quaternion import quaternion_of
from swashplate.registry import listed

if TYPE_CHECKING:  # half a second to import, and most of what imports this module turns nothing
    from scipy.spatial.transform import Rotation

_UPRIGHT = 1e-7  # rad from the vertical: where SciPy warns of angles that are not unique
_TOO_SHORT = 1e-6  # a quaternion shorter than this has no direction left to normalise


def continuous(quaternion: ArrayLike) -> Array:
    """Unit quaternions whose sign never flips from one sample to the next (q and -q are the same attitude).

    Args:
        quaternion: scalar first, shape (n, 4), any length but zero.

    Raises:
        FlightError: where a quaternion is zero or not a number.
    """
    q = np.asarray(quaternion, dtype=np.float64)
    length = np.linalg.norm(q, axis=1)
    bad = ~(length > _TOO_SHORT) | ~np.isfinite(length)
    if bad.any():
        raise FlightError(
            f"sample {int(np.argmax(bad))} is {q[np.argmax(bad)].tolist()}, expected a quaternion of length 1.",
            channel="qw",
            hint="Drop the samples without tracking first (remove_outliers does).",
        )
    q = q / length[:, None]
    flips = np.where(np.sum(q[1:] * q[:-1], axis=1) < 0.0, -1.0, 1.0)
    return np.asarray(q * np.concatenate([[1.0], np.cumprod(flips)])[:, None], dtype=np.float64)


def rotation(quaternion: ArrayLike) -> Rotation:
    """SciPy rotation (body to local) of scalar-first quaternions, shape (n, 4) or (4,)."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(np.roll(np.asarray(quaternion, dtype=np.float64), -1, axis=-1))


def to_body(quaternion: Array, local: Array) -> Array:
    """Vectors in body axes, shape (n, 3), of vectors in local axes, (n, 3) or (3,), and unit quaternions (n, 4)."""
    v = quaternion[:, 1:]
    twice = 2.0 * np.cross(v, np.broadcast_to(local, v.shape))
    return np.asarray(local - quaternion[:, :1] * twice + np.cross(v, twice), dtype=np.float64)


def euler_from_quaternion(quaternion: ArrayLike) -> Array:
    """Roll, pitch and unwrapped yaw [rad], shape (n, 3), of scalar-first quaternions (n, 4), order ZYX."""
    qw, qx, qy, qz = np.asarray(quaternion, dtype=np.float64).T
    a, b, c, d = qw - qy, qx + qz, qw + qy, qz - qx
    # Half of the sum and of the difference of roll and yaw (Bernardes and Viollet 2022).
    lean, total, apart = 2.0 * np.arctan2(np.hypot(c, d), np.hypot(a, b)), np.arctan2(b, a), np.arctan2(d, c)
    if np.any((lean < _UPRIGHT) | (lean > np.pi - _UPRIGHT)):  # of which one cannot be told at the vertical
        psi, theta, phi = rotation(quaternion).as_euler("ZYX").T
    else:
        phi, psi = ((angle + np.pi) % (2.0 * np.pi) - np.pi for angle in (total - apart, total + apart))
        theta = lean - 0.5 * np.pi
    return np.stack([phi, theta, np.unwrap(psi)], axis=-1)


def quaternion_from_euler(euler: ArrayLike) -> Array:
    """Scalar-first quaternions (n, 4), free of sign flips, of phi, theta, psi [rad], shape (n, 3)."""
    angles = np.atleast_2d(np.asarray(euler, dtype=np.float64))
    return continuous(np.stack(quaternion_of(Euler(*angles.T), ArrayBackend()), axis=-1))


def interpolate(time: ArrayLike, quaternion: ArrayLike, new_time: ArrayLike) -> Array:
    """Attitude at `new_time` [s] by spherical linear interpolation (Shoemake 1985), shape (m, 4).

    Times outside `time` take the nearest end.
    """
    stamps, q = np.asarray(time, dtype=np.float64), continuous(quaternion)
    wanted = np.clip(np.asarray(new_time, dtype=np.float64), stamps[0], stamps[-1])
    if stamps.size == 1:
        return np.repeat(q, wanted.size, axis=0)
    cosine = np.clip(np.sum(q[:-1] * q[1:], axis=1, keepdims=True), 0.0, 1.0)
    across = q[1:] - cosine * q[:-1]
    sine = np.linalg.norm(across, axis=1, keepdims=True)
    across = across / np.where(sine > 0.0, sine, 1.0)  # the second axis of the plane in which the attitude turns
    at = np.clip(np.searchsorted(stamps, wanted, side="right") - 1, 0, stamps.size - 2)
    angle = np.arctan2(sine, cosine)[at] * ((wanted - stamps[at]) / np.diff(stamps)[at])[:, None]
    return continuous(np.cos(angle) * q[at] + np.sin(angle) * across[at])


def attitude_of(flight: Flight) -> Array:
    """The flight's attitude as continuous quaternions (n, 4), from its quaternion or else its Euler angles.

    Raises:
        FlightError: where the flight has neither.
    """
    if all(name in flight for name in QUATERNION):
        return continuous(flight.array(QUATERNION))
    if all(name in flight for name in ATTITUDE):
        return quaternion_from_euler(flight.array(ATTITUDE))
    raise FlightError(
        f"the flight has no attitude: neither {', '.join(QUATERNION)} nor {', '.join(ATTITUDE)}; "
        f"it has {listed(flight.channels)}.",
        where=flight.provenance.source or None,
    )


def with_euler(flight: Flight) -> Flight:
    """The flight with phi, theta and unwrapped psi beside its quaternion."""
    angles = euler_from_quaternion(attitude_of(flight))
    like = QUATERNION[0] if QUATERNION[0] in flight else ATTITUDE[0]
    for name, values in zip(ATTITUDE, angles.T, strict=True):
        flight = flight.with_channel(name, values, like=like)
    return flight
