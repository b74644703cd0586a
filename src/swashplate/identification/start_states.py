"""First guesses of a vehicle's whole state from what was measured, differentiable in the parameters."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np

from swashplate.flights.flight import Array
from swashplate.identification.records import Record
from swashplate.identification.stochastic import Nuisance
from swashplate.physics.drive_train import steady_speed
from swashplate.physics.environment import LABORATORY_GRAVITY
from swashplate.physics.frames import Euler, Vector, body_to_local, local_to_body, turned_about_z
from swashplate.simulation.dynamics import jax_backend
from swashplate.vehicles.vehicle import Vehicle

_SPAN = 0.15
"""Seconds of samples on either side from which a first guess of the velocities is taken."""


def hover(vehicle: Vehicle, parameters: Any, voltage: Any) -> tuple[Any, Any]:
    """Flat state and inputs of the coaxial helicopter's hover, in closed form.

    Both torques balance and both thrusts carry the weight; linearising here needs no iteration.
    """
    p = parameters
    ratio = p.k_torque_lower / p.k_torque_upper
    omega_lower = jnp.sqrt(p.mass * LABORATORY_GRAVITY / (p.k_thrust_lower + p.k_thrust_upper * ratio))
    omega_upper = omega_lower * jnp.sqrt(ratio)
    sag = p.k_drive_voltage * (voltage - p.voltage_nominal)
    x = jnp.zeros(len(vehicle.state_names))
    x = x.at[vehicle.index("omega_lower")].set(omega_lower).at[vehicle.index("omega_upper")].set(omega_upper)
    u = jnp.stack(
        [
            (omega_lower - p.o_drive_lower - sag) / p.k_drive_lower,
            (omega_upper - p.o_drive_upper - sag) / p.k_drive_upper,
            jnp.zeros(()),
            jnp.zeros(()),
        ]
    )
    return x, u


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


def start_state(
    vehicle: Vehicle,
    output_names: tuple[str, ...],
    parameters: Any,
    nuisance: Nuisance,
    *,
    value: Any,
    rate: Any,
    inputs: Any,
    voltage: Any,
) -> Any:
    """A flat state: pose and its rates from the measurement, rotor speeds steady, bar aligned with the fuselage.

    Args:
        value, rate: measured channels and their time derivatives at the start.
        inputs: commands that reach the vehicle around the start, trims included.
    """
    xp = jax_backend()
    here = {name: value[i] for i, name in enumerate(output_names)}
    moving = {name: rate[i] for i, name in enumerate(output_names)}
    tracked = Euler(here["phi"] - nuisance.level_phi, here["theta"] - nuisance.level_theta, here["psi"])
    attitude = turned_about_z(tracked, -nuisance.level_psi, xp)
    phi, theta = tracked.phi, tracked.theta
    phi_dot, theta_dot, psi_dot = moving["phi"], moving["theta"], moving["psi"]
    forward = phi_dot - psi_dot * jnp.sin(theta)
    right = theta_dot * jnp.cos(phi) + psi_dot * jnp.cos(theta) * jnp.sin(phi)
    c, s = jnp.cos(nuisance.level_psi), jnp.sin(nuisance.level_psi)
    p, q = c * forward - s * right, s * forward + c * right
    r = -theta_dot * jnp.sin(phi) + psi_dot * jnp.cos(theta) * jnp.cos(phi)
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
        "eta_bar": attitude.phi,
        "zeta_bar": attitude.theta,
    }
    for side in ("lower", "upper"):
        if f"motor_{side}" not in vehicle.input_names:
            continue
        known[f"omega_{side}"] = steady_speed(
            inputs[vehicle.input_names.index(f"motor_{side}")],
            voltage,
            k=getattr(parameters, f"k_drive_{side}"),
            o=getattr(parameters, f"o_drive_{side}"),
            k_voltage=parameters.k_drive_voltage,
            nominal=parameters.voltage_nominal,
        )
    return jnp.stack([jnp.asarray(known.get(name, 0.0)) for name in vehicle.state_names])
