"""The autopilot with its decoupling law on estimates: place, velocity and attitude from the observer.

The law cancels what speed does across the motion (eqs 19, 20) and so needs a velocity; few aircraft measure one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

from swashplate.arrays import Array
from swashplate.control.laws.autopilot import Autopilot, Memory, Reference, step
from swashplate.control.laws.height_yaw import HeightYawMemory
from swashplate.control.lqg.controller import Lqg
from swashplate.engine.law import LawGraph
from swashplate.errors import ControllerError
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import CasadiBackend
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.controller import Controller
from swashplate.simulation.trim import Trim

_BODY = len(RigidBody._fields)


@dataclass(frozen=True)
class ObservedAutopilot(Controller):
    """An autopilot fed by an observer; a controller for `simulate_closed_loop`.

    Attributes:
        autopilot: the law, at the observer's rate.
        observer: an `Lqg` with sensors, of which the feedback is not used.
    """

    autopilot: Autopilot
    observer: Lqg
    type: ClassVar[str] = "observed-autopilot"

    def __post_init__(self) -> None:
        if abs(self.autopilot.rate - self.observer.rate) > 1e-9 or not self.observer.plan.sensors:
            raise ControllerError("the autopilot needs an observer with sensors at its own rate.", channel="rate")

    @property
    def vehicle(self) -> str:
        return self.autopilot.vehicle

    @property
    def rate(self) -> float:
        return self.observer.rate

    @property
    def delays(self) -> dict[str, float]:
        """From command to action as its observer was designed for, by input [s]."""
        return self.observer.delays

    @property
    def drawn(self) -> int:
        return self.observer.drawn

    def law(self, vehicle: Vehicle) -> LawGraph:
        numbers = self.autopilot.numbers

        def decided(
            memory: list[Any], x: list[Any], late: list[Any], voltage: Any, reference: list[Any]
        ) -> tuple[list[Any], list[Any]]:
            carried = Memory(HeightYawMemory(*memory[:3]), memory[3], memory[4])
            body = RigidBody(*x[:_BODY])
            after, commands = step(carried, body, voltage, Reference(*reference), numbers, CasadiBackend())
            return [*after.motors, after.ahead, after.right, memory[5]], list(commands)

        return self.observer.law_with(vehicle, decided)

    def memory_of_law(self, seed: int | None = None) -> Array:
        start, end = self.observer.memory_of_law(seed), self.observer.inner_memory.size
        start[end - 6 : end - 1] = self.autopilot.memory
        return start

    def draws(self, samples: int, seed: int | None = None) -> Array:
        return self.observer.draws(samples, seed)

    def with_seed(self, seed: int) -> ObservedAutopilot:
        return replace(self, observer=self.observer.with_seed(seed))

    def starting_at(self, trim: Trim, *, seed: int | None = None) -> ObservedAutopilot:
        """The same at another start, with other noise."""
        return replace(self, observer=self.observer.starting_at(trim, seed=seed))
