"""A linear-quadratic controller with an observer, one pure step: readings in, commands out.

`Lqg` is a controller for `simulate_closed_loop`: there its law first makes the readings from the true flight, with
noise, biases, rates and delays; `lqg_step`, what an aircraft runs, sees readings only.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from swashplate.arrays import Array
from swashplate.control.lqg.graph import LawOnEstimates, readings_kept, sensed_graph, sizes, step_graph
from swashplate.control.lqg.law import Feedback
from swashplate.engine.law import FELT, LawGraph, draw_names
from swashplate.errors import ControllerError
from swashplate.filtering import disturbances, observer
from swashplate.filtering.observer import Numbers, ObserverEstimate, ObserverPlan
from swashplate.filtering.sensor_suite import BIASED
from swashplate.models.vehicle import Vehicle
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.controller import Controller, told_names
from swashplate.simulation.trim import Trim

_NOISE = 1
"""Of a seed: the stream of its sensors' noise, beside that of their biases."""


@dataclass(frozen=True)
class Lqg(Controller):
    """A linear-quadratic controller.

    Attributes:
        vehicle: the model that it was designed on (and that its observer predicts with).
        plan: sensors, rate, delays. Without sensors it is fed with the true states (LQR).
        numbers, feedback: its numbers.
        start: the trim that it begins at.
        unrest: what its process noise was made of.
        seed: of the simulated sensors.
        figures: what the design found, by name: "crossover_limits", of the loops by input [rad/s], infinite where the
            effort was given; empty for one from a file.
    """

    vehicle: Vehicle
    plan: ObserverPlan
    numbers: Numbers
    feedback: Feedback
    start: Trim
    unrest: disturbances.Unrest
    seed: int = 0
    figures: Mapping[str, Any] = field(default_factory=dict, compare=False)
    type: ClassVar[str] = "lqg"

    @property
    def rate(self) -> float:
        """How often it runs [Hz]."""
        return self.plan.rate

    @property
    def delays(self) -> dict[str, float]:
        """From command to action as it was designed for, by input [s]: whole samples."""
        return {n: d / self.plan.rate for n, d in zip(self.vehicle.input_names, self.plan.delays, strict=True)}

    @property
    def drawn(self) -> int:
        """How many numbers its sensors draw for a sample: noise of the channels, steps of the biases."""
        return len(self.plan.channels) + len(self.plan.biases)

    def draws(self, samples: int, seed: int | None = None) -> Array:
        number = self.seed if seed is None else seed
        return np.random.default_rng([number, _NOISE]).standard_normal((samples, self.drawn))

    def graph(self, law: LawOnEstimates | None = None) -> Any:
        """Its step, what an aircraft runs, as a CasADi function (`graph.step_graph`)."""
        return step_graph(self.plan, self.numbers, self.feedback, self.inner_memory.size, law)

    def law(self, vehicle: Vehicle) -> LawGraph:
        return self.law_with(vehicle)

    def law_with(self, vehicle: Vehicle, law: LawOnEstimates | None = None) -> LawGraph:
        """Its law with another feedback on the estimates; with its sensors, where it has any."""
        step, inner = self.graph(law), self.inner_memory.size
        if not self.plan.sensors:
            measured = (*self.vehicle.state_names, "voltage")
            return LawGraph(step, measured, told_names(vehicle, 0), inner, 0)
        measured = (*RigidBody._fields, *FELT, "voltage", *draw_names(self.drawn))
        sensed = sensed_graph(self.plan, self.numbers, step, inner)
        return LawGraph(sensed, measured, told_names(vehicle, self.drawn), sensed.size1_in(0), self.drawn)

    def memory_of_law(self, seed: int | None = None) -> Array:
        """At the start: estimates at the trim; the simulated sensors' biases are drawn with the seed."""
        return np.concatenate([self.inner_memory, self._sensor_memory(self.seed if seed is None else seed)])

    def with_seed(self, seed: int) -> Lqg:
        return replace(self, seed=seed)

    @property
    def inner_memory(self) -> Array:
        """What an aircraft carries at the start."""
        plan = self.plan
        given = np.tile(self.start.inputs, max(plan.delays) + 1)
        law = [*[0.0] * 4, self.start.speed, self.start.speed]
        tail = np.concatenate([given, np.zeros(sizes(plan)[2]), law])
        if not plan.sensors:
            return tail
        estimate = self.first_estimate()
        known = [] if plan.period else [estimate.covariance.ravel()]
        return np.concatenate([estimate.mean.ravel(), *known, tail])

    def first_estimate(self) -> ObserverEstimate:
        """At the trim, stored readings included."""
        plan, n = self.plan, self.plan.n
        N, estimated = len(plan.names), n + 6 + len(plan.biases)
        mean = np.zeros(N)
        mean[:n] = self.start.state
        variance = np.zeros(N)
        variance[:estimated] = observer.start_variance(plan, self.unrest)
        w = np.array([*self.start.inputs, self.start.environment.voltage, *[1.0] * len(plan.sensors)], dtype=np.float64)
        P = np.diag(variance)
        if estimated < N:
            deepest = max(at.kept for at in plan.sampling)
            for _ in range(deepest):  # every stored reading is one of the start
                mean, G = observer.linearised_at(observer.keeping, plan, self.numbers, mean, w)
                P = G @ P @ G.T
        return ObserverEstimate(mean[:, None], P)

    def _sensor_memory(self, seed: int) -> Array:
        plan = self.plan
        if not plan.sensors:
            return np.zeros(0)
        random = np.random.default_rng(seed)
        bias = np.array([BIASED[name][0] for name in plan.biases]) * random.standard_normal(len(plan.biases))
        return np.concatenate([bias, [0.0], np.zeros(readings_kept(plan) * len(plan.channels))])

    def starting_at(self, trim: Trim, *, seed: int | None = None) -> Lqg:
        """The same at another start, with other noise.

        Raises:
            ControllerError: where the trim is of a vehicle with other inputs, or, without an observer, other states.
        """
        designed = self.vehicle
        strange = trim.input_names != designed.input_names or (
            not self.plan.sensors and trim.state_names != designed.state_names
        )
        if strange:
            raise ControllerError(
                f"was designed on another aircraft than this {len(trim.state_names)}-state one.", where=designed.name
            )
        known = trim.states()
        state = [
            known.get(n, float(v))
            for n, v in zip(designed.state_names, np.asarray(self.feedback.states)[0], strict=True)
        ]
        start = replace(trim, state=np.array(state), state_names=designed.state_names)
        return replace(self, start=start, seed=self.seed if seed is None else seed)
