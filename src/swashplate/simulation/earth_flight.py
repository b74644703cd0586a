"""A vehicle over an Earth that is round and turns: its own equations, carried in Earth-fixed axes.

With v the velocity over the Earth in body axes, w the body's rates against the stars and W those of the Earth,

    dv/dt = F / m - (w + W) x v + g,    with the centrifugal part in g,

of which the vehicle's equations give F / m - w x v where its gravity is left out (Stevens, Lewis and Johnson 2016,
eq. 1.7-16). Attitude is a quaternion from body to Earth-fixed axes; the equations see roll, pitch and yaw against
north, east and down where the vehicle is, and their height over the origin.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from swashplate.arrays import Array
from swashplate.engine.tumbling import Tumbling, TumblingBody, tumbling
from swashplate.models.vehicle import Vehicle
from swashplate.physics.atmosphere import density_at
from swashplate.physics.backend import Backend, FloatBackend, Scalar
from swashplate.physics.earth import Earth, acceleration, geodetic, local_axes, place
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Euler, Vector, body_to_local
from swashplate.physics.quaternion import Quaternion, quaternion_rates
from swashplate.physics.rigid_body import RigidBody

PLACES = {"latitude": "deg", "longitude": "deg", "altitude": "m"}
"""Channels of a flight over the Earth beside the vehicle's own, with their units."""

_FLOATS = FloatBackend()
_PHI, _P = 6, 9


def over_earth(vehicle: Vehicle, earth: Earth) -> Vehicle:
    """The vehicle with x, y, z in Earth-fixed axes [m], a quaternion from body to these, and u, v, w as they were."""
    anywhere = replace(earth, latitude=0.0, longitude=0.0)  # where it begins is no part of the equations
    return replace(
        tumbling(vehicle),
        derivatives=partial(_derivatives, vehicle.derivatives, anywhere),
        specific_force=partial(_specific_force, vehicle.specific_force, anywhere),
    )


def _seen(body: TumblingBody, earth: Earth, xp: Backend) -> tuple[RigidBody, Scalar, Vector]:
    """The body against the local vertical, its altitude above the ellipsoid [m], and down in Earth-fixed axes."""
    at, turn = Vector(body.x, body.y, body.z), Quaternion(body.q0, body.q1, body.q2, body.q3)
    latitude, longitude, altitude = geodetic(earth, at, xp)
    axes = local_axes(latitude, longitude, xp)
    ahead, right, below = (_turned(turn, Vector(*unit)) for unit in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
    north, east, down = axes
    level = xp.sqrt(_dot(down, right) ** 2 + _dot(down, below) ** 2)
    attitude = Euler(
        xp.atan2(_dot(down, right), _dot(down, below)),
        xp.atan2(-_dot(down, ahead), level),
        xp.atan2(_dot(east, ahead), _dot(north, ahead)),
    )
    local = RigidBody(0.0, 0.0, earth.altitude - altitude, body.u, body.v, body.w, *attitude, body.p, body.q, body.r)
    return local, altitude, down


def _dot(one: Vector, other: Vector) -> Scalar:
    return one.x * other.x + one.y * other.y + one.z * other.z


def _turned(turn: Quaternion, vector: Vector) -> Vector:
    """From body to Earth-fixed axes; the quaternion's length cancels."""
    w, x, y, z = turn
    axis, size = Vector(x, y, z), w * w + x * x + y * y + z * z
    once = axis.cross(vector)
    return vector + (once.scaled(w) + axis.cross(once)).scaled(2.0 / size)


def _inverse(turn: Quaternion) -> Quaternion:
    return Quaternion(turn.w, -turn.x, -turn.y, -turn.z)


def _air(env: Environment, earth: Earth, altitude: Scalar, xp: Backend) -> Environment:
    return env._replace(air_density=density_at(altitude, xp)) if earth.standard_air else env


def _derivatives(
    free: Callable[..., Any],
    earth: Earth,
    state: Tumbling,
    inputs: object,
    par: object,
    env: Environment,
    xp: Backend,
) -> Any:
    body: TumblingBody = state.body
    turn = Quaternion(body.q0, body.q1, body.q2, body.q3)
    local, altitude, down = _seen(body, earth, xp)
    air = _air(env, earth, altitude, xp)._replace(gravity=0.0)
    rates = free(state._replace(body=local), inputs, par, air, xp)
    pull = acceleration(earth, Vector(body.x, body.y, body.z), down, env.gravity, xp)
    spin = _turned(_inverse(turn), Vector(0.0, 0.0, earth.spin))
    v = Vector(body.u, body.v, body.w)
    more = _turned(_inverse(turn), pull) + spin.cross(v).scaled(-1.0)
    turning = quaternion_rates(turn, Vector(body.p, body.q, body.r) + spin.scaled(-1.0))
    speeds = Vector(rates.body.u, rates.body.v, rates.body.w) + more
    made = TumblingBody._make((*_turned(turn, v), *speeds, *turning, *rates.body[_P:]))
    return rates._replace(body=made)


def _specific_force(
    free: Callable[..., Vector],
    earth: Earth,
    state: Tumbling,
    inputs: object,
    par: object,
    env: Environment,
    xp: Backend,
) -> Vector:
    local, altitude, _ = _seen(state.body, earth, xp)
    return free(state._replace(body=local), inputs, par, _air(env, earth, altitude, xp), xp)


# ---- rows ----------------------------------------------------------------------------------------------------------
def to_earth(row: Array, earth: Earth) -> Array:
    """A state row of the vehicle, in local axes at the origin, as one of `over_earth`."""
    north, east, down = (np.array(axis) for axis in local_axes(earth.latitude, earth.longitude, _FLOATS))
    axes = np.stack([north, east, down], axis=1)
    origin = np.array(place(earth, earth.latitude, earth.longitude, earth.altitude, _FLOATS))
    attitude = Euler(*row[_PHI:_P].tolist())
    turn = np.stack(
        [axes @ np.array(body_to_local(Vector(*unit), attitude, _FLOATS)) for unit in np.eye(3).tolist()], axis=1
    )
    rotation = np.roll(Rotation.from_matrix(turn).as_quat(), 1)
    return np.concatenate([origin + axes @ row[:3], row[3:_PHI], rotation, row[_P:]])


def from_earth(rows: Array, earth: Earth) -> tuple[Array, Array]:
    """Rows of `over_earth` as those of the vehicle, x, y, z in the local axes of the origin and attitude against the
    vertical where it is; and latitude, longitude [deg] and altitude [m], shape (n, 3)."""
    axes = np.stack([np.array(axis) for axis in local_axes(earth.latitude, earth.longitude, _FLOATS)], axis=1)
    origin = np.array(place(earth, earth.latitude, earth.longitude, earth.altitude, _FLOATS))
    made, places = [], []
    for row in rows:
        body = TumblingBody(*row[: len(TumblingBody._fields)].tolist())
        local, _, _ = _seen(body, earth, _FLOATS)
        latitude, longitude, altitude = geodetic(earth, Vector(body.x, body.y, body.z), _FLOATS)
        places.append((np.degrees(latitude), np.degrees(longitude), altitude))
        at = axes.T @ (row[:3] - origin)
        made.append(np.concatenate([at, row[3:_PHI], np.array(local.attitude), row[_PHI + 4 :]]))
    states = np.array(made)
    for column in (_PHI, _PHI + 2):
        states[:, column] = np.unwrap(states[:, column])
    return states, np.array(places)
