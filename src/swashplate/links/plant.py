"""The vehicle at the far end of a link: outputs in, motion out, on the ground, in the air or broken."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import DivergenceError
from swashplate.links.betaflight.motors import MotorMapping
from swashplate.links.betaflight.servo_outputs import SwashServoMapping
from swashplate.links.recorder import Recorder
from swashplate.links.servo import FLOATS
from swashplate.links.servos import ServoMapping
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend, Scalar
from swashplate.physics.environment import Environment
from swashplate.simulation.standing import at_rest
from swashplate.simulation.stepping import MakeEngine, Motion, NativeFrame, Stepping, at_standstill

if TYPE_CHECKING:
    from swashplate.links.estimating import Estimating

_SPEEDS = ("u", "v", "w", "p", "q", "r")
_ALOFT = 0.02
"""m above where it stands: what estimates in flight counts from here."""
FASTEST = 500.0
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
        recorder: keeps the flights; None keeps none.
        record_rate: samples per second that it gets [Hz].
        engine: makes what moves it; None for CasADi's virtual machine.
        estimating: estimates numbers while the vehicle is in the air; None for nothing.

    Attributes:
        vehicle, mapping: as given.
        numbers: of the vehicle's card.
        standing_depth: how far the CG is above the ground when the vehicle stands [m].
        time: since it was put on the ground [s].
        voltage: of the battery now [V].
        broken: why it lies where it is; empty while it is whole.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        mapping: ServoMapping | MotorMapping | SwashServoMapping,
        around: Surroundings,
        *,
        recorder: Recorder | None = None,
        record_rate: float = 200.0,
        engine: MakeEngine | None = None,
        estimating: Estimating | None = None,
    ) -> None:
        self.vehicle, self.mapping = vehicle, mapping
        self.estimating, self._estimated = estimating, 0.0
        self._around = replace(around, environment=environment_of(vehicle, around.environment))
        self._rest = at_rest(vehicle, self.environment)
        self.standing_depth = -float(self._rest[vehicle.index("z")])
        self.numbers = vehicle.card.values()
        names = vehicle.state_names
        self._rotors = [names.index(each) for each in ("omega_lower", "omega_upper", "omega") if each in names]
        self._propellers = [k for k, each in enumerate(names) if each.startswith("omega_")] if not self._rotors else []
        self._stepping = Stepping(vehicle, self._rest, self.environment, engine=engine)
        self._recorder, self._spacing = recorder, 1.0 / record_rate
        self.restart()

    def prepare(self) -> None:
        """Compile the equations now instead of under the first packet."""
        self._stepping.advance(np.zeros(len(self.vehicle.input_names)), 1e-3)
        self.restart()

    @property
    def motion(self) -> Motion:
        """The newest motion."""
        return self._held

    @property
    def native(self) -> NativeFrame | None:
        """The C that moves it, where nothing else looks at every step; None otherwise."""
        return None if self._around.sag or self.estimating is not None else self._stepping.native

    @property
    def due(self) -> float:
        """When the next sample is recorded [s]."""
        return math.inf if self._recorder is None else self._next

    @property
    def environment(self) -> Environment:
        return self._around.environment

    def restart(self) -> None:
        """Back on the ground with the rotors stopped; what is recorded from here on is another flight."""
        self.time = 0.0
        self.broken = ""
        self.mapping.restart()
        self._stepping.place(self._rest)
        self._surround(float(self.environment.voltage))
        self._held = at_standstill(self._rest, float(self.environment.gravity))
        self._next, self._estimated = 0.0, 0.0
        if self.estimating is not None:
            self.estimating.pause()
        if self._recorder is not None:
            self._recorder.restart()

    def advance(self, pulses: Sequence[float], duration: float) -> Motion:
        """Hold outputs [us] for `duration` [s]; a vehicle that broke stays where it is. Never anything but numbers."""
        inputs = self.mapping.inputs(pulses, duration)
        if self.estimating is not None and self.time >= self._estimated + self.estimating.dt - 1e-9:
            self._estimate(self.estimating, np.asarray(inputs))
        if not self.broken:
            self._follow(lambda: self._stepping.advance(inputs, duration))
        self.time += duration
        if self._around.sag:
            low = 0.5 * self.environment.voltage
            self._surround(max(low, self.environment.voltage - self._around.sag * self.time))
        self._record(inputs)
        return self._held

    def _record(self, inputs: Sequence[float]) -> None:
        if self.time >= self._next - 1e-9:
            self._next += self._spacing
            if self._recorder is not None:
                self._recorder.add(self.time, [*self._held.states, *inputs, *self._stepping.surroundings])

    def was_flown(self, time: float, throttle: float) -> None:
        """C has moved it by `native`, until a time [s] with an engine's throttle there."""
        native, engine = self.native, self.mapping.engine
        assert native is not None
        self.time = time
        if engine is not None:
            engine.throttle = throttle
        self._follow(lambda: self._stepping.motion(native.rows[-1].tolist()))
        self._record(native.rows[1].tolist())

    def _follow(self, move: Callable[[], Motion]) -> None:
        try:
            motion = move()
        except DivergenceError as error:
            self._break(f"{error.state} left the finite numbers", self._held.states)
            return
        self._held = motion
        if motion.body.z > 0.0:
            self._break("it went over and its centre of gravity touched the ground", motion.states)
        elif max(map(abs, motion.body[3:6] + motion.body[9:12])) > FASTEST:
            self._break("it moves faster than any small helicopter can", motion.states)

    def _estimate(self, estimating: Estimating, inputs: Array) -> None:
        elapsed, self._estimated = self.time - self._estimated, self.time
        if self.broken or -self._held.body.z < self.standing_depth + _ALOFT:
            estimating.pause()
            return
        states = self._held.states[: len(estimating.model.state_names)]
        estimating.step(elapsed, states, inputs, self.voltage)

    def _surround(self, voltage: float) -> None:
        self.voltage = voltage
        self._stepping.surround(voltage=voltage)

    def rotor_speeds(self, held: Motion, xp: Backend = FLOATS) -> tuple[Scalar, Scalar]:
        """Of main and tail rotor, or of both main rotors [rad/s]; of a multirotor twice the mean."""
        if self._propellers:
            mean = sum(xp.maximum(0.0, held.states[k]) for k in self._propellers) / len(self._propellers)
            return mean, mean
        speeds = [xp.maximum(0.0, held.states[k]) for k in self._rotors]
        if len(speeds) == 2:
            return speeds[0], speeds[1]
        (main,) = speeds
        return main, main * self.numbers.get("tail_gear", 1.0)

    def _break(self, why: str, states: list[float]) -> None:
        self.broken = why
        stopped = list(states)
        for name in _SPEEDS:
            stopped[self.vehicle.index(name)] = 0.0
        self._held = at_standstill(stopped, float(self.environment.gravity))
