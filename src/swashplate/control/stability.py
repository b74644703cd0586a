"""Modes of a vehicle under a sampled controller: the loop's own map from one sample to the next, linearised."""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from swashplate.control.margins import Margins, margins
from swashplate.errors import ControllerError, SwashError
from swashplate.simulation.closed_loop import REFERENCES, Controller, Step
from swashplate.simulation.dynamics import (
    SURROUNDINGS,
    Equations,
    enable_double_precision,
    equations_of,
    parameter_row,
    rk4_step,
    row_rates,
)
from swashplate.simulation.trim import Trim
from swashplate.vehicles.vehicle import Vehicle

Array = NDArray[np.float64]

_SUBSTEPS = 10
_LOWEST = 0.02
"""rad/s; below it an aircraft with integrators has gain to spare."""
_SAMPLES = 20.0
"""Samples per period that a controller needs for a mode that it must hold."""
_NO_STATE = 1e-8
"""Below this modulus an eigenvalue of the map is no mode: memory that every sample writes anew."""


def loop_modes(vehicle: Vehicle, controller: Controller, trim: Trim) -> NDArray[np.complex128]:
    """Eigenvalues [1/s] of the closed loop about a hover, with the controller's sampling and hold in them.

    The sampled map of states and memory is differentiated and its eigenvalues z are given as rate ln z, least stable
    first. Terms such as u |u| have no slope at hover and no part in it.

    Args:
        vehicle: what flies, which need not be what the controller was designed on.
        controller: see `swashplate.simulation.closed_loop.Controller`.
        trim: the hover; the reference is its place and heading.

    Raises:
        SwashError: where the loop is not finite there.
    """
    matrix, _ = _map(vehicle, controller, trim)
    values = np.linalg.eigvals(matrix).astype(np.complex128)
    modes = np.log(values[np.abs(values) > _NO_STATE]) * controller.rate
    return np.asarray(modes[np.argsort(-modes.real, kind="stable")])


def loop_margins(vehicle: Vehicle, controller: Controller, trim: Trim, *, points: int = 400) -> Margins:
    """Margins of the same loop, opened at the inputs of the vehicle, from 0.02 rad/s to Nyquist's frequency.

    Args:
        vehicle, controller, trim: as in `loop_modes`.
        points: of the frequency grid.

    Raises:
        ControllerError: where the closed loop is not stable: it has no margins.
    """
    matrix, parts = _map(vehicle, controller, trim)
    n, size = len(vehicle.state_names), matrix.shape[0]
    slowest = np.max(np.abs(np.linalg.eigvals(matrix)))
    if slowest >= 1.0:
        require_stable(complex(loop_modes(vehicle, controller, trim)[0]), rate=controller.rate, where=vehicle.name)
    by_state, by_input, command = parts
    memory = slice(n, size)
    w = np.geomspace(_LOWEST, np.pi * controller.rate * 0.999, points)
    loop = []
    for z in np.exp(1j * w / controller.rate):
        plant = np.linalg.solve(z * np.eye(n) - by_state, by_input)
        inner = np.linalg.solve(z * np.eye(size - n) - matrix[memory, memory], matrix[memory, :n])
        loop.append(-(command[:, :n] + command[:, n:] @ inner) @ plant)
    return margins(w, np.array(loop), vehicle.input_names)


def _map(vehicle: Vehicle, controller: Controller, trim: Trim) -> tuple[Array, tuple[Array, Array, Array]]:
    """The loop's map from sample to sample, and of it the vehicle by state, by input, and the command by both."""
    enable_double_precision()
    surroundings = np.array([getattr(trim.environment, name) for name in SURROUNDINGS], dtype=np.float64)
    states = trim.states()
    reference = np.array([states.get(name, 0.0) for name in REFERENCES])
    found = _jacobians(
        equations_of(vehicle),
        controller.step,
        trim.state,
        controller.memory,
        controller.gains,
        reference,
        surroundings,
        parameter_row(vehicle, trim.environment),
        np.array(vehicle.input_limits).T,
        1.0 / controller.rate,
    )
    by_state, by_input, command, memory = (np.asarray(part, dtype=np.float64) for part in found)
    n = len(vehicle.state_names)
    states_after = by_input @ command
    states_after[:, :n] += by_state
    matrix = np.concatenate([states_after, memory])
    if not np.all(np.isfinite(matrix)):
        raise SwashError("the closed loop has no derivative at this hover.", where=vehicle.name)
    return matrix, (by_state, by_input, command)


def require_stable(mode: complex, *, rate: float, where: str) -> None:
    """Say which mode a loop does not hold.

    Args:
        mode: the least stable of `loop_modes` [1/s].
        rate: of the controller [Hz].
        where: the model.

    Raises:
        ControllerError: where the mode grows; fewer than `_SAMPLES` samples per period are named as the likely reason.
    """
    if mode.real < 0.0:
        return
    frequency = abs(mode) / (2.0 * np.pi)
    slow = frequency * _SAMPLES > rate
    raise ControllerError(
        f"the loop at {rate:g} Hz has a growing mode at {mode.real:+.3g} +- {abs(mode.imag):.3g}j 1/s.",
        where=where,
        hint=f"Run it at {_SAMPLES * frequency:.0f} Hz or more." if slow else "Change its gains.",
    )


@partial(jax.jit, static_argnums=(0, 1))
def _jacobians(
    equations: Equations,
    control: Step,
    x: Any,
    memory: Any,
    gains: Any,
    reference: Any,
    surroundings: Any,
    p: Any,
    limits: Any,
    dt: Any,
) -> Any:
    rates = row_rates(equations, padded=False)
    n = x.shape[0]

    def deciding(both: Any) -> tuple[Any, Any]:
        measured = jnp.concatenate([both[:n], surroundings[-1:]])
        after, command = control(both[n:], 0.0, measured, reference, gains)
        return jnp.clip(command, limits[0], limits[1]), after

    def flying(x: Any, command: Any) -> Any:
        w = jnp.concatenate([command, surroundings])

        def substep(x: Any, _: Any) -> tuple[Any, None]:
            return rk4_step(lambda x, w: rates(x, w, p), x, (w, w, w), dt / _SUBSTEPS), None

        return jax.lax.scan(substep, x, None, length=_SUBSTEPS)[0]  # a loop: unrolled it takes a minute to compile

    both = jnp.concatenate([x, memory])
    by_state, by_input = jax.jacfwd(flying, argnums=(0, 1))(x, deciding(both)[0])
    command, after = jax.jacfwd(deciding)(both)
    return by_state, by_input, command, after
