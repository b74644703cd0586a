"""One pure step of a linear-quadratic controller with its observer, and what it carries: rows of numbers.

`lqg_step` is what an aircraft runs: readings in, commands out. That commands act late is the simulation's matter: a
controller believes in delays, and an aircraft has its own.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

from swashplate.control.lqg.law import Feedback, lqr_law
from swashplate.filtering import constant_gain, observer
from swashplate.filtering.matrix_operations import Matrices
from swashplate.filtering.observer import Numbers, ObserverEstimate, ObserverPlan

LawOnEstimates = Callable[[list[Any], list[Any], list[Any], Any, list[Any]], tuple[list[Any], list[Any]]]
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
    law: LawOnEstimates | None = None,
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


def sizes(plan: ObserverPlan) -> tuple[int, int, int]:
    """Of what is carried: estimates, rows of their covariance (none with constant gains), counts."""
    if not plan.sensors:
        return 0, 0, 0
    N = len(plan.names)
    return N, 0 if plan.period else N, len(plan.sensors) + (1 if plan.period else 0)
