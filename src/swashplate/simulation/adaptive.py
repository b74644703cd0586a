"""Adaptive integration, to check what the fixed step loses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import diffrax
import numpy as np
from jaxtyping import ArrayLike, Float, Real

from swashplate.errors import SwashError
from swashplate.flights.flight import Flight
from swashplate.jax_on_demand import jax, jnp
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.driving import Inputs, Interpolation, driving_rows
from swashplate.simulation.dynamics import SURROUNDINGS, enable_double_precision, equations_of, parameter_row, row_rates
from swashplate.simulation.late import Delays, acting_rows
from swashplate.simulation.record import check_divergence, simulated_flight
from swashplate.simulation.trim import Trim, start_row, surroundings_of_start


def simulate_adaptive(
    vehicle: Vehicle,
    inputs: Inputs,
    *,
    start: Trim | Mapping[str, float] | None = None,
    rate: float = 100.0,
    interpolation: Interpolation = "linear",
    environment: Environment | None = None,
    delays: Delays = None,
    tolerance: float = 1e-11,
    max_steps: int = 100_000,
) -> Flight:
    """The same flight as `simulate`, by Dormand and Prince's method of order 8 with step-size control.

    For checking, not for speed: diffrax (Kidger 2021) `Dopri8`, relative and absolute `tolerance`. Steps end at every
    sample, where the inputs have a jump ("held") or a kink ("linear").

    Args:
        vehicle, inputs, start, rate, interpolation, environment, delays: as in `simulate`.
        tolerance: relative and absolute error per step.
        max_steps: how many steps it may take before it gives up.
    """
    enable_double_precision()
    surroundings = surroundings_of_start(vehicle, start, environment)
    time, rows = driving_rows(vehicle, inputs, rate=rate, environment=surroundings, interpolation=interpolation)
    first = surroundings._replace(**dict(zip(SURROUNDINGS, rows[0, len(vehicle.input_names) :], strict=True)))
    x0 = start_row(vehicle, start, first)
    acting = acting_rows(vehicle, rows, rate=rate, delays=delays, start=start, environment=first)
    rates, p = row_rates(equations_of(vehicle), padded=False), jnp.asarray(parameter_row(vehicle, surroundings))
    stamps, table = jnp.asarray(time), jnp.asarray(acting)

    def field(t: Real[ArrayLike, ""], x: Float[jax.Array, " states"], _: None) -> Any:
        i = jnp.clip(jnp.searchsorted(stamps, t, side="right") - 1, 0, stamps.size - 2)
        fraction = (t - stamps[i]) * rate if interpolation == "linear" else 0.0
        return rates(x, table[i] + fraction * (table[i + 1] - table[i]), p)

    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(field),
        diffrax.Dopri8(),
        t0=time[0],
        t1=time[-1],
        dt0=None,
        y0=jnp.asarray(x0),
        saveat=diffrax.SaveAt(ts=stamps),
        stepsize_controller=diffrax.ClipStepSizeController(
            diffrax.PIDController(rtol=tolerance, atol=tolerance),
            jump_ts=stamps[1:-1],
        ),
        max_steps=max_steps,
        throw=False,
    )
    if solution.result != diffrax.RESULTS.successful:
        raise SwashError(f"the adaptive integration gave up: {solution.result}")
    states = np.asarray(solution.ys)
    details = {"method": "Dopri8", "tolerance": tolerance, "gravity": float(surroundings.gravity)}
    flight = simulated_flight(vehicle, time, states, rows, details=details)
    check_divergence(vehicle, time, states, flight)
    return flight
