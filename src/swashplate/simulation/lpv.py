"""Linear-parameter-varying flight of a single-rotor helicopter, three ways; the nonlinear equations judge them.

All have the eight states of Bhandari et al. (2005), eq. 13, with flapping that follows without delay:

* "as-printed": dx/dt = A(x) (x - x0) + B(x) (u - u0) with A and B computed anew at every step from the state there, and
  everything counted from the first trim (their eq. 11). Away from that trim this is not the equations' tangent: a
  tangent at x touches f(x), and f(x) is not A(x) (x - x0) + B(x) (u - u0). At a steady flight at another speed, where
  nothing should move, it accelerates; the error grows with time.
* "trim-term": dx/dt = A(rho) (x - x_trim(rho)) + B(rho) (u - u_trim(rho)) over a table of trims, rho the speed ahead.
* "stitched": the model that `swashplate.stitch` makes of that table: nonlinear gravity and kinematics, and trims that
  change with speed as the matrices say (`swashplate.models.linear.stitched`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from swashplate.arrays import Array
from swashplate.engine.equations import SURROUNDINGS, Equations, equations_of, parameter_row
from swashplate.errors import FlightError, SwashError
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.jax_on_demand import jax, jit, jnp
from swashplate.models.catalogue import from_card
from swashplate.models.linear.matrices_file import state_space_of_matrices
from swashplate.models.linear.stitching import stitch_points
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.physics.rigid_body import BODY_UNITS, RigidBody
from swashplate.simulation.compilation import QUICK_FLIGHT
from swashplate.simulation.dynamics import enable_double_precision, row_rates
from swashplate.simulation.integrate import simulate
from swashplate.simulation.linearize import linearize
from swashplate.simulation.reduction import PAPER_INPUTS, PAPER_STATES, paper_model
from swashplate.simulation.runge_kutta import rk4_step
from swashplate.simulation.speeds import trims_over_speed
from swashplate.simulation.trim import Trim

Scheme = Literal["as-printed", "trim-term", "stitched"]

_U = PAPER_STATES.index("u")


@dataclass(frozen=True)
class Schedule:
    """Trims and linear models over speed, rows of PAPER_STATES and PAPER_INPUTS.

    Attributes:
        speeds: speed u ahead of each trim [m/s], shape (n,), ascending.
        x, u: trims, shapes (n, 8) and (n, 4).
        A, B: models, shapes (n, 8, 8) and (n, 8, 4).
    """

    speeds: Array
    x: Array
    u: Array
    A: Array
    B: Array


def schedule(vehicle: Vehicle, speeds: Sequence[float], *, environment: Environment | None = None) -> Schedule:
    """Trims and eight-state models of a single-rotor helicopter at ascending speeds [m/s]."""
    trims = trims_over_speed(vehicle, speeds, environment=environment)
    models = [paper_model(linearize(vehicle, at)) for at in trims]
    x = np.array([[at.states()[name] for name in PAPER_STATES] for at in trims])
    u = np.array([[at.commands()[name] for name in PAPER_INPUTS] for at in trims])
    return Schedule(x[:, _U], x, u, np.array([m.A for m in models]), np.array([m.B for m in models]))


def simulate_lpv(
    vehicle: Vehicle,
    inputs: Mapping[str, ArrayLike],
    *,
    start: Trim,
    scheme: Scheme,
    over: Schedule | None = None,
    initial: Mapping[str, float] | None = None,
    rate: float = 1000.0,
) -> Flight:
    """Fly given controls with an LPV model.

    Args:
        vehicle: a single-rotor helicopter without options that add states (14 states).
        inputs: series (n,) of `PAPER_INPUTS` at `rate`.
        start: the trim that it begins at (and that "as-printed" counts from).
        scheme: "as-printed", "trim-term" or "stitched".
        over: the table of the latter two.
        initial: those of `PAPER_STATES` that do not begin at `start`, e.g. as measured in a flight.
        rate: steps per second [Hz]; Runge-Kutta of order 4, matrices held over a step.

    Returns:
        A flight with the eight states and the inputs.

    Raises:
        FlightError: where an input is missing.
        SwashError: for another vehicle, scheme or initial state, or without the table it needs.
    """
    enable_double_precision()
    names = ("a1", "b1")
    if not set(PAPER_STATES) | set(names) <= set(vehicle.state_names) or len(vehicle.state_names) != 14:
        raise SwashError(
            "has other states than body and flapping.", where=vehicle.name, hint="Use a single-rotor card, options off."
        )
    missing = [name for name in PAPER_INPUTS if name not in inputs]
    if missing:
        raise FlightError("is missing.", channel=missing[0])
    u = np.column_stack([np.asarray(inputs[name], dtype=np.float64) for name in PAPER_INPUTS])
    unknown = sorted(set(initial or {}) - set(PAPER_STATES))
    if unknown:
        raise SwashError(f"is not one of {', '.join(PAPER_STATES)}.", channel=unknown[0])
    x0 = np.array([start.states()[name] for name in PAPER_STATES])
    began = np.array([(initial or {}).get(name, x0[i]) for i, name in enumerate(PAPER_STATES)], dtype=np.float64)
    u0 = np.array([start.commands()[name] for name in PAPER_INPUTS])
    surroundings = start.environment
    if scheme == "as-printed":
        disc = np.array([start.states()[name] for name in names])
        row = np.array([getattr(surroundings, name) for name in SURROUNDINGS], dtype=np.float64)
        p = parameter_row(vehicle, surroundings)
        padded = np.concatenate([u, np.repeat(u[-1:], -len(u) % _CHUNK, axis=0)])
        states = _printed(equations_of(vehicle), (x0, u0), (began, disc), padded, row, p, 1.0 / rate)[: len(u)]
    elif scheme in ("trim-term", "stitched"):
        if over is None:
            raise SwashError(f"scheme '{scheme}' needs a schedule.", hint="Pass over=schedule(vehicle, speeds).")
        if scheme == "stitched":
            begins = start.states() | dict(zip(PAPER_STATES, began.tolist(), strict=True))
            flown = _stitched(over)
            states = simulate(
                flown,
                dict(zip(PAPER_INPUTS, u.T, strict=True)),
                start={name: begins[name] for name in flown.state_names},
                rate=rate,
                environment=surroundings,
            ).array(PAPER_STATES)
        else:
            tables = tuple(map(jnp.asarray, (over.speeds, over.x, over.u, over.A, over.B)))
            states = _scheduled(tables, began, u, 1.0 / rate)
    else:
        raise SwashError(f"scheme is '{scheme}', expected 'as-printed', 'trim-term' or 'stitched'.")
    time = np.arange(len(u)) / rate
    columns = dict(zip((*PAPER_STATES, *PAPER_INPUTS), np.hstack([np.asarray(states), u]).T, strict=True))
    provenance = Provenance(source=f"LPV {scheme} {vehicle.name}", simulated=True, vehicle=vehicle.name)
    units = dict.fromkeys(PAPER_INPUTS, "rad")
    return Flight({"uniform": stream(time, columns, units)}, provenance).done("simulate_lpv", scheme=scheme, rate=rate)


_CHUNK = 50
"""Steps per inner loop: XLA makes one function of a loop that touches little (`compile_small_loops_whole`)."""


def _product(A: Float[jax.Array, "rows inner"], x: Float[jax.Array, ...]) -> Any:
    """A @ x for a small matrix and a vector or matrix: a loop with a matrix product in it would not be one function."""
    return jnp.sum(A[:, :, None] * x[None], axis=1) if x.ndim == 2 else jnp.sum(A * x, axis=1)


def _linear_step(
    A: Float[jax.Array, "states states"],
    c: Float[jax.Array, " states"],
    x: Float[jax.Array, " states"],
    dt: Float[jax.Array, ""],
) -> Any:
    """One Runge-Kutta step of dx/dt = A x + c: the Taylor series to fourth order."""
    k = _product(A, x) + c
    total, term = x + dt * k, k
    for order in (2.0, 3.0, 4.0):
        term = dt * _product(A, term) / order
        total = total + dt * term
    return total


@jit(static_argnums=0, compiler_options=QUICK_FLIGHT)
def _printed(
    equations: Equations,
    trimmed: tuple[Float[jax.Array, " states"], Float[jax.Array, " inputs"]],
    begin: tuple[Float[jax.Array, " states"], Float[jax.Array, " disc"]],
    u: Float[jax.Array, "samples inputs"],
    row: Float[jax.Array, " surroundings"],
    p: Float[jax.Array, " parameters"],
    dt: Float[jax.Array, ""],
) -> Any:
    vehicle = equations.vehicle
    x0, u0 = trimmed
    rates = row_rates(equations, padded=False)
    names = vehicle.state_names
    ten = (*PAPER_STATES, "a1", "b1")
    order = [10 + PAPER_INPUTS.index(name) for name in vehicle.input_names]

    def moving(z: Float[jax.Array, " unknowns"]) -> Any:
        """Rates of the eight states and the disc, from these ten and the controls."""
        zero = jnp.zeros(())
        # Stacks and slices only: XLA makes no function of a loop that gathers or scatters.
        state = jnp.stack([z[ten.index(name)] if name in ten else zero for name in names])
        moved = rates(state, jnp.concatenate([jnp.stack([z[i] for i in order]), row]), p)
        return jnp.stack([moved[names.index(name)] for name in ten])

    def step(carry: tuple[Any, Any], command: Float[jax.Array, " inputs"]) -> tuple[Any, Any]:
        x, disc = carry
        z = jnp.concatenate([x, disc, command])
        # Sixteen directions side by side fill the processor's vectors; the last two are nothing.
        value, slopes = jax.vmap(lambda along: jax.jvp(moving, (z,), (along,)), out_axes=(None, 0))(jnp.eye(16)[:, :14])
        J = slopes[:14].T
        # The disc's equations are linear in the disc: one Newton step is its steady tilt at this state.
        a, b, c, d = J[8, 8], J[8, 9], J[9, 8], J[9, 9]
        inverse = jnp.stack([jnp.stack([d, -b]), jnp.stack([-c, a])]) / (a * d - b * c)
        follow = -_product(inverse, jnp.concatenate([J[8:, :8], J[8:, 10:]], axis=1))
        A = J[:8, :8] + _product(J[:8, 8:10], follow[:, :8])
        B = J[:8, 10:] + _product(J[:8, 8:10], follow[:, 8:])
        after = _linear_step(A, _product(B, command - u0) - _product(A, x0), x, dt)
        return (after, disc - _product(inverse, value[8:])), x

    start: Any = tuple(map(jnp.asarray, begin))
    chunks = jnp.asarray(u).reshape(-1, _CHUNK, u.shape[1])
    _, states = jax.lax.scan(lambda carry, commands: jax.lax.scan(step, carry, commands), start, chunks)
    return states.reshape(-1, len(PAPER_STATES))


def _stitched(over: Schedule) -> Vehicle:
    """The stitched model of a table."""
    units = dict(zip(RigidBody._fields, BODY_UNITS, strict=True)) | dict.fromkeys(PAPER_INPUTS, "rad")
    points = [
        state_space_of_matrices(
            (A, B),
            states=PAPER_STATES,
            inputs=PAPER_INPUTS,
            units=units,
            trim=dict(zip((*PAPER_STATES, *PAPER_INPUTS), (*x, *u), strict=True)),
            limits={},
            delays={},
            name=f"at_{x[_U]:.3g}".replace("-", "minus_").replace(".", "_"),
            title=f"{x[_U]:.3g} m/s",
        )
        for x, u, A, B in zip(over.x, over.u, over.A, over.B, strict=True)
    ]
    return from_card(stitch_points(points, names=[point.title for point in points]))


@jit()
def _scheduled(
    tables: tuple[Float[jax.Array, "speeds ..."], ...],
    x0: Float[jax.Array, " states"],
    u: Float[jax.Array, "samples inputs"],
    dt: Float[jax.Array, ""],
) -> Any:
    speeds = tables[0]

    def between(speed: Float[jax.Array, ""]) -> tuple[Any, ...]:
        i = jnp.clip(jnp.searchsorted(speeds, speed) - 1, 0, speeds.size - 2)
        f = jnp.clip((speed - speeds[i]) / (speeds[i + 1] - speeds[i]), 0.0, 1.0)
        return tuple(table[i] + f * (table[i + 1] - table[i]) for table in tables[1:])

    def rates(x: Float[jax.Array, " states"], command: Float[jax.Array, " inputs"]) -> Any:
        xt, ut, A, B = between(x[_U])
        return A @ (x - xt) + B @ (command - ut)

    def step(x: Float[jax.Array, " states"], command: Float[jax.Array, " inputs"]) -> tuple[Any, Any]:
        return rk4_step(rates, x, lambda _: command, dt, looped=False), x

    _, states = jax.lax.scan(step, jnp.asarray(x0), jnp.asarray(u))
    return states
