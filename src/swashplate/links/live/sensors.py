"""What the page's pilot reads: the sensors that a fit identified, where the card has them; otherwise the states."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.graph import Graph
from swashplate.engine.roots import require_casadi
from swashplate.filtering.nuisance import Nuisance, tracked_pose
from swashplate.flights.schema import POSITION, RATES
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend, CasadiBackend, FloatBackend, Scalar
from swashplate.physics.frames import Vector, body_to_local, local_to_body
from swashplate.physics.rigid_body import RigidBody

BODY = len(RigidBody._fields)
"""States that sensors show; they come first in a vehicle's row."""
PLACED = ("lever_x", "lever_y", "lever_z", "level_phi", "level_theta", "level_psi")
"""Numbers of a record that say what is tracked, as of `Nuisance`."""


class TrackedSensors(NamedTuple):
    """What is tracked, and the noise of one reading.

    Attributes:
        placed: the numbers of `PLACED` [m, rad].
        sigma: standard deviations, one for each state of the body [its unit].
    """

    placed: tuple[float, ...] = (0.0,) * len(PLACED)
    sigma: tuple[float, ...] = (0.0,) * BODY

    def read(self, x: Array) -> Array:
        """A state row as they show it, without noise."""
        if not any(self.placed):
            return x
        tracked = tracked_body(RigidBody(*x[:BODY].tolist()), _of_record(self.placed), FloatBackend())
        return np.concatenate([tracked, x[BODY:]])

    def __str__(self) -> str:
        if not any((*self.placed, *self.sigma)):
            return "the true states: its card has no identified sensors"
        lever = ", ".join(f"{1e3 * part:.0f}" for part in self.placed[:3])
        level = ", ".join(f"{part:.1f}" for part in np.degrees(self.placed[3:]))
        noise = dict(zip(RigidBody._fields, 1e3 * np.array(self.sigma), strict=True))
        return (
            f"identified sensors: a point ({lever}) mm ahead, right and below, axes turned by ({level}) deg in roll, "
            f"pitch and heading; noise {noise['x']:.2g} mm, {noise['phi']:.2g} mrad (heading {noise['psi']:.2g}), "
            f"rates {noise['p']:.2g} mrad/s, velocities none"
        )


def sensors_of(vehicle: Vehicle) -> TrackedSensors:
    """Those that a fit to records left on the card; the true states where there is none."""
    record, noise = (vehicle.card.observer.get(section, {}) for section in ("nuisance", "noise"))
    angle = noise.get("sensor_angle", 0.0)
    sigma = dict.fromkeys(POSITION, noise.get("sensor_position", 0.0))
    sigma |= {"phi": angle, "theta": angle, "psi": noise.get("sensor_heading", 0.0) or angle}
    sigma |= dict.fromkeys(RATES, noise.get("sensor_rate", 0.0))
    return TrackedSensors(
        tuple(float(record.get(name, 0.0)) for name in PLACED),
        tuple(float(sigma.get(name, 0.0)) for name in RigidBody._fields),
    )


def tracked_body(body: RigidBody, record: Nuisance, xp: Backend) -> RigidBody:
    """Place, attitude and velocity of what is tracked; rates are a gyroscope's, in the vehicle's axes."""
    place, attitude = tracked_pose(Vector(body.x, body.y, body.z), body.attitude, record, xp)
    moving = body.velocity + body.rates.cross(Vector(record.lever_x, record.lever_y, record.lever_z))
    velocity = local_to_body(body_to_local(moving, body.attitude, xp), attitude, xp)
    return RigidBody(*place, *velocity, *attitude, *body.rates)


def traced_sensors() -> Graph:
    """`tracked_body` as a CasADi function of the body's states and the numbers of `PLACED`."""
    casadi = require_casadi()
    x, s = casadi.SX.sym("x", BODY), casadi.SX.sym("s", len(PLACED))
    tracked = tracked_body(RigidBody(*casadi.vertsplit(x)), _of_record(casadi.vertsplit(s)), CasadiBackend())
    return casadi.Function("sensors", [x, s], [casadi.densify(casadi.vertcat(*tracked))], {"cse": True})


def _of_record(placed: Sequence[Scalar]) -> Nuisance:
    return Nuisance()._replace(**dict(zip(PLACED, placed, strict=True)))
