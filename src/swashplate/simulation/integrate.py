"""`simulate_open_loop`: fixed-step Runge-Kutta in one compiled loop, from inputs to a `Flight`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from swashplate.engine.equations import SURROUNDINGS, parameter_row
from swashplate.engine.fly import FlightPlan, fly
from swashplate.errors import SwashError
from swashplate.flights.flight import Flight
from swashplate.models.residual import HEADING, facing
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.driving import Inputs, Interpolation, driving_rows
from swashplate.simulation.record import Delays, acting_rows, check_divergence, simulated_flight
from swashplate.simulation.trim import Trim, start_row, surroundings_of_start

if TYPE_CHECKING:
    from swashplate.simulation.sensors import Sensors
import math

from swashplate.arrays import Array

_LARGEST_STEP = 2.5
"""Step times modulus of a mode: beyond 2.8 the Runge-Kutta method of order 4 itself is unstable (Hairer and Wanner
1996, sec. IV.2), so that what it flies is no flight of the vehicle."""


def fastest_mode(vehicle: Vehicle, x: Array, u: Array, environment: Environment) -> complex:
    """The eigenvalue of largest modulus [1/s] at a state (n,) under inputs (m,), by central differences.

    NaN where the equations give nothing finite there.
    """
    numbers, command = vehicle.values(), [float(value) for value in u]

    def rates(at: Array) -> Array:
        by_state = vehicle.rates([float(value) for value in at], command, numbers, environment)
        return np.array([float(value) for value in by_state])

    step = 1e-6 * np.maximum(1.0, np.abs(x))
    steps_apart = np.diag(step)
    try:
        with np.errstate(all="ignore"):
            slopes = [(rates(x + d) - rates(x - d)) / (2.0 * h) for d, h in zip(steps_apart, step, strict=True)]
    except (ArithmeticError, ValueError):  # plain floats divide by zero, or take a root, where a graph gives NaN
        return complex(math.nan)
    matrix = np.array(slopes).T
    if not np.all(np.isfinite(matrix)):
        return complex(math.nan)
    values = np.linalg.eigvals(matrix)
    return complex(values[int(np.argmax(np.abs(values)))])


def check_step(
    vehicle: Vehicle, x: Array, u: Array, environment: Environment, *, rate: float, substeps: int = 1
) -> None:
    """Refuse steps that are too long for the vehicle's fastest mode where a flight begins.

    Args:
        x, u: state (n,) and inputs (m,) there.
        rate: samples per second [Hz].
        substeps: steps per sample.

    Raises:
        SwashError: naming the mode and the rate that it needs.
    """
    mode = fastest_mode(vehicle, x, u, environment)
    needed = abs(mode) / _LARGEST_STEP
    if not needed > rate * substeps:
        return
    shown = f"{mode.real:.3g}" + (f" +- {abs(mode.imag):.3g}j" if mode.imag else "")
    raise SwashError(
        f"{rate * substeps:g} steps a second are too few for the mode {shown} 1/s: the integration would diverge.",
        where=vehicle.card.where,
        channel="rate",
        hint=f"Give {math.ceil(needed)} Hz or more, or {math.ceil(needed / rate)} substeps a sample.",
    )


def simulate_open_loop(
    vehicle: Vehicle,
    inputs: Inputs,
    *,
    start: Trim | Mapping[str, float] | None = None,
    rate: float = 100.0,
    substeps: int = 1,
    interpolation: Interpolation = "held",
    environment: Environment | None = None,
    delays: Delays = None,
    sensors: Sensors | None = None,
    seed: int | None = None,
) -> Flight:
    """Fly a vehicle through given inputs; classical Runge-Kutta of order 4, float64.

    A flight that pitches beyond 80 degrees is integrated with a quaternion; its roll, pitch and yaw are those of it.

    Args:
        vehicle: what flies.
        inputs: a flight, a mapping from input names to series (or numbers) at `rate`, or an array (n, n_inputs).
            Channels "voltage", "wind_north", "wind_east" and "wind_down" replace the environment's constants.
        start: a `Trim`, or states by name (the others as at hover), or None for hover in the first sample's
            surroundings.
        rate: samples and steps per second [Hz].
        substeps: Runge-Kutta steps per sample.
        interpolation: inputs "held" from sample to sample (as a digital controller does) or "linear" between them.
        environment: air, gravity, and wind and voltage where `inputs` has none; by default that of the trim at the
            start, or the vehicle's own (`Environment`).
        delays: from command to action [s], one for all inputs or by name, rounded up to steps; where not given those
            that the vehicle's card knows (`sp.structure` models and identified ones). The flight has the commands.
        sensors: sensor models that turn the true flight into a log; they need a `seed`.
        seed: of the sensors' noise; the same call with the same seed gives the same bits on the same machine.

    Returns:
        The true flight, stream "uniform" (time, all states, inputs, voltage, wind), or what the sensors make of it.

    Raises:
        DivergenceError: with the time, the state that went first and the flight up to there.
        FlightError: where an input is missing or not finite.
        SwashError: steps that are too long for the vehicle's fastest mode at the start.
        CardError: where inputs reach outputs after different times, and `delays` does not say one for each.
    """
    if substeps < 1:
        raise SwashError(f"substeps is {substeps}, expected at least 1.")
    surroundings = surroundings_of_start(vehicle, start, environment)
    time, rows = driving_rows(vehicle, inputs, rate=rate, environment=surroundings, interpolation=interpolation)
    first = surroundings._replace(**dict(zip(SURROUNDINGS, rows[0, len(vehicle.input_names) :], strict=True)))
    x0 = start_row(vehicle, start, first)
    if HEADING in vehicle.state_names:
        vehicle = facing(vehicle, float(x0[vehicle.index(HEADING)]))
    check_step(vehicle, np.asarray(x0), rows[0, : len(vehicle.input_names)], first, rate=rate, substeps=substeps)
    acting = acting_rows(vehicle, rows, rate=rate, delays=delays, start=start, environment=first)
    numbers = parameter_row(vehicle, surroundings)

    plan = FlightPlan(
        np.asarray(x0)[:, None],
        numbers[:, None],
        acting[:, :, None],
        1.0 / (rate * substeps),
        hold=substeps,
        keep=substeps,
        held=interpolation == "held",
    )
    states = fly(vehicle, plan)[0][:, :, 0]
    flight = simulated_flight(
        vehicle,
        time,
        states,
        rows,
        details={
            "rate": rate,
            "substeps": substeps,
            "interpolation": interpolation,
            "gravity": float(surroundings.gravity),
        },
    )
    check_divergence(vehicle, time, states, flight)
    if sensors is None:
        return flight
    from swashplate.simulation.sensors import observe

    if seed is None:
        raise SwashError("sensors need a seed, so that the same call gives the same numbers.", hint="Pass seed=0.")
    return observe(flight, vehicle, sensors=sensors, seed=seed)
