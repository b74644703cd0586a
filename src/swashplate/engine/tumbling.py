"""A vehicle whose attitude is a quaternion: it may pitch through the vertical, where Euler angles have no rates.

Its equations are those of the vehicle: only the rates of roll, pitch and yaw are put aside, on which no other rate
depends. States outside remain Euler angles; `from_euler` and `to_euler` change rows.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Final, NamedTuple, Protocol

import numpy as np

from swashplate.arrays import Array
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend, FloatBackend, Scalar
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Euler, Vector
from swashplate.physics.quaternion import Quaternion, euler_of, quaternion_of, quaternion_rates
from swashplate.physics.rigid_body import RigidBody

_FLOATS = FloatBackend()
_PHI: Final = 6  # where attitude begins in a row
_P: Final = 9  # and where the rates do
_STEEP: Final = math.radians(80.0)


class TumblingBody(NamedTuple):
    """`RigidBody` with a quaternion in place of roll, pitch and yaw."""

    x: Scalar
    y: Scalar
    z: Scalar
    u: Scalar
    v: Scalar
    w: Scalar
    q0: Scalar
    q1: Scalar
    q2: Scalar
    q3: Scalar
    p: Scalar
    q: Scalar
    r: Scalar


class Tumbling(Protocol):
    """A nested state with a tumbling body, whatever else it holds."""

    @property
    def body(self) -> TumblingBody: ...

    def _replace(self, *, body: TumblingBody | RigidBody) -> Any: ...


def tumbling(vehicle: Vehicle) -> Vehicle:
    """The vehicle with a quaternion among its states. Its attitude must be kinematics, as all but linear models' is.

    Only for compiled steps: its card, inputs and parameters are the vehicle's own, its states one more.
    """
    still: RigidBody = vehicle.state.body
    body = TumblingBody._make((*still[:_PHI], 1.0, 0.0, 0.0, 0.0, *still[_P:]))
    count = len(RigidBody._fields)
    return replace(
        vehicle,
        state=vehicle.state._replace(body=body),
        state_names=(*TumblingBody._fields, *vehicle.state_names[count:]),
        state_units=(*vehicle.state_units[:_PHI], *("1",) * 4, *vehicle.state_units[_P:]),
        derivatives=partial(_derivatives, vehicle.derivatives),
        specific_force=partial(_specific_force, vehicle.specific_force),
    )


def _derivatives(
    free: Callable[..., Any],
    state: Tumbling,
    inputs: object,
    par: object,
    env: Environment,
    xp: Backend,
) -> Any:
    body: TumblingBody = state.body
    rates = free(state._replace(body=with_euler_angles(body, xp)), inputs, par, env, xp)
    turned = quaternion_rates(_rotation(body), Vector(body.p, body.q, body.r))
    return rates._replace(body=TumblingBody._make((*rates.body[:_PHI], *turned, *rates.body[_P:])))


def _specific_force(
    free: Callable[..., Vector], state: Tumbling, inputs: object, par: object, env: Environment, xp: Backend
) -> Vector:
    return free(state._replace(body=with_euler_angles(state.body, xp)), inputs, par, env, xp)


def _rotation(body: TumblingBody) -> Quaternion:
    return Quaternion(body.q0, body.q1, body.q2, body.q3)


def with_euler_angles(body: TumblingBody, xp: Backend) -> RigidBody:
    """The body with roll, pitch and yaw, roll and yaw within half a turn."""
    return RigidBody(*body[:_PHI], *euler_of(_rotation(body), xp), body.p, body.q, body.r)


def from_euler(row: Array) -> Array:
    """A state row of the vehicle as one of `tumbling`."""
    rotation = quaternion_of(Euler(*row[_PHI : _PHI + 3].tolist()), _FLOATS)
    return np.concatenate([row[:_PHI], rotation, row[_P:]])


def to_euler(row: Array, before: Array) -> Array:
    """A state row of `tumbling` as one of the vehicle, with roll and yaw counted on from `before`, a row of it."""
    euler = euler_of(Quaternion(*row[_PHI : _PHI + 4].tolist()), _FLOATS)
    roll, _, yaw = before[_PHI:_P].tolist()
    angles = [counted_on(euler.phi, roll), euler.theta, counted_on(euler.psi, yaw)]
    return np.concatenate([row[:_PHI], angles, row[_PHI + 4 :]])


def counted_on(angle: float, before: float) -> float:
    """The angle [rad], whole turns apart, that is nearest to `before`."""
    return angle + 2.0 * math.pi * float(np.rint((before - angle) / (2.0 * math.pi)))


def steep_at(pitch: Array) -> Any:
    """Whether series of pitch [rad], shape (n, ...), come so near to the vertical that Euler angles lose digits, one by
    one of what comes behind: beyond 80 degrees the rates of roll and yaw are six times those of the body and more. What
    is not finite does not."""
    return np.any(np.where(np.isfinite(pitch), np.abs(pitch), 0.0) > _STEEP, axis=0)
