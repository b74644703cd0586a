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

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from swashplate.arrays import Array, lengthened
from swashplate.engine.equations import CONSTANTS, SURROUNDINGS, Equations, equations_of, parameter_row
from swashplate.engine.law import runnable
from swashplate.engine.roots import require_casadi
from swashplate.engine.slopes import rates_at
from swashplate.errors import FlightError, SwashError
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.models.catalogue import from_card
from swashplate.models.linear.matrices_file import state_space_of_matrices
from swashplate.models.linear.stitching import stitch_points
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Scalar
from swashplate.physics.environment import Environment
from swashplate.physics.rigid_body import BODY_UNITS, RigidBody
from swashplate.simulation.integrate import simulate_open_loop
from swashplate.simulation.linearize import linearize
from swashplate.simulation.reduction import PAPER_INPUTS, PAPER_STATES, paper_model
from swashplate.simulation.trim import Trim
from swashplate.simulation.trim_curve import trims_over_speed

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
        states = _printed(equations_of(vehicle), (x0, u0), (began, disc), u, row, p, 1.0 / rate)
    elif scheme in ("trim-term", "stitched"):
        if over is None:
            raise SwashError(f"scheme '{scheme}' needs a schedule.", hint="Pass over=schedule(vehicle, speeds).")
        if scheme == "stitched":
            begins = start.states() | dict(zip(PAPER_STATES, began.tolist(), strict=True))
            stitched = _stitched(over)
            states = simulate_open_loop(
                stitched,
                dict(zip(PAPER_INPUTS, u.T, strict=True)),
                start={name: begins[name] for name in stitched.state_names},
                rate=rate,
                environment=surroundings,
            ).array(PAPER_STATES)
        else:
            states = _scheduled(over, began, u, 1.0 / rate)
    else:
        raise SwashError(f"scheme is '{scheme}', expected 'as-printed', 'trim-term' or 'stitched'.")
    time = np.arange(len(u)) / rate
    columns = dict(zip((*PAPER_STATES, *PAPER_INPUTS), np.hstack([np.asarray(states), u]).T, strict=True))
    provenance = Provenance(source=f"LPV {scheme} {vehicle.name}", simulated=True, vehicle=vehicle.name)
    units = dict.fromkeys(PAPER_INPUTS, "rad")
    return Flight({"uniform": stream(time, columns, units)}, provenance).done("simulate_lpv", scheme=scheme, rate=rate)


def _linear_step(A: Scalar, c: Scalar, x: Scalar, dt: Scalar) -> Scalar:
    """One Runge-Kutta step of dx/dt = A x + c: the Taylor series to fourth order."""
    term = A @ x + c
    total = x + dt * term
    for order in (2.0, 3.0, 4.0):
        term = dt * (A @ term) / order
        total = total + dt * term
    return total


def _printed(
    equations: Equations,
    trimmed: tuple[Array, Array],
    begin: tuple[Array, Array],
    u: Array,
    row: Array,
    p: Array,
    dt: float,
) -> Array:
    block, now, states = _printed_block(equations), np.concatenate(begin), []
    numbers = np.tile(np.concatenate([*trimmed, row, p, [dt]])[:, None], _BLOCK)
    for first in range(0, len(u), _BLOCK):
        (after,) = block(now, lengthened(u[first : first + _BLOCK], _BLOCK).T, numbers)
        states += [now[None], after.T[:-1]]
        now = after[:, -1]
    return np.concatenate(states)[: len(u), : len(PAPER_STATES)]


_BLOCK = 64
"""Steps that one call of the graph takes."""


@lru_cache(maxsize=4)
def _printed_block(equations: Equations) -> Callable[..., list[Array]]:
    """Paper's states and disc, commands and what never changes, a column a step, to states and disc after each step."""
    casadi, vehicle = require_casadi(), equations.vehicle
    places = [vehicle.index(name) for name in (*PAPER_STATES, "a1", "b1")]
    order = [PAPER_INPUTS.index(name) for name in vehicle.input_names]
    back = [vehicle.input_names.index(name) for name in PAPER_INPUTS]
    n, m = len(vehicle.state_names), len(PAPER_INPUTS)
    sizes = (8, m, len(SURROUNDINGS), len(vehicle.parameter_names) + len(CONSTANTS), 1)
    ten, command, fixed = (casadi.SX.sym(*size) for size in (("ten", 10), ("command", m), ("fixed", sum(sizes))))
    x0, u0, row, p, dt = casadi.vertsplit(fixed, np.cumsum([0, *sizes]).tolist())
    state = casadi.SX(n, 1)
    state[places] = ten
    values, slopes = rates_at(equations)(state, casadi.vertcat(command[order], row), p)
    value, J = values[places], slopes[places, [*places, *(n + column for column in back)]]
    # The disc's equations are linear in the disc: one Newton step is its steady tilt at this state.
    inverse = casadi.inv_minor(J[8:, 8:10])
    follow = -inverse @ casadi.horzcat(J[8:, :8], J[8:, 10:])
    A, B = J[:8, :8] + J[:8, 8:10] @ follow[:, :8], J[:8, 10:] + J[:8, 8:10] @ follow[:, 8:]
    after = _linear_step(A, B @ (command - u0) - A @ x0, ten[:8], dt)
    results = casadi.densify(casadi.vertcat(after, ten[8:] - inverse @ value[8:]))
    return runnable(casadi.Function("printed", [ten, command, fixed], [results], {"cse": True}).mapaccum("lpv", _BLOCK))


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


def _scheduled(over: Schedule, x0: Array, u: Array, dt: float) -> Array:
    speeds, tables = over.speeds, (over.x, over.u, over.A, over.B)

    def rates(x: Array, command: Array) -> Array:
        i = int(np.clip(np.searchsorted(speeds, x[_U]) - 1, 0, speeds.size - 2))
        f = float(np.clip((x[_U] - speeds[i]) / (speeds[i + 1] - speeds[i]), 0.0, 1.0))
        xt, ut, A, B = (table[i] + f * (table[i + 1] - table[i]) for table in tables)
        return np.asarray(A @ (x - xt) + B @ (command - ut))

    x, states = x0, []
    for command in u:
        states.append(x)
        k1 = rates(x, command)
        k2 = rates(x + dt / 2 * k1, command)
        k3 = rates(x + dt / 2 * k2, command)
        k4 = rates(x + dt * k3, command)
        x = x + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return np.array(states)
