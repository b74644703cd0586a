"""A linear-quadratic controller with an observer, one pure step: readings in, commands out.

`Lqg` is a controller for `simulate_closed_loop`: there its step first makes the readings from the true flight, with
noise, biases, rates and delays; `lqg_step`, what an aircraft runs, sees readings only.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, ClassVar, Protocol

import numpy as np
from jaxtyping import Float, Int

from swashplate.arrays import Array
from swashplate.control.lqg.controller_step import (
    Law,
    carried_from,
    carried_row,
    carried_size,
    lqg_step,
    numbers_from,
    numbers_row,
    sizes,
)
from swashplate.control.lqg.law import Feedback
from swashplate.errors import ControllerError
from swashplate.filtering import disturbances, observer
from swashplate.filtering.batched_matrices import StackMatrices
from swashplate.filtering.matrix_operations import JaxMatrices
from swashplate.filtering.observer import Numbers, ObserverEstimate, ObserverPlan
from swashplate.filtering.observer_slopes import linearised_at
from swashplate.filtering.sensor_suite import BIASED, readings
from swashplate.jax_on_demand import jax, jit, jnp
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import Backend
from swashplate.physics.frames import Vector
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.closed_loop import Step
from swashplate.simulation.compilation import RUN_RARELY
from swashplate.simulation.trim import Trim

_BODY = len(RigidBody._fields)
_BLOCK, _BLOCK_STEADY = 32, 256
"""Measured on two cores with 1 MB of cache each: 128 covariances take a third more time than 32."""


@dataclass(frozen=True)
class SensedStep:
    """The controller with its sensors, as `simulate_closed_loop` calls it; equal for equal plans.

    `measured` is the true state row, the specific force at the centre of gravity (`feels`), and the voltage; of many
    vehicles (`stacks`) a column each.
    """

    plan: ObserverPlan
    speeds: int
    feels: bool = True
    stacks: bool = True

    @property
    def depth(self) -> int:
        """Readings kept until they arrive, in samples."""
        return max((at.late for at in self.plan.sampling), default=0) + 1

    @property
    def block(self) -> int:
        """Vehicles of a batch whose covariances stay in a core's cache."""
        return _BLOCK if self.plan.sensors and not self.plan.period else _BLOCK_STEADY

    def __call__(
        self,
        memory: Float[jax.Array, "memory ..."],
        time: Float[jax.Array, ""],
        measured: Float[jax.Array, "measured ..."],
        reference: Float[jax.Array, " references"],
        gains: Float[jax.Array, " gains"],
    ) -> tuple[Any, Any]:
        plan, M = self.plan, JaxMatrices() if measured.ndim == 1 else StackMatrices(measured.shape[1])
        inner = carried_size(plan)
        numbers, feedback = numbers_from(plan, self.speeds, gains)
        carried, own = carried_from(plan, memory[:inner], M), memory[inner:]
        voltage = measured[-1]
        y = measured[: plan.n]
        if plan.sensors:
            y, own = self._read(own, measured[:_BODY], measured[-4:-1], numbers, M)
        wanted = [reference[i] for i in range(reference.shape[0])]
        column = M.matrix(y, y.shape[0], 1)
        after, commands = lqg_step(plan, numbers, feedback, carried, column, voltage, wanted, M, self.law(gains))
        return jnp.concatenate([carried_row(after, M), own]), M.row(commands)

    def law(self, gains: Float[jax.Array, " gains"]) -> Law | None:
        """The feedback, where it is not the linear-quadratic one."""
        return None

    def _read(
        self,
        own: Float[jax.Array, "own ..."],
        x: Float[jax.Array, "body ..."],
        force: Float[jax.Array, "3 ..."],
        numbers: Numbers,
        M: JaxMatrices,
    ) -> tuple[Any, Any]:
        """Readings that arrive now, and what the sensors carry: biases, seed, count, the last readings."""
        plan = self.plan
        nb, channels = len(plan.biases), len(plan.channels)
        bias, seed, count = own[:nb], own[nb], own[nb + 1]
        queue = own[nb + 2 :].reshape(self.depth, channels, *own.shape[1:])
        now = M.row(true_readings(plan, x, force, bias, M.xp))
        queue = jnp.where(count < 0.5, jnp.broadcast_to(now, queue.shape), jnp.concatenate([now[None], queue[:-1]]))

        drawing = partial(_drawing, channels + nb)
        each: Any = drawing if own.ndim == 1 else jax.vmap(drawing, out_axes=1)
        drawn = each(seed.astype(int), count.astype(int))
        place = [at.late for s, at in zip(plan.sensors, plan.sampling, strict=True) for _ in s.channels]
        arrived = jnp.stack([queue[late, i] for i, late in enumerate(place)])
        wander = numbers.process[plan.n + 6 : plan.n + 6 + nb]
        noisy, bias = (
            values + (jnp.sqrt(variance) * part.T).T
            for values, variance, part in (
                (arrived, numbers.measurement, drawn[:channels]),
                (bias, wander, drawn[channels:]),
            )
        )
        return noisy, jnp.concatenate([bias, jnp.stack([seed, count + 1.0]), queue.reshape(-1, *own.shape[1:])])


def _drawing(count: int, seed: Int[jax.Array, ""], sample: Int[jax.Array, ""]) -> Any:
    """What sensors draw for one sample, shape (count,)."""
    return jax.random.normal(jax.random.fold_in(jax.random.key(seed), sample), (count,))


@jit(static_argnums=0, compiler_options=RUN_RARELY)
def _drawn_compiled(count: int, seed: Int[jax.Array, ""], samples: Int[jax.Array, " samples"]) -> Any:
    each: Any = jax.vmap(partial(_drawing, count), in_axes=(None, 0))
    return each(seed, samples)


class Readable(Protocol):
    """A row of a backend's numbers."""

    def __getitem__(self, place: int, /) -> Any: ...


def true_readings(plan: ObserverPlan, x: Readable, force: Readable, bias: Readable, xp: Backend) -> list[Any]:
    """All channels of a true state row, without noise; x (states, ...), force (3, ...) and bias (biases, ...) are rows
    of the backend's numbers."""
    body, felt = RigidBody(*(x[i] for i in range(_BODY))), Vector(force[0], force[1], force[2])
    named = {name: bias[i] for i, name in enumerate(plan.biases)}
    return [v for sensor in plan.sensors for v in readings(sensor, body, felt, named, xp).values()]


@dataclass(frozen=True)
class Lqg:
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
    def step(self) -> Step:
        return self.sensed

    @property
    def sensed(self) -> SensedStep:
        """The step with its sensors."""
        return SensedStep(self.plan, len(self.feedback.speeds))

    @property
    def drawn(self) -> int:
        """How many numbers its sensors draw for a sample: noise of the channels, steps of the biases."""
        return len(self.plan.channels) + len(self.plan.biases)

    def draws(self, samples: int) -> Array:
        """What its sensors draw in flight, shape (samples, drawn)."""
        return np.asarray(_drawn_compiled(self.drawn, self.seed, jnp.arange(samples)))

    @property
    def gains(self) -> Array:
        return numbers_row(self.numbers, self.feedback)

    @property
    def memory(self) -> Array:
        """At the start: estimates at the trim; the simulated sensors' biases are drawn with the seed."""
        return np.concatenate([self.inner_memory, self._sensor_memory(self.seed)])

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
        N, own = len(plan.names), n + 6 + len(plan.biases)
        mean = np.zeros(N)
        mean[:n] = self.start.state
        variance = np.zeros(N)
        variance[:own] = observer.start_variance(plan, self.unrest)
        w = np.array([*self.start.inputs, self.start.environment.voltage, *[1.0] * len(plan.sensors)], dtype=np.float64)
        P = np.diag(variance)
        if own < N:
            deepest = max(at.kept for at in plan.sampling)
            for _ in range(deepest):  # every stored reading is one of the start
                mean, G = linearised_at(observer.keeping, plan, self.numbers, mean, w)
                P = G @ P @ G.T
        return ObserverEstimate(mean[:, None], P)

    def _sensor_memory(self, seed: int) -> Array:
        plan = self.plan
        if not plan.sensors:
            return np.zeros(0)
        random = np.random.default_rng(seed)
        bias = np.array([BIASED[name][0] for name in plan.biases]) * random.standard_normal(len(plan.biases))
        depth = self.sensed.depth
        return np.concatenate([bias, [float(seed), 0.0], np.zeros(depth * len(plan.channels))])

    def memories(self, seeds: Iterable[int]) -> Array:
        """Starts with other noise and biases each, shape (memory, number of seeds)."""
        inner = self.inner_memory
        return np.stack([np.concatenate([inner, self._sensor_memory(int(seed))]) for seed in seeds], axis=1)

    def starting_at(self, trim: Trim, *, seed: int | None = None) -> Lqg:
        """The same at another start, with other noise.

        Raises:
            ControllerError: where the trim is of a vehicle with other inputs, or, without an observer, other states.
        """
        own = self.vehicle
        strange = trim.input_names != own.input_names or (not self.plan.sensors and trim.state_names != own.state_names)
        if strange:
            raise ControllerError(
                f"was designed on another aircraft than this {len(trim.state_names)}-state one.", where=own.name
            )
        known = trim.states()
        state = [
            known.get(n, float(v)) for n, v in zip(own.state_names, np.asarray(self.feedback.states)[0], strict=True)
        ]
        start = replace(trim, state=np.array(state), state_names=own.state_names)
        return replace(self, start=start, seed=self.seed if seed is None else seed)
