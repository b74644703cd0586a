"""A linear-quadratic controller with an observer, one pure step: readings in, commands out.

`Lqg` is a controller for `simulate_closed_loop`: there its step first makes the readings from the true flight, with
noise, biases, rates and delays. `lqg_step`, what an aircraft runs, sees readings only. That commands act late is the
simulation's matter: a controller believes in delays, and an aircraft has its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, ClassVar, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from swashplate.arrays import Array
from swashplate.control.lqg.law import LAW_MEMORY, Feedback, lqr_law
from swashplate.errors import ControllerError
from swashplate.filtering import constant_gain, disturbances, observer
from swashplate.filtering.batched_matrices import StackMatrices
from swashplate.filtering.matrix_operations import JaxMatrices, Matrices
from swashplate.filtering.observer import Numbers, ObserverEstimate, ObserverPlan
from swashplate.filtering.sensor_suite import BIASED, readings
from swashplate.models.vehicle import Vehicle
from swashplate.physics.frames import Vector
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.closed_loop import Step
from swashplate.simulation.compilation import QUICK_TO_COMPILE
from swashplate.simulation.trim import Trim

_BODY = len(RigidBody._fields)
_BLOCK, _BLOCK_STEADY = 32, 256
"""Measured on two cores with 1 MB of cache each: 128 covariances take a third more time than 32."""


Law = Callable[[list[Any], list[Any], list[Any], Any, list[Any]], tuple[list[Any], list[Any]]]
"""(memory, states, late commands, voltage, reference) to (memory, commands), as `lqr_law`."""


class Carried(NamedTuple):
    """What a step carries to the next.

    Attributes:
        estimate: of the observer.
        given: commands, newest first, a row per sample, as many as the longest delay and one.
        counts: samples since each sensor last took a reading, and with constant gains the phase of their cycle.
        law: memory of the feedback.
    """

    estimate: ObserverEstimate
    given: list[list[Any]]
    counts: list[Any]
    law: list[Any]


def late_inputs(plan: ObserverPlan) -> list[int]:
    """The input of each late command, in the order of the design's states."""
    return [j for j, delay in enumerate(plan.delays) for _ in range(delay)]


def lqg_step(
    plan: ObserverPlan,
    numbers: Numbers,
    feedback: Feedback,
    carried: Carried,
    y: Any,
    voltage: Any,
    reference: list[Any],
    M: Matrices,
    law: Law | None = None,
) -> tuple[Carried, list[Any]]:
    """One step of the controller.

    Args:
        plan, numbers, feedback: the controller.
        carried: from the last step.
        y: readings of all channels, a column; those not due may be anything finite. Without sensors the states.
        voltage: the battery's [V].
        reference: the row of `REFERENCES`.
        M: the operations.
        law: another feedback on the estimates than the linear-quadratic one.

    Returns:
        What is carried on, and the commands within their limits.
    """
    xp, late = M.xp, late_inputs(plan)
    before = [carried.given[delay][j] for j, delay in enumerate(plan.delays)]
    waiting = [carried.given[ago][j] for j, delay in enumerate(plan.delays) for ago in range(delay)]
    estimate = carried.estimate
    taken, counts = [], []
    if plan.sensors:
        since = carried.counts[: len(plan.sensors)]
        due = [
            xp.where(xp.abs(count - at.arrives) < 0.5, 1.0, 0.0) for count, at in zip(since, plan.sampling, strict=True)
        ]
        taken = [xp.where(count < 0.5, 1.0, 0.0) for count in since]
        counts = [
            xp.where(count > at.every - 1.5, 0.0, count + 1.0) for count, at in zip(since, plan.sampling, strict=True)
        ]
        w = M.column([*before, voltage])
        if plan.period:
            phase = carried.counts[-1]
            estimate = constant_gain.corrected_steadily(plan, numbers, estimate, y, phase, w, M)
            counts.append(xp.where(phase > plan.period - 1.5, 0.0, phase + 1.0))
        else:
            estimate, _, _ = observer.corrected(plan, numbers, estimate, y, due, w, M)
        x = M.scalars(estimate.mean)[: plan.n]
    else:
        x = M.scalars(y)
    names = plan.equations.vehicle.state_names
    decided = law or partial(lqr_law, names=names, late_of=late, feedback=feedback, dt=plan.dt, M=M)
    kept, commands = decided(carried.law, x, waiting, voltage, reference)
    given = [commands, *carried.given[:-1]]
    if plan.sensors:
        acting = [given[delay][j] for j, delay in enumerate(plan.delays)]
        moved = constant_gain.predicted_steadily if plan.period else observer.predicted
        estimate = moved(plan, numbers, estimate, M.column([*acting, voltage]), taken, M)
    return Carried(estimate, given, counts, kept), commands


# ---- rows --------------------------------------------------------------------------------------------------------
def sizes(plan: ObserverPlan) -> tuple[int, int, int]:
    """Of what is carried: estimates, rows of their covariance (none with constant gains), counts."""
    if not plan.sensors:
        return 0, 0, 0
    N = len(plan.names)
    return N, 0 if plan.period else N, len(plan.sensors) + (1 if plan.period else 0)


def carried_size(plan: ObserverPlan) -> int:
    N, rows, counts = sizes(plan)
    return N + rows * rows + (max(plan.delays) + 1) * plan.inputs + counts + LAW_MEMORY


def carried_from(plan: ObserverPlan, row: Float[jax.Array, "memory ..."], M: JaxMatrices) -> Carried:
    """What is carried, from a flat row."""
    N, rows, counts = sizes(plan)
    m, depth = plan.inputs, max(plan.delays) + 1
    covariance, rest = M.matrix(row[N : N + rows * rows], rows, rows), row[N + rows * rows :]
    given = [[rest[i * m + j] for j in range(m)] for i in range(depth)]
    rest = rest[depth * m :]
    return Carried(
        ObserverEstimate(M.matrix(row[:N], N, 1), covariance),
        given,
        [rest[i] for i in range(counts)],
        [rest[counts + i] for i in range(LAW_MEMORY)],
    )


def carried_row(carried: Carried, M: JaxMatrices) -> Any:
    flat = [value for row in carried.given for value in row] + carried.counts + carried.law
    return jnp.concatenate([*(M.flat(part) for part in carried.estimate), M.row(flat)])


def _shapes(plan: ObserverPlan, speeds: int) -> list[tuple[int, ...]]:
    n, m, late = plan.n, plan.inputs, sum(plan.delays)
    N, channels = len(plan.names), len(plan.channels)
    parameters = len(plan.equations.vehicle.parameter_names) + 2
    of_feedback = [(speeds,), (speeds, n), (speeds, m), (speeds, m, n + late + 4), (m,), (), (m,), (m,), (), (), ()]
    steady = [(plan.period, N, channels)] if plan.period else []
    return [(parameters,), (6,), (N,), (channels,), *steady, *of_feedback]


def numbers_row(numbers: Numbers, feedback: Feedback) -> Array:
    parts = [part for part in (*numbers, *feedback) if part is not None]
    return np.concatenate([np.ravel(np.asarray(part, dtype=np.float64)) for part in parts])


def numbers_from(plan: ObserverPlan, speeds: int, row: Float[jax.Array, " numbers"]) -> tuple[Numbers, Feedback]:
    parts, place = [], 0
    for shape in _shapes(plan, speeds):
        size = int(np.prod(shape))
        parts.append(row[place : place + size].reshape(shape))
        place += size
    own = len(parts) - len(Feedback._fields)
    return Numbers(*parts[:own]), Feedback(*parts[own:])


# ---- in simulation -----------------------------------------------------------------------------------------------
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
        now = true_readings(plan, x, force, bias, M)
        queue = jnp.where(count < 0.5, jnp.broadcast_to(now, queue.shape), jnp.concatenate([now[None], queue[:-1]]))

        def drawing(seed: Int[jax.Array, ""], count: Int[jax.Array, ""]) -> Any:
            return jax.random.normal(jax.random.fold_in(jax.random.key(seed), count), (channels + nb,))

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


def true_readings(
    plan: ObserverPlan,
    x: Float[jax.Array, "states ..."],
    force: Float[jax.Array, "3 ..."],
    bias: Float[jax.Array, "biases ..."],
    M: JaxMatrices,
) -> Any:
    """All channels of a true state row, without noise."""
    body, felt = RigidBody(*(x[i] for i in range(_BODY))), Vector(force[0], force[1], force[2])
    named = {name: bias[i] for i, name in enumerate(plan.biases)}
    return M.row([v for sensor in plan.sensors for v in readings(sensor, body, felt, named, M.xp).values()])


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
        figures: what the design found, by name (modes, margins, expected spread), for its file and reader.
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
        return SensedStep(self.plan, len(self.feedback.speeds))

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
        mean = np.zeros((N, 1))
        mean[:n, 0] = self.start.state
        variance = np.zeros(N)
        variance[:own] = observer.start_variance(plan, self.unrest)
        w = np.array([*self.start.inputs, float(self.start.environment.voltage)])[:, None]
        P = np.diag(variance)
        if own < N:
            deepest = max(at.kept for at in plan.sampling)
            for _ in range(deepest):  # every stored reading is one of the start
                found = _stored(plan, self.numbers, mean, w)
                mean, G = (np.asarray(part, dtype=np.float64) for part in found)
                P = G @ P @ G.T
        return ObserverEstimate(mean, P)

    def _sensor_memory(self, seed: int) -> Array:
        plan = self.plan
        if not plan.sensors:
            return np.zeros(0)
        random = np.random.default_rng(seed)
        bias = np.array([BIASED[name][0] for name in plan.biases]) * random.standard_normal(len(plan.biases))
        depth = SensedStep(plan, 1).depth
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


def _stored(plan: ObserverPlan, numbers: Numbers, mean: ArrayLike, w: ArrayLike) -> Any:
    made = Numbers(*(None if part is None else jnp.asarray(part) for part in numbers))
    return _stored_compiled(plan, made, jnp.asarray(mean), jnp.asarray(w))


@partial(jax.jit, static_argnums=0, compiler_options=QUICK_TO_COMPILE)
def _stored_compiled(
    plan: ObserverPlan, numbers: Numbers, mean: Float[jax.Array, "n 1"], w: Float[jax.Array, " driving"]
) -> Any:
    M = JaxMatrices()
    flags = M.column([*M.scalars(w), *[1.0] * len(plan.sensors)])
    return M.linearised(lambda e, w: observer.keeping(plan, numbers, e, w, M.xp), mean, flags)
