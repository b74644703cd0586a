"""First guesses of a vehicle's whole state from what was measured."""

from __future__ import annotations

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import TrimError
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.records import Record
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.frames import Euler, Vector, body_to_local, local_to_body, turned_about_z
from swashplate.simulation.trim import trim

_SPAN = 0.15
"""Seconds of samples on either side from which a first guess of the velocities is taken."""


_SLOW = 3.0
"""m/s: mean velocity below which a flight is about a hover."""


def mean_velocity(vehicle: Vehicle, record: Record) -> Array:
    """Mean velocity [m/s] of a record ahead and right of the heading and down: what a filter is linearised about.

    Zeros for a flight about a hover, where that has a closed form, without measured positions, and where the vehicle
    has no such steady flight.
    """
    at_rest: Array = np.zeros(3)
    if vehicle.traits.hover is not None or not {"x", "y", "z", "psi"} <= set(record.output_names):
        return at_rest
    places = np.arange(0.0, record.time.size, 10.0)
    value, rate = ({name: rows[:, i] for i, name in enumerate(record.output_names)} for rows in slopes(record, places))
    c, s = np.cos(value["psi"]), np.sin(value["psi"])
    ahead, right = c * rate["x"] + s * rate["y"], c * rate["y"] - s * rate["x"]
    velocity = np.array([ahead.mean(), right.mean(), rate["z"].mean()])
    if np.linalg.norm(velocity) < _SLOW:
        return at_rest
    try:
        trim(vehicle, speed=velocity[0], lateral=velocity[1], climb=-velocity[2])
    except TrimError:
        return at_rest
    return velocity


STEPS, STRIDE = 40, 0.1
"""Newton steps to a trim, and how far each may go [rad]."""


def slopes(record: Record, places: Array) -> tuple[Array, Array]:
    """Measured channels and their rates at some samples, by a straight line through the samples around each."""
    reach = max(2, round(_SPAN / record.dt))
    values, rates = [], []
    for place in places.astype(int):
        low, high = max(0, place - reach), min(record.time.size, place + reach + 1)
        t = record.time[low:high] - record.time[place]
        fit = np.polynomial.polynomial.polyfit(t, record.outputs[low:high], 1)
        values.append(fit[0])
        rates.append(fit[1])
    return np.array(values), np.array(rates)


def slopes_ahead(record: Record) -> tuple[Array, Array]:
    """What `slopes` would say of the first sample of a record that begins at any of its samples but the last few.

    Returns:
        Measured channels and their rates by the line through what follows, each (places, outputs).
    """
    reach = min(max(2, round(_SPAN / record.dt)), record.time.size - 1)
    line = np.linalg.pinv(np.vander(record.dt * np.arange(reach + 1), 2, increasing=True))
    values, rates = np.moveaxis(
        np.lib.stride_tricks.sliding_window_view(record.outputs, reach + 1, axis=0) @ line.T, 2, 0
    )
    return values, rates


def measured_start(
    vehicle: Vehicle,
    output_names: tuple[str, ...],
    parameters: Scalar,
    nuisance: Nuisance,
    *,
    value: Scalar,
    rate: Scalar,
    inputs: Scalar,
    voltage: Scalar,
    xp: Backend,
    running: Scalar = 0.0,
) -> Scalar:
    """A flat state: pose and its rates from the measurement, inner states by `Traits.settled`, where there is one.

    Args:
        parameters, nuisance: numbers, or rows of them for as many states.
        value, rate: measured channels and their time derivatives at the start.
        inputs: commands that reach the vehicle around the start, trims included, (..., inputs).
        running: seconds since the flight's time zero.
        xp: the operations.
    """
    here = {name: value[i] for i, name in enumerate(output_names)}
    moving = {name: rate[i] for i, name in enumerate(output_names)}
    tracked = Euler(here["phi"] - nuisance.level_phi, here["theta"] - nuisance.level_theta, here["psi"])
    attitude = turned_about_z(tracked, -nuisance.level_psi, xp)
    phi, theta = tracked.phi, tracked.theta
    phi_dot, theta_dot, psi_dot = moving["phi"], moving["theta"], moving["psi"]
    forward = phi_dot - psi_dot * xp.sin(theta)
    right = theta_dot * xp.cos(phi) + psi_dot * xp.cos(theta) * xp.sin(phi)
    c, s = xp.cos(nuisance.level_psi), xp.sin(nuisance.level_psi)
    p, q = c * forward - s * right, s * forward + c * right
    r = -theta_dot * xp.sin(phi) + psi_dot * xp.cos(theta) * xp.cos(phi)
    arm = Vector(nuisance.lever_x, nuisance.lever_y, nuisance.lever_z)
    offset = body_to_local(arm, attitude, xp)
    velocity = local_to_body(Vector(moving["x"], moving["y"], moving["z"]), attitude, xp)
    swing = Vector(p, q, r).cross(arm)
    known = {
        "x": here["x"] - offset.x,
        "y": here["y"] - offset.y,
        "z": here["z"] - offset.z,
        "u": velocity.x - swing.x,
        "v": velocity.y - swing.y,
        "w": velocity.z - swing.z,
        "phi": attitude.phi,
        "theta": attitude.theta,
        "psi": attitude.psi,
        "p": p,
        "q": q,
        "r": r,
    }
    settled = vehicle.traits.settled
    if settled is not None:
        known |= settled(
            vehicle.inputs(*(inputs[..., i] for i in range(len(vehicle.input_names)))),
            parameters,
            voltage,
            attitude,
            running,
        )
    entries = [xp.arrays.asarray(known.get(name, 0.0)) for name in vehicle.state_names]
    return xp.arrays.stack(xp.arrays.broadcast_arrays(*entries), axis=-1)


INNER_STEPS, NUDGE = 5, 1e-9
