"""From a log's axes to north-east-down (NED) and forward-right-down (FRD)."""

from __future__ import annotations

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError

_DIRECTIONS = {
    "forward": (1, 0, 0), "back": (-1, 0, 0), "right": (0, 1, 0), "left": (0, -1, 0),
    "north": (1, 0, 0), "south": (-1, 0, 0), "east": (0, 1, 0), "west": (0, -1, 0),
    "down": (0, 0, 1), "up": (0, 0, -1),
}  # fmt: skip


def axes(description: str, *, where: str | None = None) -> Array:
    """The rotation from logged axes to NED (or FRD), from a description of where the logged axes point.

    Args:
        description: three directions, as "forward-left-up" (body) or "north-west-up" (world).

    Returns:
        Matrix A, shape (3, 3): vector in NED (FRD) = A @ logged vector.

    Raises:
        FlightError: where a direction is unknown or the three are not a right-handed set.
    """
    parts = description.lower().split("-")
    matrix = np.array([_DIRECTIONS.get(part, (0, 0, 0)) for part in parts], dtype=np.float64).T
    if matrix.shape != (3, 3) or not np.isclose(np.linalg.det(matrix), 1.0):
        raise FlightError(
            f"'{description}' does not describe right-handed axes.",
            where=where,
            hint=f"Give three of {' '.join(_DIRECTIONS)}, for example 'forward-left-up' or 'north-west-up'.",
        )
    return matrix


def to_local(vectors: Array, world: Array) -> Array:
    """Logged world vectors, shape (n, 3), in NED."""
    return np.asarray(vectors @ world.T + 0.0, dtype=np.float64)  # + 0.0: no negative zeros


def multiply(a: Array, b: Array) -> Array:
    """Hamilton product of scalar-first quaternions, shapes (..., 4) (Diebel, 2006, eq. 108)."""
    aw, ax, ay, az = np.moveaxis(a, -1, 0)
    bw, bx, by, bz = np.moveaxis(b, -1, 0)
    return np.stack(
        (
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ),
        axis=-1,
    )


def _quaternion(matrix: Array) -> Array:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(matrix).as_quat(scalar_first=True), dtype=np.float64)


def attitude(quaternion: Array, *, world: Array, body: Array) -> Array:
    """The attitude FRD -> NED from a logged attitude (logged body -> logged world), scalar first, shape (n, 4).

    A product with two constant quaternions: what the log does to signs and norms stays visible in the result, because
    repairing it is conditioning's work. Where body and world axes turn by the same half turn about x (z up to z down)
    the result is exactly (w, x, -y, -z).
    """
    if np.array_equal(world, body) and np.array_equal(world, np.diag((1.0, -1.0, -1.0))):
        return np.asarray(quaternion * np.array((1.0, 1.0, -1.0, -1.0)), dtype=np.float64)
    left = np.broadcast_to(_quaternion(world), quaternion.shape)
    right = np.broadcast_to(_quaternion(body.T), quaternion.shape)
    return multiply(multiply(left, quaternion), right)


def from_rotation(angles: Array, rotation: str, *, where: str | None = None) -> Array:
    """Scalar-first quaternions from logged angles [rad], shape (n, 3).

    Args:
        rotation: "helical" (rotation vector: axis times angle) or "euler_" and an order such as "euler_xyz"
            (intrinsic rotations about the named axes, in that order).
    """
    from scipy.spatial.transform import Rotation

    order = rotation.removeprefix("euler_").upper()
    if rotation == "helical":
        turned = Rotation.from_rotvec(angles)
    elif rotation.startswith("euler_") and sorted(order) == ["X", "Y", "Z"]:
        turned = Rotation.from_euler(order, angles)
    else:
        raise FlightError(
            f"rotation '{rotation}' is not known for three angles.",
            where=where,
            hint="Give rotation='helical' or an Euler order such as 'euler_xyz'.",
        )
    return np.asarray(turned.as_quat(scalar_first=True), dtype=np.float64)
