"""How the outputs of a linear model answer what it may lack: cross controls, and lags within its delays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.identification.time.linear_simulation import driven
from swashplate.simulation.discretisation import first_order_hold

if TYPE_CHECKING:
    from swashplate.identification.time.linear_likelihood import Coefficients

_CROSS = 0.1
"""Size that a cross control may have, as a share of the largest effect of an input on the same state's rate."""

_LAG, _DAMPING = 1.0 / 3.0, 0.7
"""Share of a delay that may be a lag of second order, as an actuator's, and its damping."""


def cross_controls(b: Array, spread: Array) -> list[tuple[int, int, float]]:
    """State and input that a model leaves apart though other inputs act there, and the size that this may have.

    Args:
        b: of dx/dt = A x + B u, (n_states, n_inputs). spread: standard deviation of each input.
    """
    effect = np.max(np.abs(b) * spread, axis=1)
    return [
        (k, j, _CROSS * float(effect[k] / spread[j]))
        for k, j in np.argwhere((b == 0.0) & (effect > 0.0)[:, None] & (spread > 0.0)).tolist()
    ]


def missing_answers(
    base: Coefficients,
    a: Array,
    inputs: Array,
    dt: float,
    crossed: Sequence[tuple[int, int, float]],
    lagged: NDArray[np.intp],
    delays: Array,
) -> Array:
    """Change of the predicted outputs by each part of the size that it may have, (parts, n_t, n_outputs).

    A lag of second order in the place of as much delay T changes an answer by (1 / (4 d^2) - 1/3) (T s)^3, with the
    damping d; the term of second order is nothing at 0.71. Two of the derivatives are taken of the answer.

    Args:
        base: along the record. a: of dx/dt = A x + B u. inputs: later by their delays (n_t, n_inputs). dt: step [s].
        crossed: of `cross_controls`. lagged: inputs with a delay. delays: of every input [s].
    """
    n_t, n = len(inputs), len(a)
    apart = inputs - inputs.mean(axis=0)
    _, q0, q1 = first_order_hold(a, np.eye(n), dt)
    push, through = np.zeros((n_t, len(crossed) + len(lagged), n)), np.zeros((n_t, len(lagged), base.c.shape[0]))
    for i, (k, j, size) in enumerate(crossed):
        push[:, i] = size * _held(apart[:, j], q0[:, k], q1[:, k])
    for i, j in enumerate(lagged):
        rate = np.gradient(inputs[:, j], dt)
        through[:, i] = rate[:, None] * base.d[:, j]
        push[:, len(crossed) + i] = _held(rate, base.g0[:, j], base.g1[:, j]) - through[:, i] @ base.gain.T
    answers = driven(np.zeros(push.shape[1:]), base.phi - base.gain @ base.c, push)[0] @ base.c.T
    late_answers = np.gradient(np.gradient(answers[:, len(crossed) :] + through, dt, axis=0), dt, axis=0)
    third = (0.25 / _DAMPING**2 - 1.0 / 3.0) * (_LAG * delays[lagged]) ** 3
    answers[:, len(crossed) :] = third[:, None] * late_answers
    return np.ascontiguousarray(np.moveaxis(answers, 1, 0))


def _held(signal: Array, g0: Array, g1: Array) -> Array:
    """What a signal, straight between samples, adds to the next states (n_t, n_states); nothing after the last."""
    drive = np.outer(signal, g0)
    drive[:-1] += np.outer(np.diff(signal), g1)
    drive[-1] = 0.0
    return drive
