"""First guesses of a vehicle's whole state from what was measured, differentiable in the parameters."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float, Int

from swashplate.arrays import Array
from swashplate.engine.equations import CONSTANTS, equations_of
from swashplate.errors import TrimError
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.records import Record
from swashplate.jax_on_demand import jax, jnp
from swashplate.models.nesting import leaves
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Euler, Vector, body_to_local, local_to_body, turned_about_z
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.dynamics import jax_backend, rates_function
from swashplate.simulation.steady import assemble, unrest
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


def steady_flight(
    vehicle: Vehicle,
    parameters: tuple[jax.Array, ...],
    voltage: Float[jax.Array, ""],
    velocity: Float[jax.Array, " axes"] | Array | None = None,
) -> tuple[Any, Any]:
    """Flat state and inputs of steady flight in calm air, the nose north, traceable and differentiable.

    Args:
        vehicle, parameters, voltage: what flies.
        velocity: ahead, right and down [m/s], where the hover has no closed form; None hovers.
    """
    if vehicle.traits.hover is not None:
        states, inputs = vehicle.traits.hover(parameters, voltage, jax_backend())
        row = jnp.stack([jnp.asarray(states.get(name, 0.0), dtype=float) for name in vehicle.state_names])
        return row, jnp.stack([jnp.asarray(value, dtype=float) for value in inputs])
    return _trim_by_newton(vehicle, parameters, voltage, jnp.zeros(3) if velocity is None else velocity)


def _trim_by_newton(
    vehicle: Vehicle,
    parameters: tuple[jax.Array, ...],
    voltage: Float[jax.Array, ""],
    velocity: Float[jax.Array, " axes"] | Array,
) -> tuple[Any, Any]:
    """Trim by a fixed count of Newton steps, none of which moves an angle by more than `STRIDE`.

    The steps are not differentiated: one more from where they end, with a constant slope, has the exact derivative
    (the implicit function theorem).
    """
    equations = equations_of(vehicle)
    calm = environment_of(vehicle, parameters=parameters)
    row = jnp.stack([jnp.asarray(0.0)] * 3 + [jnp.asarray(voltage, dtype=float)])
    constants = [getattr(calm, name) for name in CONSTANTS]
    p = jnp.stack([jnp.asarray(value, dtype=float) for value in (*parameters, *constants)])
    course = jnp.concatenate([velocity, jnp.zeros(3)])
    held = dict(vehicle.trim_held)
    limits = zip(vehicle.input_names, vehicle.input_limits, strict=True)
    middle = [0.5 * (low + high) for name, (low, high) in limits if name not in held]
    start = jnp.array([0.0, 0.0, *middle, *list(leaves(vehicle.state))[len(RigidBody._fields) :]])
    frozen, still = jax.lax.stop_gradient(p), jax.lax.stop_gradient(row)

    def newton(_: Int[jax.Array, ""], reached: tuple[Any, Any]) -> tuple[Any, Any]:
        value, slope = unrest(equations, reached[0], course, still, frozen)
        step = jnp.linalg.solve(slope, value)
        return reached[0] - step * jnp.minimum(1.0, STRIDE / jnp.max(jnp.abs(step[: 2 + len(middle)]))), slope

    solved = jax.lax.fori_loop(0, STEPS, newton, (start, jnp.eye(start.shape[0])))
    z, slope = jax.lax.stop_gradient(solved)
    z = z - jnp.linalg.solve(slope, unrest(equations, z, course, row, p)[0])
    return assemble(equations, z, course)


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


def start_state(
    vehicle: Vehicle,
    output_names: tuple[str, ...],
    parameters: tuple[jax.Array, ...],
    nuisance: Nuisance,
    *,
    value: Float[jax.Array, " outputs"],
    rate: Float[jax.Array, " outputs"],
    inputs: Float[jax.Array, " inputs"],
    voltage: Float[jax.Array, ""],
    running: Float[jax.Array, ""] | float = 0.0,
) -> Any:
    """`measured_start`, with the inner states where they would rest (traceable).

    Args:
        value, rate, inputs, voltage, running: as `measured_start` takes them.
    """
    row = measured_start(
        vehicle,
        output_names,
        parameters,
        nuisance,
        value=value,
        rate=rate,
        inputs=inputs,
        voltage=voltage,
        running=running,
        xp=jax_backend(),
    )
    if vehicle.traits.settled is not None:
        return row
    return _at_rest_inside(vehicle, row, inputs, parameters, voltage)


def measured_start(
    vehicle: Vehicle,
    output_names: tuple[str, ...],
    parameters: Any,
    nuisance: Nuisance,
    *,
    value: Float[jax.Array | np.ndarray, "outputs ..."],
    rate: Float[jax.Array | np.ndarray, "outputs ..."],
    inputs: Float[jax.Array | np.ndarray, "... inputs"],
    voltage: Float[jax.Array | np.ndarray, ...],
    xp: Backend,
    running: Float[jax.Array | np.ndarray, ...] | float = 0.0,
) -> Any:
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


def _at_rest_inside(
    vehicle: Vehicle,
    row: Float[jax.Array, " states"],
    inputs: Float[jax.Array, " inputs"],
    parameters: tuple[jax.Array, ...],
    voltage: Float[jax.Array, ""],
) -> Any:
    """The row with disc tilt, bar, inflow, rotor speed and servos where this motion and these inputs hold them.

    Differentiated as `_trim_by_newton` is.
    """
    body, rates = len(RigidBody._fields), rates_function(vehicle)
    still = jax.lax.stop_gradient((row[:body], inputs, parameters, voltage))

    def unrest_inside(
        inner: Float[jax.Array, " inner"],
        body_row: Float[jax.Array, " body"],
        inputs: Float[jax.Array, " inputs"],
        parameters: tuple[jax.Array, ...],
        voltage: Float[jax.Array, ""],
    ) -> Any:
        surroundings = Environment(voltage=voltage)
        return rates(jnp.concatenate([body_row, inner]), inputs, parameters, surroundings)[body:]

    def slope(inner: Float[jax.Array, " inner"]) -> Any:
        jacobian = jax.jacfwd(unrest_inside)(inner, *still)
        # A governor at its stop does not move: without this the slope could not be inverted.
        return jacobian - NUDGE * jnp.eye(inner.shape[0])

    def newton(_: Int[jax.Array, ""], reached: tuple[Any, Any]) -> tuple[Any, Any]:
        here = slope(reached[0])
        return reached[0] - jnp.linalg.solve(here, unrest_inside(reached[0], *still)), here

    template = jnp.array(list(leaves(vehicle.state))[body:])
    solved = jax.lax.fori_loop(0, INNER_STEPS, newton, (template, jnp.eye(template.shape[0])))
    inner, last = jax.lax.stop_gradient(solved)
    inner = inner - jnp.linalg.solve(last, unrest_inside(inner, row[:body], inputs, parameters, voltage))
    return jnp.concatenate([row[:body], inner])


INNER_STEPS, NUDGE = 5, 1e-9
