"""The observer with constant gains: what an autopilot's processor can afford where the trim is one.

The covariance of the extended Kalman filter about a trim settles into a cycle as long as the sensors' common period,
late and slow readings included. Its gains in that cycle are computed once; a step then predicts the mean by the
nonlinear equations and corrects it by a constant matrix: no covariance, no Jacobian.

The settled gains have forgotten that sensors' offsets are unknown at the start: they would take 20 s to learn them, and
attitude would be wrong meanwhile by twice what is promised. Gains are therefore those for offsets that wander `EAGER`
times faster; what is promised is what these gains give with the offsets' own wander.
"""

from __future__ import annotations

from dataclasses import replace
from math import lcm

import numpy as np
from numpy.typing import NDArray

from swashplate.control import observer
from swashplate.control.lqg import Lqg
from swashplate.control.observer import Numbers, Plan
from swashplate.control.optimal import sampled
from swashplate.control.seen import disturbed, outputs
from swashplate.errors import ControllerError
from swashplate.simulation.linearize import LinearModel, linearize

Array = NDArray[np.float64]
EAGER = 10.0
"""Of the CoaX with gyros, accelerometers and late motion capture offsets are learnt in 2 s instead of 21 s, attitude is
known to 0.54 instead of 0.91 mrad over the first 20 s (the filter that finds its gains as it flies: 0.49) and to 0.53
instead of 0.48 mrad in the end. With 3 it is 0.61 and 0.49 mrad, with 30 0.61 and 0.61."""
_LONGEST = 50
"""Samples of the sensors' common period; each has a gain matrix in the controller."""
_DOUBLINGS = 40
_SETTLED = 1e-13


def with_steady_gain(controller: Lqg) -> Lqg:
    """The same controller with constant observer gains.

    Raises:
        ControllerError: without sensors, for gains over speed (one trim only), for sensors whose rates have a long
            common period, or where the covariance does not settle.
    """
    plan, where = controller.plan, controller.vehicle.card.path or controller.vehicle.name
    if not plan.sensors:
        raise ControllerError("has no observer.", where=where, channel="gain", hint="Use --method lqg.")
    if np.size(controller.feedback.speeds) != 1:
        raise ControllerError(
            "is one matrix, good about one trim, and the gains are scheduled over several speeds.",
            where=where,
            channel="gain",
            hint="Give one speed, or let the observer find its gains as it flies.",
        )
    period = lcm(*(at.every for at in plan.sampling))
    if period > _LONGEST:
        rates = ", ".join(map(str, plan.sensors))
        raise ControllerError(
            f"repeats only after {period} samples for {rates} at {plan.rate:g} Hz, expected at most {_LONGEST}.",
            where=where,
            channel="gain",
            hint="Choose sensor rates that divide each other.",
        )
    process = np.array(controller.numbers.process)
    process[plan.n + 6 : plan.n + 6 + len(plan.biases)] *= EAGER**2
    eager = controller.numbers._replace(process=process)
    gains, _ = steady_gains(plan, eager, linearize(controller.vehicle, controller.start), period)
    numbers = controller.numbers._replace(steady=gains)
    return replace(controller, plan=replace(plan, period=period), numbers=numbers)


def steady_gains(plan: Plan, numbers: Numbers, model: LinearModel, period: int) -> tuple[Array, Array]:
    """Gains and the covariance of the predicted estimates through a cycle, (period, N, channels) and (period, N, N).

    The periodic Riccati equation by doubling: maps P -> H + A P (I + G P)^-1 A' compose into one of the same form
    (Anderson 1978; Chu, Fan and Lin 2005).

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
    whole = maps[0]
    for step in maps[1:]:
        whole = _then(whole, step)
    P = whole[2]
    for _ in range(_DOUBLINGS):
        whole = _then(whole, whole)
        change = np.max(np.abs(whole[2] - P)) / max(float(np.max(np.abs(whole[2]))), 1e-300)
        P = whole[2]
        if not np.all(np.isfinite(P)) or change < _SETTLED:
            break
    if not np.all(np.isfinite(P)) or change > 1e-6:
        raise ControllerError(
            "the observer's covariance does not settle.",
            channel="gain",
            hint="`swash control observability` says what the sensors do not see.",
        )
    gains, covariances = np.zeros((period, N, len(noise))), np.zeros((period, N, N))
    P = P * np.outer(scale, scale)
    for phase, (A, rows) in enumerate(steps):
        covariances[phase] = P
        heard = np.any(rows != 0.0, axis=1)
        H_now = rows[heard]
        if heard.any():
            gain = np.linalg.solve(H_now @ P @ H_now.T + np.diag(noise[heard]), H_now @ P).T
            keep = np.eye(N) - gain @ H_now
            P = keep @ P @ keep.T + gain @ np.diag(noise[heard]) @ gain.T
            gains[phase][:, heard] = gain
        P = A @ P @ A.T + Q
    return gains, covariances


def _cycle(plan: Plan, numbers: Numbers, model: LinearModel, period: int) -> list[tuple[Array, Array]]:
    """Of every sample of the cycle how estimates move, and the slopes of the readings that arrive (zero for others)."""
    F, shown = _transition(plan, numbers, model), outputs(plan, numbers, model.trim)
    H, steps = _arriving(plan, shown), []
    for phase in range(period):
        due = np.array([phase % at.every == at.arrives for at in plan.sampling])
        heard = np.repeat(due, [len(s.channels) for s in plan.sensors])
        taken = [phase % at.every == 0 for at in plan.sampling]
        steps.append((F @ _keeping(plan, shown, taken), np.where(heard[:, None], H, 0.0)))
    return steps


def _then(first: tuple[Array, Array, Array], second: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
    """The map of two steps, one after the other."""
    (A1, G1, H1), (A2, G2, H2) = first, second
    identity = np.eye(len(A1))
    inner = np.linalg.solve(identity + H1 @ G2, np.hstack([A1, H1]))
    n = len(A1)
    turned = np.linalg.solve(identity + G2 @ H1, G2)
    G, H = G1 + A1.T @ turned @ A1, H2 + A2 @ inner[:, n:] @ A2.T
    return A2 @ inner[:, :n], 0.5 * (G + G.T), 0.5 * (H + H.T)


def _first(plan: Plan, N: int) -> Array:
    found = np.full(N, 1e-4)
    own = plan.n + 6 + len(plan.biases)
    found[:own] = observer.start_variance(plan, observer.Unrest())
    return np.diag(found)


def _transition(plan: Plan, numbers: Numbers, model: LinearModel) -> Array:
    N = len(plan.names)
    return sampled(disturbed(numbers, model, N), np.zeros((N, 1)), plan.dt)[0]


def _arriving(plan: Plan, shown: Array) -> Array:
    """Slopes of what arrives: fresh readings, and of late sensors the oldest one kept."""
    H = np.array(shown)
    for at, part, place in observer.pieces(plan):
        if at.kept:
            m = part.stop - part.start
            H[part] = 0.0
            oldest = place + m * (at.kept - 1)
            H[part, oldest : oldest + m] = np.eye(m)
    return H


def _keeping(plan: Plan, shown: Array, taken: list[bool]) -> Array:
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


def steady_sigmas(controller: Lqg) -> Array:
    """Standard deviations of the predicted estimates' errors under constant gains, RMS over the cycle, shape (N,).

    The covariance of a filter whose gains are given (Joseph's form) through a cycle is P -> A P A' + W; the fixed point
    by doubling.
    """
    plan, numbers = controller.plan, controller.numbers
    N, Q = len(plan.names), np.diag(np.asarray(numbers.process))
    R, model = np.diag(np.asarray(numbers.measurement)), linearize(controller.vehicle, controller.start)
    steps = []
    for (A, rows), gain in zip(_cycle(plan, numbers, model, plan.period), np.asarray(numbers.steady), strict=True):
        steps.append((A @ (np.eye(N) - gain @ rows), A @ gain @ R @ gain.T @ A.T + Q))
    whole, added = np.eye(N), np.zeros((N, N))
    for moved, more in steps:
        whole, added = moved @ whole, moved @ added @ moved.T + more
    for _ in range(_DOUBLINGS):
        added, whole = added + whole @ added @ whole.T, whole @ whole
    variances = []
    for moved, more in steps:
        variances.append(np.diag(added))
        added = moved @ added @ moved.T + more
    return np.asarray(np.sqrt(np.mean(variances, axis=0)))
