"""The autopilot with its decoupling law on estimates: place, velocity and attitude from the observer.

The law cancels what speed does across the motion (eqs 19, 20) and so needs a velocity; few aircraft measure one.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from swashplate.arrays import Array
from swashplate.control.laws.autopilot import Autopilot, Memory, Reference, step, unpack
from swashplate.control.laws.height_yaw import HeightYawMemory
from swashplate.control.lqg.controller import Lqg, SensedStep
from swashplate.control.lqg.controller_step import Law
from swashplate.errors import ControllerError
from swashplate.jax_on_demand import jax
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.dynamics import jax_backend
from swashplate.simulation.trim import Trim

_BODY = len(RigidBody._fields)


@dataclass(frozen=True)
class ObservedStep(SensedStep):
    """The autopilot's step behind the observer's; the autopilot's numbers end the row of gains."""

    autopilot_gains: int = 0

    def law(self, gains: Float[jax.Array, " gains"]) -> Law | None:
        numbers = unpack(gains[gains.shape[0] - self.autopilot_gains :])

        def decided(
            memory: list[Any], x: list[Any], late: list[Any], voltage: Any, reference: list[Any]
        ) -> tuple[list[Any], list[Any]]:
            carried = Memory(HeightYawMemory(*memory[:3]), memory[3], memory[4])
            body = RigidBody(*x[:_BODY])
            after, commands = step(carried, body, voltage, Reference(*reference), numbers, jax_backend())
            return [*after.motors, after.ahead, after.right, memory[5]], list(commands)

        return decided


@dataclass(frozen=True)
class ObservedAutopilot:
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
    def step(self) -> ObservedStep:
        speeds = len(self.observer.feedback.speeds)
        return ObservedStep(self.observer.plan, speeds, autopilot_gains=self.autopilot.gains.size)

    @property
    def gains(self) -> Array:
        return np.concatenate([self.observer.gains, self.autopilot.gains])

    @property
    def memory(self) -> Array:
        return self.memories([self.observer.seed])[:, 0]

    def memories(self, seeds: Iterable[int]) -> Array:
        """Starts with other noise and biases each, shape (memory, number of seeds)."""
        starts = self.observer.memories(seeds)
        end = self.observer.inner_memory.size
        starts[end - 6 : end - 1] = self.autopilot.memory[:, None]
        return starts

    def starting_at(self, trim: Trim, *, seed: int | None = None) -> ObservedAutopilot:
        """The same at another start, with other noise."""
        return replace(self, observer=self.observer.starting_at(trim, seed=seed))
