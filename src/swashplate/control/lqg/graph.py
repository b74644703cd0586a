"""The step of an LQG controller with its observer as a graph: the same step whatever runs it, traced by CasADi.

The equations of the vehicle and their exact Jacobians become straight-line code, the covariance's algebra small loops
over fixed sizes; nothing is allocated, and of the C library only sin, cos, sqrt and atan2 are called.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple, Protocol

import numpy as np

from swashplate.control.lqg.law import LAW_MEMORY, Feedback, lqr_law
from swashplate.engine.law import REFERENCES
from swashplate.engine.roots import require_casadi
from swashplate.engine.symbols import Operand
from swashplate.filtering import observer, periodic_gain
from swashplate.filtering.matrix_operations import Matrices
from swashplate.filtering.observer import Numbers, ObserverEstimate, ObserverPlan
from swashplate.filtering.sensor_suite import readings
from swashplate.physics.backend import Backend, CasadiBackend
from swashplate.physics.frames import Vector
from swashplate.physics.rigid_body import RigidBody

LawOnEstimates = Callable[
    [list[Operand], list[Operand], list[Operand], Operand, list[Operand]], tuple[list[Operand], list[Operand]]
]
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
    given: list[list[Operand]]
    counts: list[Operand]
    law: list[Operand]


def late_inputs(plan: ObserverPlan) -> list[int]:
    """The input of each late command, in the order of the design's states."""
    return [j for j, delay in enumerate(plan.delays) for _ in range(delay)]


def lqg_step(
    plan: ObserverPlan,
    numbers: Numbers,
    feedback: Feedback,
    carried: Carried,
    y: Operand,
    voltage: Operand,
    reference: list[Operand],
    M: Matrices,
    law: LawOnEstimates | None = None,
) -> tuple[Carried, list[Operand]]:
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
    xp, late_of = M.xp, late_inputs(plan)
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
            estimate = periodic_gain.corrected_steadily(plan, numbers, estimate, y, phase, w, M)
            counts.append(xp.where(phase > plan.period - 1.5, 0.0, phase + 1.0))
        else:
            estimate, _, _ = observer.corrected(plan, numbers, estimate, y, due, w, M)
        x = M.scalars(estimate.mean)[: plan.n]
    else:
        x = M.scalars(y)
    names = plan.equations.vehicle.state_names
    decided = law or partial(lqr_law, names=names, late_of=late_of, feedback=feedback, dt=plan.dt, M=M)
    kept, commands = decided(carried.law, x, waiting, voltage, reference)
    given = [commands, *carried.given[:-1]]
    if plan.sensors:
        acting = [given[delay][j] for j, delay in enumerate(plan.delays)]
        predict = periodic_gain.predicted_steadily if plan.period else observer.predicted
        estimate = predict(plan, numbers, estimate, M.column([*acting, voltage]), taken, M)
    return Carried(estimate, given, counts, kept), commands


def sizes(plan: ObserverPlan) -> tuple[int, int, int]:
    """Of what is carried: estimates, rows of their covariance (none with constant gains), counts."""
    if not plan.sensors:
        return 0, 0, 0
    N = len(plan.names)
    return N, 0 if plan.period else N, len(plan.sensors) + (1 if plan.period else 0)


_BODY = len(RigidBody._fields)


class Readable(Protocol):
    """A row of a backend's numbers."""

    def __getitem__(self, place: int, /) -> Operand: ...


def true_readings(plan: ObserverPlan, x: Readable, force: Readable, bias: Readable, xp: Backend) -> list[Operand]:
    """All channels of a true state row, without noise; x (states, ...), force (3, ...) and bias (biases, ...) are rows
    of the backend's numbers."""
    body, felt = RigidBody(*(x[i] for i in range(_BODY))), Vector(force[0], force[1], force[2])
    named = {name: bias[i] for i, name in enumerate(plan.biases)}
    return [v for sensor in plan.sensors for v in readings(sensor, body, felt, named, xp).values()]


def readings_kept(plan: ObserverPlan) -> int:
    """Readings that simulated sensors keep until they arrive, in samples."""
    return max((at.delay for at in plan.sampling), default=0) + 1


def step_graph(
    plan: ObserverPlan, numbers: Numbers, feedback: Feedback, memory: int, law: LawOnEstimates | None = None
) -> Operand:
    """`(memory, measured, reference) -> (memory, command)` as one CasADi function; `measured` ends in the voltage.

    Args:
        plan, numbers, feedback: the controller.
        memory: how many numbers it carries.
        law: another feedback on the estimates than the linear-quadratic one.
    """
    casadi = require_casadi()
    N, rows, sensors = sizes(plan)
    m, depth = plan.inputs, max(plan.delays) + 1
    read = len(plan.channels) if plan.sensors else plan.n
    carried = casadi.MX.sym("memory", memory)
    measured, reference = casadi.MX.sym("measured", read + 1), casadi.MX.sym("reference", len(REFERENCES))
    rest = carried[N + rows * rows :]
    given = [[rest[i * m + j] for j in range(m)] for i in range(depth)]
    counts = [rest[depth * m + i] for i in range(sensors)]
    kept = [rest[depth * m + sensors + i] for i in range(LAW_MEMORY)]
    estimate = ObserverEstimate(carried[:N], casadi.reshape(carried[N : N + rows * rows], rows, rows))
    gains = [casadi.DM(np.asarray(each)) for each in feedback.gains]
    if plan.period:  # columns of readings that are not due vanish from the code
        numbers = numbers._replace(steady=[casadi.sparsify(casadi.DM(np.asarray(each))) for each in numbers.steady])
    after, commands = lqg_step(
        plan,
        numbers,
        feedback._replace(gains=gains),
        Carried(estimate, given, counts, kept),
        measured[:read],
        measured[read],
        [reference[i] for i in range(len(REFERENCES))],
        Matrices(),
        law,
    )
    flat = [value for row in after.given for value in row] + after.counts + after.law
    covariance = [casadi.reshape(casadi.densify(after.estimate.covariance), rows * rows, 1)] if rows else []
    mean = [after.estimate.mean] if N else []
    result = casadi.vertcat(*mean, *covariance, *flat, *commands)
    return casadi.Function("swash_traced", [carried, measured, reference], [result])


def sensed_graph(plan: ObserverPlan, numbers: Numbers, step: Any, memory: int) -> Any:
    """The step of `step_graph` behind simulated sensors.

    Its memory has the sensors' behind it: biases, a count of samples, the last readings; `measured` is the body's state
    row, the specific force, the voltage and the draws.
    """
    casadi = require_casadi()
    nb, channels, depth = len(plan.biases), len(plan.channels), readings_kept(plan)
    drawn = channels + nb
    sizes_of = {"own": nb + 1 + depth * channels, "x": _BODY, "felt": 3, "drawn": drawn}
    carried_here, x, felt, noise = (casadi.SX.sym(name, size) for name, size in sizes_of.items())
    bias, count = carried_here[:nb], carried_here[nb]
    now = casadi.vertcat(*true_readings(plan, x, felt, bias, CasadiBackend()))
    stored = casadi.vertcat(now, carried_here[nb + 1 : nb + 1 + (depth - 1) * channels])
    queue = casadi.if_else(count < 0.5, casadi.repmat(now, depth, 1), stored)
    place = [at.delay for s, at in zip(plan.sensors, plan.sampling, strict=True) for _ in s.channels]
    wander = np.asarray(numbers.process)[plan.n + 6 : plan.n + 6 + nb]
    noisy = [
        queue[lag * channels + i] + np.sqrt(variance) * noise[i]
        for i, (lag, variance) in enumerate(zip(place, np.asarray(numbers.measurement), strict=True))
    ]
    wandered = [bias[i] + np.sqrt(wander[i]) * noise[channels + i] for i in range(nb)]
    after = casadi.vertcat(*wandered, count + 1.0, queue)
    sensing = casadi.Function(
        "swash_sensed", [carried_here, x, felt, noise], [casadi.vertcat(*noisy), casadi.densify(after)]
    )
    carried, reference = (
        casadi.MX.sym("memory", memory + carried_here.shape[0]),
        casadi.MX.sym("reference", len(REFERENCES)),
    )
    measured = casadi.MX.sym("measured", _BODY + 3 + 1 + drawn)
    y, kept = sensing(carried[memory:], measured[:_BODY], measured[_BODY : _BODY + 3], measured[_BODY + 4 :])
    stepped = step(carried[:memory], casadi.vertcat(y, measured[_BODY + 3]), reference)
    result = casadi.vertcat(stepped[:memory], kept, stepped[memory:])
    return casadi.Function("swash_traced", [carried, measured, reference], [result])
