"""The vehicle at the far end of a link: outputs in, motion out, on the ground, in the air or broken."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from swashplate.errors import DivergenceError
from swashplate.flights.flight import Flight
from swashplate.links.servos import ServoMapping
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Vector
from swashplate.simulation.dynamics import SURROUNDINGS
from swashplate.simulation.record import simulated_flight
from swashplate.simulation.standing import at_rest
from swashplate.simulation.stepping import Array, Motion, Stepping, motion
from swashplate.vehicles.vehicle import Vehicle

_SPEEDS = ("u", "v", "w", "p", "q", "r")
_FASTEST = 500.0
"""m/s and rad/s: nothing of ours moves so fast in one piece."""


@dataclass(frozen=True)
class Surroundings:
    """Where the vehicle stands.

    Attributes:
        environment: wind, air, gravity, and the battery's voltage at the start.
        sag: fall of the voltage [V/s]; it ends at half the voltage.
    """

    environment: Environment
    sag: float = 0.0


class Plant:
    """A vehicle that stands on the ground at first.

    Args:
        vehicle: from `standing`.
        mapping: from outputs to its inputs.
        around: wind, air and battery.
        record_rate: samples per second that are kept for `flight` [Hz]; 0 keeps none.

    Attributes:
        vehicle, mapping: as given.
        numbers: of the vehicle's card.
        standing_depth: how far the CG is above the ground when the vehicle stands [m].
        time: since it was put on the ground [s].
        broken: why it lies where it is; empty while it is whole.
    """

    def __init__(
        self, vehicle: Vehicle, mapping: ServoMapping, around: Surroundings, *, record_rate: float = 0.0
    ) -> None:
        self.vehicle, self.mapping = vehicle, mapping
        self._around = around
        self._rest = at_rest(vehicle, around.environment)
        self.standing_depth = -float(self._rest[vehicle.index("z")])
        self.numbers = vehicle.card.values()
        self._stepping = Stepping(vehicle, self._rest, around.environment)
        self._spacing = 1.0 / record_rate if record_rate > 0.0 else np.inf
        self.restart()

    def prepare(self) -> None:
        """Compile the equations now instead of under the first packet."""
        self._stepping.advance(np.zeros(len(self.vehicle.input_names)), 1e-3)
        self.restart()

    @property
    def voltage(self) -> float:
        """Of the battery now [V]."""
        return float(self._stepping.surroundings[SURROUNDINGS.index("voltage")])

    @property
    def environment(self) -> Environment:
        return self._around.environment

    def restart(self) -> None:
        """Back on the ground with the rotors stopped; what was recorded is dropped."""
        self.time = 0.0
        self.broken = ""
        self.mapping.restart()
        self._stepping.place(self._rest)
        self._stepping.surround(voltage=self.environment.voltage)
        self._held = self._resting(self._rest)
        self._next = 0.0
        self._times: list[float] = []
        self._states: list[Array] = []
        self._rows: list[Array] = []

    def advance(self, pulses: Sequence[float], duration: float) -> Motion:
        """Hold outputs [us] for `duration` [s]; a vehicle that broke stays where it is. Never anything but numbers."""
        inputs = self.mapping.inputs(pulses, duration)
        if not self.broken:
            try:
                moved = self._stepping.advance(inputs, duration)
            except DivergenceError as error:
                self._break(f"{error.state} left the finite numbers", self._held.states)
            else:
                self._held = moved
                if moved.body.z > 0.0:
                    self._break("it went over and its centre of gravity touched the ground", moved.states)
                elif max(map(abs, moved.body[3:6] + moved.body[9:12])) > _FASTEST:
                    self._break("it moves faster than any small helicopter can", moved.states)
        self.time += duration
        if self._around.sag:
            low = 0.5 * self.environment.voltage
            self._stepping.surround(voltage=max(low, self.environment.voltage - self._around.sag * self.time))
        if self.time >= self._next - 1e-9:
            self._next += self._spacing
            self._times.append(self.time)
            self._states.append(self._held.states)
            self._rows.append(np.concatenate([inputs, self._stepping.surroundings]))
        return self._held

    def rotor_speeds(self, held: Motion) -> tuple[float, float]:
        """Of main and tail rotor, or of lower and upper rotor [rad/s]."""
        names = self.vehicle.state_names
        if "omega_lower" in names:
            lower, upper = held.states[names.index("omega_lower")], held.states[names.index("omega_upper")]
            return max(0.0, float(lower)), max(0.0, float(upper))
        main = max(0.0, float(held.states[names.index("omega")]))
        return main, main * self.numbers["tail_gear"]

    def flight(self) -> Flight | None:
        """What was recorded since the last restart: true states, inputs, wind and voltage; None for too little."""
        if len(self._times) < 2:
            return None
        return simulated_flight(
            self.vehicle,
            np.array(self._times),
            np.array(self._states),
            np.array(self._rows),
            details={"link": True, "rate": 1.0 / self._spacing},
        )

    def _break(self, why: str, states: Array) -> None:
        self.broken = why
        stopped = np.array(states)
        for name in _SPEEDS:
            stopped[self.vehicle.index(name)] = 0.0
        self._held = self._resting(stopped)

    def _resting(self, states: Array) -> Motion:
        return motion(states, Vector(0.0, 0.0, 0.0), float(self.environment.gravity))
