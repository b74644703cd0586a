"""The body's motion from a measured pose: what models are held against."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.filtering.nuisance import Nuisance
from swashplate.flights.conditioning.attitude import euler_from_quaternion
from swashplate.flights.conditioning.local_polynomials import local_polynomials
from swashplate.flights.schema import RATES
from swashplate.identification.core.records import Record
from swashplate.physics.backend import ArrayBackend
from swashplate.physics.frames import Euler, Vector, body_to_local, local_to_body
from swashplate.physics.quaternion import quaternion_of

_XP = ArrayBackend()

PREDICTED = ("x", "y", "z", "u", "v", "w", "phi", "theta", "psi", "p", "q", "r")
"""The body states in the order of every (n, 12) table."""


WINDOW = 0.13
"""Seconds over which the pose is smoothed."""


def samples_smoothed(dt: float, window: float = WINDOW) -> int:
    """How many samples the pose is smoothed over, an odd number."""
    return max(5, 2 * round(window / dt / 2) + 1)


def measured_states(record: Record, nuisance: Nuisance, *, window: float = WINDOW) -> Array:
    """Body states (n, 12) of the centre of gravity from the measured pose, in the order of `PREDICTED`.

    Rates and velocities are slopes of a cubic fitted to the samples within `window` seconds (Savitzky and Golay 1964),
    so each uses samples after its own time too: this is what predictions are held against, never what they start from.
    Rates are a gyroscope's where the record has them, smoothed over five samples.
    """
    names = list(record.output_names)
    pose = record.outputs[:, [names.index(name) for name in ("x", "y", "z", "phi", "theta", "psi")]].copy()
    pose[:, 3] -= float(nuisance.level_phi)
    pose[:, 4] -= float(nuisance.level_theta)
    if float(nuisance.level_psi):
        half = -0.5 * float(nuisance.level_psi)
        c, s = np.cos(half), np.sin(half)
        qw, qx, qy, qz = quaternion_of(Euler(*pose[:, 3:].T), _XP)
        pose[:, 3:] = euler_from_quaternion(
            np.stack([c * qw - s * qz, c * qx + s * qy, c * qy - s * qx, c * qz + s * qw], axis=1)
        )
        pose[:, 5] += 2.0 * np.pi * np.round((record.outputs[:, names.index("psi")] - pose[:, 5]) / (2.0 * np.pi))
    lever = Vector(float(nuisance.lever_x), float(nuisance.lever_y), float(nuisance.lever_z))
    pose[:, :3] -= np.stack(body_to_local(lever, Euler(*pose[:, 3:].T), _XP), axis=1)
    length = samples_smoothed(record.dt, window)
    smooth = local_polynomials(pose, length, 3)
    slope = local_polynomials(pose, length, 3, slope=record.dt)
    phi, theta = smooth[:, 3], smooth[:, 4]
    phi_dot, theta_dot, psi_dot = slope[:, 3], slope[:, 4], slope[:, 5]
    velocity = np.stack(local_to_body(Vector(*slope[:, :3].T), Euler(*smooth[:, 3:].T), _XP), axis=1)
    rates = np.stack(
        [
            phi_dot - psi_dot * np.sin(theta),
            theta_dot * np.cos(phi) + psi_dot * np.cos(theta) * np.sin(phi),
            -theta_dot * np.sin(phi) + psi_dot * np.cos(theta) * np.cos(phi),
        ],
        axis=1,
    )
    if set(RATES) <= set(names):
        gyro = record.outputs[:, [names.index(name) for name in RATES]]
        rates = local_polynomials(gyro, 5, 2)
    return np.concatenate([smooth[:, :3], velocity, smooth[:, 3:], rates], axis=1)


def turned_rows(rows: Array, names: Sequence[str], angles: Array) -> Array:
    """Rows (..., n, names) whose horizontal parts are turned by n angles about the vertical."""
    if "x" not in names or "y" not in names:
        return rows
    i, j = names.index("x"), names.index("y")
    c, s, turned = np.cos(angles), np.sin(angles), rows.copy()
    turned[..., i] = c * rows[..., i] - s * rows[..., j]
    turned[..., j] = s * rows[..., i] + c * rows[..., j]
    return turned
