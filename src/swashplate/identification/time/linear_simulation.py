"""Linear models flown along recorded inputs: straight between samples, delays and all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import schur, solve_sylvester

from swashplate.arrays import Array
from swashplate.simulation.discretisation import first_order_hold

if TYPE_CHECKING:
    from swashplate.models.linear.state_space import StateSpaceModel


def delayed(values: Array, lag: float) -> Array:
    """A sampled signal later by `lag` samples (need not be whole); its first value stands before the start."""
    if lag == 0.0:
        return values
    count = np.arange(values.shape[0], dtype=np.float64)
    return np.asarray(np.interp(count - lag, count, values))


def two_sided(a: Array, b: Array, inputs: Array, dt: float) -> tuple[Array, Array, Array]:
    """Bounded state histories of a linear model, stable or not.

    A mode that grows by more than e over the record runs backward from its last value, every other one forward from its
    first. Whatever was flown was bounded, and of a bounded motion both are exact: z(t) = e^(s (t - T)) z(T) minus the
    integral from t to T of e^(s (t - r)) b u(r). No model needs a shorter record than another.

    Args:
        a, b: of dx/dt = A x + B u, shapes (n, n) and (n, m).
        inputs: (n_t, m), straight between samples.
        dt: step [s].

    Returns:
        Forced by each input alone (n_t, n, m); free, last axis the mode's constant (n_t, n, n); from constant unit
        rates of the modes (n_t, n, n).
    """
    n, n_t = a.shape[0], inputs.shape[0]
    edge = 1.0 / (n_t * dt)
    form, turn, k = schur(a, output="real", sort=lambda real, _imaginary=0.0: real <= edge)
    aside = np.eye(n)
    aside[:k, k:] = solve_sylvester(form[:k, :k], -form[k:, k:], -form[:k, k:])
    to_states = turn @ aside
    forces = np.linalg.solve(to_states, b)
    forced, free, pushed = np.zeros((n_t, n, b.shape[1])), np.zeros((n_t, n, n)), np.zeros((n_t, n, n))
    if k:
        parts = _from_rest(form[:k, :k], forces[:k], inputs, dt)
        forced[:, :k], free[:, :k, :k], pushed[:, :k, :k] = parts
    if k < n:
        parts = _from_rest(-form[k:, k:], -forces[k:], inputs[::-1], dt)
        forced[:, k:], free[:, k:, k:], pushed[:, k:, k:] = (part[::-1] for part in parts)
    return tuple(to_states @ part for part in (forced, free, pushed))


def _from_rest(a: Array, b: Array, inputs: Array, dt: float) -> tuple[Array, Array, Array]:
    """`two_sided` of a model that runs forward."""
    (n, m), n_t = b.shape, inputs.shape[0]
    phi, q0, q1 = first_order_hold(a, b, dt)
    _, constant, _ = first_order_hold(a, np.eye(n), dt)
    drive = inputs[:-1, None, :] * q0 + np.diff(inputs, axis=0)[:, None, :] * q1
    drive = np.concatenate([drive, np.zeros((n_t - 1, n, n)), np.broadcast_to(constant, (n_t - 1, n, n))], axis=2)
    start = np.concatenate([np.zeros((n, m)), np.eye(n), np.zeros((n, n))], axis=1)
    last = np.zeros((1, n, m + 2 * n))
    every = driven(start.T, phi, np.concatenate([drive, last]).swapaxes(1, 2))[0].swapaxes(1, 2)
    return every[:, :, :m], every[:, :, m : m + n], every[:, :, m + n :]


def driven(start: NDArray[Any], phi: NDArray[Any], push: NDArray[Any]) -> tuple[Any, Any]:
    """States along a record where the next are x Phi' + push: at every sample (n_t, k, n), and after the last (k, n).

    Pieces of the record run side by side from rest, then one after the other what each begins with is added: some steps
    of large matrices for many of small ones.

    Args:
        start: k states at the first sample, (k, n).
        phi: transition (n, n).
        push: what drives them to the next sample, (n_t, k, n).
    """
    n_t, k, n = push.shape
    length = max(1, round(np.sqrt(n_t)))
    pieces = -(-n_t // length)
    states = np.zeros((length + 1, pieces, k, n), dtype=np.result_type(start, phi, push))
    padded = np.zeros((pieces * length, k, n), dtype=push.dtype)
    padded[:n_t] = push
    padded = padded.reshape(pieces, length, k, n)
    powers = [np.eye(n)]
    for i in range(length):
        states[i + 1] = states[i] @ phi.T + padded[:, i]
        powers.append(powers[-1] @ phi.T)
    begins = np.empty((pieces, k, n), dtype=states.dtype)
    for piece in range(pieces):
        begins[piece] = start
        start = start @ powers[-1] + states[-1, piece]
    for i in range(length):
        states[i] += begins @ powers[i]
    every = states[:-1].swapaxes(0, 1).reshape(-1, k, n)
    after = every[n_t] if n_t < len(every) else start
    return every[:n_t], after


def answers(model: StateSpaceModel, outputs: Sequence[str], inputs: Array, dt: float) -> tuple[Array, Array]:
    """A model's bounded motion along recorded inputs, delays and all, and the constants that a record leaves open.

    Args:
        model: of n states.
        outputs: k of its outputs.
        inputs: deviations of its m inputs, (n_t, m).
        dt: step [s].

    Returns:
        The outputs forced by each input alone (n_t, k, m); what each constant does to them (n_t, k, 2 n + k): one per
        mode, one shift per mode, one bias per output.
    """
    if model.entry_delays:
        wide, owner = model.wide
        parts, constants = answers(wide, outputs, inputs[:, owner], dt)
        return parts @ np.eye(len(model.inputs))[list(owner)], constants
    a, b, c, d = model.explicit()
    rows = [model.outputs.index(o) for o in outputs]
    lags = [tuple(model.delay(o, i) / dt for i in model.inputs) for o in outputs]
    forced = np.zeros((inputs.shape[0], len(rows), inputs.shape[1]))
    # Outputs whose inputs come equally late share one run.
    for lag in set(lags):
        shifted = np.column_stack([delayed(inputs[:, j], lag[j]) for j in range(inputs.shape[1])])
        states, free, pushed = two_sided(a, b, shifted, dt)
        for k, row in enumerate(rows):
            if lags[k] == lag:
                forced[:, k] = np.einsum("n,tnm->tm", c[row], states) + shifted * d[row]
    columns = [c[rows] @ part for part in (free, pushed)]
    level = np.broadcast_to(np.eye(len(rows)), (inputs.shape[0], len(rows), len(rows)))
    return forced, np.concatenate([*columns, level], axis=2)
