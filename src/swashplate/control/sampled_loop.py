"""A vehicle under a sampled controller, linearised about a trim: the loop's own map from one sample to the next.

The controller's rate and its hold are in the map, so nothing is approximated by a delay. Terms such as u |u| have no
slope at hover and no part in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from swashplate.errors import SwashError
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
Complex = NDArray[np.complex128]

_SUBSTEPS = 10
_NOTHING = 1e-12


@dataclass(frozen=True)
class SampledLoop:
    """Derivatives of x+ = f(x, command) and (command, m+) = g(x, m, reference), with n states and k memories.

    Attributes:
        states, inputs: names.
        rate: of the controller [Hz].
        by_state, by_input: of f, shapes (n, n) and (n, inputs).
        command, memory: of g by (x, m), shapes (inputs, n + k) and (k, n + k).
        command_reference, memory_reference: of g by the reference, shapes (inputs, 8) and (k, 8).
    """

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    rate: float
    by_state: Array
    by_input: Array
    command: Array
    memory: Array
    command_reference: Array
    memory_reference: Array

    @property
    def matrix(self) -> Array:
        """The closed loop's map of (x, m), shape (n + k, n + k)."""
        after = self.by_input @ self.command
        after[:, : len(self.states)] += self.by_state
        return np.concatenate([after, self.memory])

    def answers(self, reference: str, state: str) -> bool:
        """Whether a state moves when a reference does."""
        seen = self.response(np.geomspace(0.1, 1.0, 3) * self.rate, reference, state)
        return bool(np.max(np.abs(seen)) > _NOTHING)

    def opened(self, frequencies: Array) -> Complex:
        """The loop opened at the inputs, for negative feedback, shape (frequencies, inputs, inputs).

        Args:
            frequencies: [rad/s], shape (n,), below Nyquist's.
        """
        n = len(self.states)
        k = self.memory.shape[0]
        z = self._z(frequencies)
        plant = np.linalg.solve(z * np.eye(n) - self.by_state, self.by_input.astype(complex))
        inner = np.linalg.solve(z * np.eye(k) - self.memory[:, n:], self.memory[:, :n].astype(complex))
        return np.asarray(-(self.command[:, :n] + self.command[:, n:] @ inner) @ plant, dtype=np.complex128)

    def response(self, frequencies: Array, reference: str, state: str) -> Complex:
        """A state's response to a reference with all loops closed, shape (frequencies,)."""
        j = REFERENCES.index(reference)
        return self._closed(frequencies, self.command_reference[:, j], self.memory_reference[:, j], state)

    def sensitivity(self, frequencies: Array, state: str) -> Complex:
        """What is left of a disturbance added to the measured state: (state + disturbance) / disturbance.

        Args:
            frequencies: [rad/s], shape (n,).
            state: its name.
        """
        i = self.states.index(state)
        return 1.0 + self._closed(frequencies, self.command[:, i], self.memory[:, i], state)

    def _closed(self, frequencies: Array, command: Array, memory: Array, state: str) -> Complex:
        drive = np.concatenate([self.by_input @ command, memory])
        matrix = self.matrix
        found = np.linalg.solve(self._z(frequencies) * np.eye(matrix.shape[0]) - matrix, drive[:, None].astype(complex))
        return np.asarray(found[:, self.states.index(state), 0], dtype=np.complex128)

    def _z(self, frequencies: Array) -> Complex:
        return np.asarray(np.exp(1j * np.asarray(frequencies) / self.rate)[:, None, None], dtype=np.complex128)


def sampled_loop(vehicle: Vehicle, controller: Controller, trim: Trim) -> SampledLoop:
    """The loop about a trim.

    Args:
        vehicle: what flies, which need not be what the controller was designed on.
        controller: see `swashplate.simulation.closed_loop.Controller`.
        trim: the hover or steady flight; the reference is its place and heading.

    Raises:
        SwashError: where the loop is not finite there.
    """
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
    parts = [np.asarray(part, dtype=np.float64) for part in found]
    if not all(np.all(np.isfinite(part)) for part in parts):
        raise SwashError("the closed loop has no derivative at this hover.", where=vehicle.name)
    return SampledLoop(vehicle.state_names, vehicle.input_names, controller.rate, *parts)


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

    def deciding(both: Any, reference: Any) -> tuple[Any, Any]:
        measured = jnp.concatenate([both[:n], surroundings[-1:]])
        after, command = control(both[n:], 0.0, measured, reference, gains)
        return jnp.clip(command, limits[0], limits[1]), after

    def flying(x: Any, command: Any) -> Any:
        w = jnp.concatenate([command, surroundings])

        def substep(x: Any, _: Any) -> tuple[Any, None]:
            return rk4_step(lambda x, w: rates(x, w, p), x, (w, w, w), dt / _SUBSTEPS), None

        return jax.lax.scan(substep, x, None, length=_SUBSTEPS)[0]  # a loop: unrolled it takes a minute to compile

    both = jnp.concatenate([x, memory])
    by_state, by_input = jax.jacfwd(flying, argnums=(0, 1))(x, deciding(both, reference)[0])
    (command, command_reference), (after, memory_reference) = jax.jacfwd(deciding, argnums=(0, 1))(both, reference)
    return by_state, by_input, command, after, command_reference, memory_reference
