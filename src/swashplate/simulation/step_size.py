"""Whether a step is short enough for the vehicle's fastest mode."""

from __future__ import annotations

import math

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import SwashError
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment

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
    moved = np.diag(step)
    try:
        with np.errstate(all="ignore"):
            slopes = [(rates(x + d) - rates(x - d)) / (2.0 * h) for d, h in zip(moved, step, strict=True)]
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
