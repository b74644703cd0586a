"""The observer's constant gains: about one trim its covariance settles into a cycle as long as the sensors' period.

Late and slow readings are in the cycle. Its gains are computed once: what an autopilot's processor can afford is a step
that predicts the mean by the nonlinear equations and corrects it by a constant matrix (`constant_gain`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.engine.graph import Expression
from swashplate.errors import ControllerError
from swashplate.filtering import disturbances, observer
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
from swashplate.filtering.riccati import followed, gain_at, settled_covariance
from swashplate.filtering.sampled_observer_model import disturbed, outputs
from swashplate.physics.backend import Scalar
from swashplate.simulation.discretisation import zero_order_hold
from swashplate.simulation.linearize import LinearModel


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


_DOUBLINGS = 40


def steady_gains(plan: ObserverPlan, numbers: Numbers, model: LinearModel, period: int) -> tuple[Array, Array]:
    """Gains and the covariance of the predicted estimates through a cycle, (period, N, channels) and (period, N, N).

    The periodic Riccati equation: the maps of a cycle's samples, one after the other, are one map (`riccati`).

    Args:
        plan, numbers: the observer.
        model: of the vehicle about the trim.
        period: of the sensors together, in samples.

    Raises:
        ControllerError: where the covariance does not settle (something that lasts is not seen).
    """
    N = len(plan.names)
    noise, steps = np.asarray(numbers.measurement), _cycle(plan, numbers, model, period)
    Q = np.diag(np.asarray(numbers.process))
    scale = np.sqrt(np.maximum(np.diag(_first(plan, N)), 1e-12))
    maps = []
    for A, rows in steps:
        information = (rows * scale).T @ ((rows * scale) / noise[:, None])
        maps.append((A * scale / scale[:, None], information, Q / np.outer(scale, scale)))
    cycle = maps[0]
    for step in maps[1:]:
        cycle = followed(cycle, step)
    try:
        P = settled_covariance(cycle)
    except np.linalg.LinAlgError:
        raise ControllerError(
            "the observer's covariance does not settle.",
            channel="gain",
        ) from None
    gains, covariances = np.zeros((period, N, len(noise))), np.zeros((period, N, N))
    P = P * np.outer(scale, scale)
    for phase, (A, rows) in enumerate(steps):
        covariances[phase] = P
        heard = np.any(rows != 0.0, axis=1)
        H_now = rows[heard]
        if heard.any():
            gain = gain_at(P, H_now, np.diag(noise[heard]))
            keep = np.eye(N) - gain @ H_now
            P = keep @ P @ keep.T + gain @ np.diag(noise[heard]) @ gain.T
            gains[phase][:, heard] = gain
        P = A @ P @ A.T + Q
    return gains, covariances


def _cycle(plan: ObserverPlan, numbers: Numbers, model: LinearModel, period: int) -> list[tuple[Array, Array]]:
    """Of every sample of the cycle how estimates move, and the slopes of the readings that arrive (zero for others)."""
    F, shown = _transition(plan, numbers, model), outputs(plan, numbers, model.trim)
    H, steps = _arriving(plan, shown), []
    for phase in range(period):
        due = np.array([phase % at.every == at.arrives for at in plan.sampling])
        heard = np.repeat(due, [len(s.channels) for s in plan.sensors])
        taken = [phase % at.every == 0 for at in plan.sampling]
        steps.append((F @ _keeping(plan, shown, taken), np.where(heard[:, None], H, 0.0)))
    return steps


def _first(plan: ObserverPlan, N: int) -> Array:
    variances = np.full(N, 1e-4)
    first = plan.n + 6 + len(plan.biases)
    variances[:first] = observer.start_variance(plan, disturbances.Unrest())
    return np.diag(variances)


def _transition(plan: ObserverPlan, numbers: Numbers, model: LinearModel) -> Array:
    N = len(plan.names)
    return zero_order_hold(disturbed(numbers, model, N), np.zeros((N, 1)), plan.dt)[0]


def _arriving(plan: ObserverPlan, shown: Array) -> Array:
    """Slopes of what arrives: fresh readings, and of late sensors the oldest one kept."""
    H = np.array(shown)
    for at, part, place in observer.pieces(plan):
        if at.kept:
            m = part.stop - part.start
            H[part] = 0.0
            oldest = place + m * (at.kept - 1)
            H[part, oldest : oldest + m] = np.eye(m)
    return H


def _keeping(plan: ObserverPlan, shown: Array, taken: list[bool]) -> Array:
    """Slopes of putting the readings taken now in store."""
    G = np.eye(shown.shape[1])
    for now, (at, part, place) in zip(taken, observer.pieces(plan), strict=True):
        m = part.stop - part.start
        if now and at.kept:
            G[place : place + m * at.kept] = 0.0
            G[place : place + m] = shown[part]
            for i in range(m, m * at.kept):
                G[place + i, place + i - m] = 1.0
    return G


def steady_sigmas(plan: ObserverPlan, numbers: Numbers, model: LinearModel) -> Array:
    """Standard deviations of the predicted estimates' errors under constant gains, RMS over the cycle, shape (N,).

    The covariance of a filter whose gains are given (Joseph's form) through a cycle is P -> A P A' + W; the fixed point
    by doubling.

    Args:
        plan: the observer, with the period of its gains.
        numbers: with constant gains.
        model: of the vehicle about the trim.
    """
    N, Q = len(plan.names), np.diag(np.asarray(numbers.process))
    R = np.diag(np.asarray(numbers.measurement))
    steps = []
    for (A, rows), gain in zip(_cycle(plan, numbers, model, plan.period), np.asarray(numbers.steady), strict=True):
        steps.append((A @ (np.eye(N) - gain @ rows), A @ gain @ R @ gain.T @ A.T + Q))
    cycle, added = np.eye(N), np.zeros((N, N))
    for step, more in steps:
        cycle, added = step @ cycle, step @ added @ step.T + more
    for _ in range(_DOUBLINGS):
        added, cycle = added + cycle @ added @ cycle.T, cycle @ cycle
    variances = []
    for step, more in steps:
        variances.append(np.diag(added))
        added = step @ added @ step.T + more
    return np.asarray(np.sqrt(np.mean(variances, axis=0)))
