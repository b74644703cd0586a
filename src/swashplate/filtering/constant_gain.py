"""One step of the observer with constant gains: the mean by the nonlinear equations, no covariance and no Jacobian."""

from __future__ import annotations

from collections.abc import Sequence

from swashplate.engine.graph import Expression
from swashplate.filtering.matrix_operations import Matrices
from swashplate.filtering.observer import (
    Numbers,
    ObserverEstimate,
    ObserverPlan,
    arriving,
    innovations_of,
    keeping,
    moving,
)
from swashplate.physics.backend import Scalar


def corrected_steadily(
    plan: ObserverPlan,
    numbers: Numbers,
    estimate: ObserverEstimate,
    y: Expression,
    phase: Expression,
    w: Expression,
    M: Matrices,
) -> ObserverEstimate:
    """The estimate after this sample's readings: a matrix in each phase of the cycle, zero for readings not due.

    Args:
        plan, numbers, estimate, y, w, M: as in `observer.corrected`.
        phase: of the cycle, in samples.
    """
    expected = M.value(lambda e, w: arriving(plan, numbers, e, w, M.xp), estimate.mean, w)
    away, mean = M.column(innovations_of(plan, y, expected, M)), estimate.mean
    for i in range(plan.period):
        now = M.xp.where(M.xp.abs(phase - i) < 0.5, 1.0, 0.0)
        mean = mean + now * (numbers.steady[i] @ away)
    return ObserverEstimate(mean, estimate.covariance)


def predicted_steadily(
    plan: ObserverPlan, numbers: Numbers, estimate: ObserverEstimate, w: Scalar, taken: Sequence[Scalar], M: Matrices
) -> ObserverEstimate:
    """The mean alone one sample later; arguments as in `observer.predicted`."""
    xp, dt, e = M.xp, plan.dt, estimate.mean
    if any(at.kept for at in plan.sampling):
        e = M.value(lambda e, w: keeping(plan, numbers, e, w, xp), e, M.column([*M.scalars(w), *taken]))
    step = M.change(lambda e, w: moving(plan, numbers, e, w, xp), e, w, dt)
    return ObserverEstimate(e + step, estimate.covariance)
