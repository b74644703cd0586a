"""`simulate`: fixed-step Runge-Kutta in one compiled loop, from inputs to a `Flight`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float, Int

from swashplate.arrays import Array
from swashplate.engine.equations import SURROUNDINGS, Equations, equations_of, parameter_row
from swashplate.errors import SwashError
from swashplate.flights.flight import Flight
from swashplate.jax_on_demand import jax, jit, jnp
from swashplate.models.residual import HEADING, facing
from swashplate.models.vehicle import Vehicle
from swashplate.physics.earth import Earth
from swashplate.physics.environment import Environment
from swashplate.simulation.compilation import QUICK_FLIGHT, lengthened, shared_length
from swashplate.simulation.driving import Inputs, Interpolation, driving_rows
from swashplate.simulation.dynamics import enable_double_precision, row_rates
from swashplate.simulation.earth_flight import PLACES, from_earth, over_earth, to_earth
from swashplate.simulation.late import Delays, acting_rows
from swashplate.simulation.record import check_divergence, simulated_flight
from swashplate.simulation.runge_kutta import rk4_steps
from swashplate.simulation.step_size import check_step
from swashplate.simulation.trim import Trim, start_row, surroundings_of_start
from swashplate.simulation.tumbling import euler_rows, from_euler, steep, tumbling

if TYPE_CHECKING:
    from swashplate.simulation.sensors import Sensors


def simulate(
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
    earth: Earth | None = None,
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
        earth: that is round and turns; None for a flat one. Then p, q, r are rates against the stars, roll, pitch and
            yaw against the vertical where the vehicle is, x, y, z in the axes of the origin, and the flight has
            latitude, longitude and altitude too.

    Returns:
        The true flight, stream "uniform" (time, all states, inputs, voltage, wind), or what the sensors make of it.

    Raises:
        DivergenceError: with the time, the state that went first and the flight up to there.
        FlightError: where an input is missing or not finite.
        SwashError: steps that are too long for the vehicle's fastest mode at the start.
        CardError: where inputs reach outputs after different times, and `delays` does not say one for each.
    """
    enable_double_precision()
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
    acting = lengthened(acting, shared_length(len(time)))

    def flown(moved: Vehicle, begin: Array) -> Array:
        held = interpolation == "held"
        return np.asarray(
            trajectory(equations_of(moved), begin, acting, numbers, 1.0 / rate, substeps=substeps, held=held)
        )[: len(time)]

    places: Array | None = None
    if earth is not None:
        if vehicle.traits.linear:
            raise SwashError("holds near one trim over a flat Earth only.", channel="earth", where=vehicle.name)
        states, places = from_earth(flown(over_earth(vehicle, earth), to_earth(np.asarray(x0), earth)), earth)
    else:
        states = flown(vehicle, np.asarray(x0))
    if earth is None and not vehicle.traits.linear and steep(states):
        states = euler_rows(flown(tumbling(vehicle), from_euler(np.asarray(x0))), np.asarray(x0))
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
    if places is not None:
        columns = {n: ("time", places[:, i], {"units": u}) for i, (n, u) in enumerate(PLACES.items())}
        flight = flight.with_streams({"uniform": flight.streams["uniform"].assign(columns)})
    if sensors is None:
        return flight
    from swashplate.simulation.sensors import observe

    if seed is None:
        raise SwashError("sensors need a seed, so that the same call gives the same numbers.", hint="Pass seed=0.")
    return observe(flight, vehicle, sensors=sensors, seed=seed)


@jit(static_argnums=0, static_argnames="held", compiler_options=QUICK_FLIGHT)
def trajectory(
    equations: Equations,
    x0: Float[jax.Array, " states"],
    rows: Float[jax.Array, "samples driving"],
    p: Float[jax.Array, " parameters"],
    dt: Float[jax.Array, ""],
    *,
    substeps: Int[jax.Array, ""] | int,
    held: bool,
) -> Any:
    """States at every sample, shape (n, n_states), from driving rows of shape (n, n_inputs + 4).

    Compiled once per vehicle equations and shape; the card's numbers and how many substeps there are, are arguments.
    """
    rates = row_rates(equations, padded=True)
    h = dt / substeps

    def sample(x: Float[jax.Array, " states"], ends: tuple[Any, Any]) -> tuple[Any, Any]:
        w0, w1 = ends

        def drive(i: Int[jax.Array, ""], fraction: Float[jax.Array, ""]) -> Any:
            return w0 if held else w0 + ((i + fraction) / substeps) * (w1 - w0)

        after = rk4_steps(lambda x, w: rates(x, w, p), x, drive, h, substeps)
        return after, after

    ends = (rows[:-1], rows[:-1] if held else rows[1:])
    _, later = jax.lax.scan(sample, jnp.asarray(x0), ends)
    return jnp.concatenate([jnp.asarray(x0)[None], later])
