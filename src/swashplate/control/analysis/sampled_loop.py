"""A vehicle under a sampled controller, linearised about a trim: the loop's own map from one sample to the next.

The controller's rate and its hold are in the map, so nothing is approximated by a delay. Terms such as u |u| have no
slope at hover and no part in it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.engine.law import REFERENCES, LawGraph
from swashplate.engine.roots import require_casadi
from swashplate.errors import SwashError
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.closed_loop import flown_delays
from swashplate.simulation.controller import Controller
from swashplate.simulation.discretisation import held_late, with_late_inputs
from swashplate.simulation.linearize import linearize
from swashplate.simulation.trim import Trim

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
        later: the same loop with further delays of the inputs [s], exact within a sample; None where it cannot tell.
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
    later: Callable[[Array], SampledLoop] | None = field(default=None, compare=False, repr=False)

    @property
    def matrix(self) -> Array:
        """The closed loop's map of (x, m), shape (n + k, n + k)."""
        after = self.by_input @ self.command
        after[:, : len(self.states)] += self.by_state
        return np.concatenate([after, self.memory])

    def answers(self, reference: str, state: str) -> bool:
        """Whether a state moves when a reference does."""
        response = self.response(np.geomspace(0.1, 1.0, 3) * self.rate, reference, state)
        return bool(np.max(np.abs(response)) > _NOTHING)

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
        x = np.linalg.solve(self._z(frequencies) * np.eye(matrix.shape[0]) - matrix, drive[:, None].astype(complex))
        return np.asarray(x[:, self.states.index(state), 0], dtype=np.complex128)

    def _z(self, frequencies: Array) -> Complex:
        return np.asarray(np.exp(1j * np.asarray(frequencies) / self.rate)[:, None, None], dtype=np.complex128)


def sampled_loop(
    vehicle: Vehicle,
    controller: Controller,
    trim: Trim,
    *,
    delays: Mapping[str, float] | float | None = None,
) -> SampledLoop:
    """The loop about a trim; commands that are on their way are states of the aircraft.

    Args:
        vehicle: what flies, which need not be what the controller was designed on.
        controller: see `swashplate.simulation.closed_loop.Controller`.
        trim: the hover or steady flight; the reference is its place and heading.
        delays: from command to actuator [s]; see `swashplate.simulation.closed_loop.flown_delays`.

    Raises:
        SwashError: where the loop is not finite there.
    """
    states = trim.states()
    reference = np.array([states.get(name, 0.0) for name in REFERENCES])
    # Specific force and draws are an observer's; here the states are known.
    signals = np.array([*trim.state, *np.zeros(3), trim.environment.voltage], dtype=np.float64)
    inputs, *parts = _decisions(controller.law(vehicle), controller.memory_of_law(), signals, reference, vehicle)
    around = linearize(vehicle, replace(trim, inputs=inputs))
    if not all(np.all(np.isfinite(part)) for part in (around.A, around.B, *parts)):
        raise SwashError("the closed loop has no derivative at this hover.", where=vehicle.name)
    delay_row = flown_delays(vehicle, controller, delays=delays)

    def loop_delayed_by(further: Array) -> SampledLoop:
        F, G, before, samples = held_late(around.A, around.B, 1.0 / controller.rate, (delay_row + further).tolist())
        F, G, added = with_late_inputs(F, G, samples, before)
        n, more = len(vehicle.state_names), len(added)
        command, memory = (np.hstack([d[:, :n], np.zeros((len(d), more)), d[:, n:]]) for d in parts[:2])
        names = (*vehicle.state_names, *(f"{vehicle.input_names[j]} {ago} ago" for j, ago in added))
        return SampledLoop(
            names,
            vehicle.input_names,
            controller.rate,
            F,
            G,
            command,
            memory,
            parts[2],
            parts[3],
            later=lambda extra: loop_delayed_by(further + extra),
        )

    return loop_delayed_by(np.zeros(len(delay_row)))


def _decisions(law: LawGraph, memory: Array, signals: Array, reference: Array, vehicle: Vehicle) -> tuple[Array, ...]:
    """The command, and the derivatives of command and memory by (state, memory) and by the reference."""
    casadi = require_casadi()
    n, carried, k = len(vehicle.state_names), law.memory, law.memory - law.fixed
    both, asked = casadi.MX.sym("both", n + k), casadi.MX.sym("asked", len(reference))
    everything = casadi.vertcat(both[:n], casadi.DM(signals[n:]), casadi.DM.zeros(law.draws))
    before = casadi.vertcat(both[n:], casadi.DM(memory[k:]))
    result = law.function(before, everything[law.places.tolist()], asked)
    low, high = (casadi.DM(list(limits)) for limits in zip(*vehicle.input_limits, strict=True))
    command = casadi.fmin(casadi.fmax(result[carried:], low), high)
    parts = [command, casadi.jacobian(command, both), casadi.jacobian(result[:k], both)]
    parts += [casadi.jacobian(command, asked), casadi.jacobian(result[:k], asked)]
    at = casadi.Function("decisions", [both, asked], parts)(np.concatenate([signals[:n], memory[:k]]), reference)
    commands, *slopes = (np.asarray(casadi.DM(part).full(), dtype=np.float64) for part in at)
    return (commands[:, 0], *slopes)
