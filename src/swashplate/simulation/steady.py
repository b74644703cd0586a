"""What a steady flight is: its states and inputs from the unknowns of a trim, and what should vanish there."""

from __future__ import annotations

from functools import partial

import numpy as np

from swashplate.arrays import IMAGINARY, Array
from swashplate.engine.equations import Equations
from swashplate.engine.slopes import Slopes, rates_and_slopes
from swashplate.physics.backend import ArrayBackend, Backend, Scalar
from swashplate.physics.frames import Euler, Vector, local_to_body
from swashplate.physics.rigid_body import RigidBody

BODY = len(RigidBody._fields)
ACCELERATIONS = slice(3, 6)
ANGULAR_ACCELERATIONS = slice(9, 12)

_XP = ArrayBackend()


def assemble(equations: Equations, z: Array, course: Array, xp: Backend) -> tuple[Scalar, Scalar]:
    """State and input rows of a steady flight from the unknowns.

    Args:
        z: roll and pitch, the inputs that are solved for, inner states.
        course: velocity ahead, right and down, heading, rate of turn, place down.
        xp: the operations.
    """
    vehicle = equations.vehicle
    held = dict(vehicle.trim_held)
    n_inputs = len(vehicle.input_names) - len(held)
    attitude = Euler(z[0], z[1], course[3])
    c, s = xp.cos(course[3]), xp.sin(course[3])
    local = Vector(c * course[0] - s * course[1], s * course[0] + c * course[1], course[2])
    velocity = local_to_body(local, attitude, xp)
    # A steady turn about the vertical (Stevens, Lewis and Johnson 2016, sec. 3.6).
    rates = local_to_body(Vector(0.0, 0.0, course[4]), attitude, xp)
    place = xp.arrays.concatenate([np.zeros(2), course[5:6]])
    state = xp.arrays.concatenate(
        [place, xp.arrays.stack(velocity), xp.arrays.stack(attitude), xp.arrays.stack(rates), z[2 + n_inputs :]]
    )
    free = iter(range(2, 2 + n_inputs))
    return state, xp.arrays.stack(
        [xp.arrays.asarray(held[name]) if name in held else z[next(free)] for name in vehicle.input_names]
    )


def unrest_at(
    equations: Equations, z: Array, course: Array, row: Array, p: Array, slopes: Slopes | None = None
) -> tuple[Array, Array]:
    """What should vanish in the steady flight that `assemble` makes, and its slopes by the unknowns.

    Args:
        z, course: as in `assemble`.
        row, p: `SURROUNDINGS`, and parameters with `CONSTANTS`.
        slopes: of the rates; those of the graph by default.
    """
    state, inputs = assemble(equations, z, course, _XP)
    taken = slopes or partial(rates_and_slopes, equations)
    rates, by_x, by_w = taken(state, np.concatenate([inputs, row]), p)
    held, inside = dict(equations.vehicle.trim_held), len(state) - BODY
    free = [name not in held for name in equations.vehicle.input_names]
    by_z, by_input = np.zeros((len(state), z.size)), np.zeros((len(inputs), z.size))
    for place in range(2):
        turned = assemble(equations, z + 1j * IMAGINARY * np.eye(z.size)[place], course, _XP)[0]
        by_z[:, place] = np.imag(turned) / IMAGINARY
    by_z[BODY:, z.size - inside :] = np.eye(inside)
    by_input[free, 2 : z.size - inside] = np.eye(sum(free))
    slope = by_x @ by_z + by_w[:, : len(inputs)] @ by_input
    kept = np.r_[ACCELERATIONS, ANGULAR_ACCELERATIONS, BODY : len(state)]
    return rates[kept], slope[kept]
