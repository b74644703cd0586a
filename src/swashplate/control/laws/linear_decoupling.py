"""Decoupling of any linear model's control axes: by a constant matrix, or by a filter that carries a copy of the model.

For conventional helicopters (hybrid models with flapping states as Mettler's) and everything else that has matrices.
What is reached is told by `coupling`, the off-axis over the on-axis response against frequency, on the design model or
on any other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike

from swashplate.arrays import Array, Complex, largest_first
from swashplate.errors import SwashError
from swashplate.simulation.discretisation import zero_order_hold

_SINGULAR = 1e-8
"""Condition (inverse) below which a control matrix has a direction that moves nothing."""
_STABLE = -1e-6
"""1/s; a filter whose slowest mode lies above this does not come to rest."""


class HasMatrices(Protocol):
    """dx/dt = A x + B u, y = C x + D u with named signals: `linearize(...)`, or `LinearSystem`."""

    @property
    def A(self) -> Array: ...
    @property
    def B(self) -> Array: ...
    @property
    def C(self) -> Array: ...
    @property
    def D(self) -> Array: ...
    @property
    def states(self) -> tuple[str, ...]: ...
    @property
    def inputs(self) -> tuple[str, ...]: ...
    @property
    def outputs(self) -> tuple[str, ...]: ...


@dataclass(frozen=True)
class LinearSystem:
    """dx/dt = A x + B u, y = C x + D u, with named signals and no delays."""

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


@dataclass(frozen=True)
class Decoupling:
    """What turns wanted axes into inputs.

    Attributes:
        system: from the wanted axes (named as the outputs) to the inputs; a constant matrix has no states.
        inputs, outputs: names, paired in order.
    """

    system: LinearSystem
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    @property
    def matrix(self) -> Array:
        """Its direct gain, shape (n_inputs, n_outputs): all there is of a static one."""
        return self.system.D


def response_at(system: HasMatrices, frequency: float) -> Complex:
    """C (jw - A)^-1 B + D at one frequency [rad/s], shape (n_outputs, n_inputs)."""
    x = np.linalg.solve(1j * frequency * np.eye(len(system.states)) - system.A, system.B.astype(np.complex128))
    return np.asarray(system.C @ x + system.D, dtype=np.complex128)


def in_series(decoupling: Decoupling, model: HasMatrices) -> LinearSystem:
    """The model behind its decoupling: from the wanted axes to the paired outputs."""
    first, (A, B, C) = decoupling.system, _square(model, decoupling.inputs, decoupling.outputs)
    return LinearSystem(
        np.block([[A, B @ first.C], [np.zeros((len(first.states), len(A))), first.A]]),
        np.vstack([B @ first.D, first.B]),
        np.hstack([C, np.zeros((len(C), len(first.states)))]),
        np.zeros((len(C), len(C))),
        (*model.states, *(f"filter {name}" for name in first.states)),
        decoupling.outputs,
        decoupling.outputs,
    )


def step_answers(system: HasMatrices, axis: int, time: Array) -> Array:
    """All outputs on a unit step of one input at time zero, shape (n_outputs, n); `time` [s]: even, from 0."""
    F, G = zero_order_hold(system.A, system.B[:, [axis]], float(time[1] - time[0]))
    x, states = np.zeros(len(F)), []
    for _ in time:
        states.append(x)
        x = F @ x + G[:, 0]
    return np.asarray(system.C @ np.array(states).T + system.D[:, [axis]])


def chosen(names_there: Sequence[str], names: Sequence[str], kind: str) -> list[int]:
    """Places of named signals of a model.

    Raises:
        SwashError: naming what the model does not have.
    """
    labels = list(names_there)
    unknown = [name for name in names if name not in labels]
    if unknown or not names:
        raise SwashError(f"has no {kind} {', '.join(unknown) or 'chosen'}; it has {', '.join(labels)}.", where="model")
    return [labels.index(name) for name in names]


def _square(model: HasMatrices, inputs: Sequence[str], outputs: Sequence[str]) -> tuple[Array, Array, Array]:
    if len(inputs) != len(outputs):
        raise SwashError(
            f"{len(inputs)} inputs cannot decouple {len(outputs)} outputs; expected one input for each output.",
            where="model",
        )
    ins, outs = chosen(model.inputs, inputs, "input"), chosen(model.outputs, outputs, "output")
    if np.any(model.D[np.ix_(outs, ins)]):
        raise SwashError("has a direct path from an input to an output.", where="model", hint="Choose states.")
    return model.A, model.B[:, ins], model.C[outs]


def control_matrix(
    model: HasMatrices, *, inputs: Sequence[str], outputs: Sequence[str]
) -> tuple[Array, tuple[int, ...]]:
    """The first derivative of each output that the inputs move, and which derivative that is (Falb and Wolovich 1967).

    Row i is c_i A^(r_i - 1) B with the smallest r_i that does not vanish.

    Raises:
        SwashError: for an output that no input reaches, or a combination of outputs that no input can move alone.
    """
    A, B, C = _square(model, inputs, outputs)
    rows, degrees = [], []
    size = max(float(np.linalg.norm(A)), 1.0) * float(np.linalg.norm(B))
    for name, c in zip(outputs, C, strict=True):
        row = c
        for degree in range(1, A.shape[0] + 1):
            if np.linalg.norm(row @ B) > 1e-12 * size * max(float(np.linalg.norm(row)), 1e-300):
                rows.append(row @ B)
                degrees.append(degree)
                break
            row = row @ A
        else:
            raise SwashError("is moved by none of the inputs.", where="model", channel=name)
    matrix = np.array(rows)
    scaled = matrix / np.linalg.norm(matrix, axis=1, keepdims=True)
    left, values, _ = np.linalg.svd(scaled)
    if values[-1] < _SINGULAR * values[0]:
        weights = " ".join(f"{w:+.2f} {name}" for w, name in zip(left[:, -1], outputs, strict=True))
        raise SwashError(
            f"the inputs {', '.join(inputs)} cannot move {weights} (first derivatives that they reach).",
            where="model",
            hint="Choose outputs that the inputs move independently.",
        )
    return matrix, tuple(degrees)


def static_decoupling(
    model: HasMatrices, *, inputs: Sequence[str], outputs: Sequence[str], frequency: float | None = None
) -> Decoupling:
    """A constant matrix of input mixing.

    Args:
        model: with named signals and without delays, e.g. `linearize(...)`.
        inputs, outputs: names, paired in order; the on-axis response of outputs[i] is that to axis i.
        frequency: where the axes are decoupled [rad/s]; without it at high frequency, by the inverse of
            `control_matrix`.

    At a frequency, column k is the real vector with the smallest off-axis over on-axis response there: with rows g_i of
    G(jw), the largest eigenvalue of Re(g_k* g_k) against Re(G* G). On-axis gains stay what they were.
    """
    A, B, C = _square(model, inputs, outputs)
    n = len(inputs)
    if frequency is None:
        matrix, _ = control_matrix(model, inputs=inputs, outputs=outputs)
        mixing = np.asarray(np.linalg.inv(matrix) * np.diag(matrix), dtype=np.float64)
        return _static(mixing, inputs, outputs)
    G = C @ np.linalg.solve(1j * frequency * np.eye(A.shape[0]) - A, B)
    total = np.real(G.conj().T @ G)
    mixing = np.empty((n, n))
    for k in range(n):
        on = np.real(np.outer(G[k].conj(), G[k]))
        ridge = 1e-12 * np.trace(total) * np.eye(n)
        _, vectors = scipy.linalg.eigh(on, total + ridge)
        column = vectors[:, -1]
        answer = G[k] @ column
        if abs(G[k, k]) > 0.0:
            column = column * (abs(G[k, k]) / abs(answer)) * np.sign(np.real(np.conj(G[k, k]) * answer) or 1.0)
        mixing[:, k] = column
    return _static(mixing, inputs, outputs)


def unmixed(*, inputs: Sequence[str], outputs: Sequence[str]) -> Decoupling:
    """No decoupling: axis i is input i."""
    return _static(np.eye(len(inputs)), inputs, outputs)


def _static(mixing: Array, inputs: Sequence[str], outputs: Sequence[str]) -> Decoupling:
    n, none = len(inputs), np.zeros((0, 0))
    system = LinearSystem(none, np.zeros((0, n)), np.zeros((n, 0)), mixing, (), tuple(outputs), tuple(inputs))
    return Decoupling(system, tuple(inputs), tuple(outputs))


def dynamic_decoupling(
    model: HasMatrices,
    *,
    inputs: Sequence[str],
    outputs: Sequence[str],
    bandwidth: ArrayLike,
    keep: Sequence[str] | None = None,
) -> Decoupling:
    """A filter after which axis i moves output i alone, as (w_i / (s + w_i))^r_i.

    Args:
        model, inputs, outputs: as in `static_decoupling`.
        bandwidth: w_i [rad/s], one for all or one each.
        keep: the states that the copy carries; the others are held at the trim. A copy with the slow ones (speed,
            attitude) undoes speed stability too, which a filter of rates should not.

    The copy of the model stands under the state feedback that decouples it (Falb and Wolovich 1967): with C_i the
    rows and D* the control matrix, u = D*^-1 (w^r v - C_i (A + w I)^r x). Its modes are -w and the model's zeros.

    Raises:
        SwashError: where a zero does not lie in the left half plane, with the states that take part most.
    """
    kept = chosen(model.states, keep if keep is not None else model.states, "state")
    part = LinearSystem(
        model.A[np.ix_(kept, kept)],
        model.B[kept],
        model.C[:, kept],
        model.D,
        tuple(model.states[i] for i in kept),
        model.inputs,
        model.outputs,
    )
    matrix, degrees = control_matrix(part, inputs=inputs, outputs=outputs)
    A, B, C = _square(part, inputs, outputs)
    wanted = np.broadcast_to(np.asarray(bandwidth, dtype=np.float64), (len(outputs),))
    if np.any(wanted <= 0.0):
        raise SwashError(f"is {wanted.tolist()}, expected positive numbers [rad/s].", channel="bandwidth")
    eye = np.eye(A.shape[0])
    rows = [c @ np.linalg.matrix_power(A + w * eye, r) for c, w, r in zip(C, wanted, degrees, strict=True)]
    inverse = np.linalg.inv(matrix)
    feedback: Array = np.asarray(inverse @ np.array(rows), dtype=np.float64)
    forward = inverse @ np.diag(wanted ** np.array(degrees))
    closed = A - B @ feedback
    values, vectors = np.linalg.eig(closed)
    worst = int(np.argmax(values.real))
    if values[worst].real > _STABLE:
        order = largest_first(np.abs(vectors[:, worst]))[:3]
        zero = np.round(values[worst], 6) + 0.0  # chains of integrators leave rounding about the origin
        states = ", ".join(part.states[i] for i in order if abs(vectors[i, worst]) > 0.1)
        raise SwashError(
            f"the filter would not come to rest: the model has a zero at {zero.real:.3g} +- {abs(zero.imag):.3g}j 1/s "
            f"(in {states}).",
            where="model",
            hint="Leave slow states out of the copy (keep=...), choose other outputs, or decouple statically.",
        )
    system = LinearSystem(closed, B @ forward, -feedback, forward, part.states, tuple(outputs), tuple(inputs))
    return Decoupling(system, tuple(inputs), tuple(outputs))


def coupling(
    model: HasMatrices,
    frequencies: ArrayLike,
    *,
    inputs: Sequence[str],
    outputs: Sequence[str],
    by: Decoupling | None = None,
) -> Array:
    """Off-axis over on-axis response, |G_ik / G_kk|, shape (n_outputs, n_axes, n_frequencies); the diagonal is one.

    Args:
        model: what is to be judged, which need not be what was designed on.
        frequencies: [rad/s], shape (n,).
        inputs, outputs: names, paired in order.
        by: the decoupling before it, None for the bare inputs.
    """
    A, B, C = _square(model, inputs, outputs)
    eye = np.eye(A.shape[0])
    ratios = []
    for w in np.atleast_1d(np.asarray(frequencies, dtype=np.float64)):
        G = C @ np.linalg.solve(1j * w * eye - A, B)
        if by is not None:
            G = G @ response_at(by.system, float(w))
        ratios.append(np.abs(G / np.diag(G)))
    return np.moveaxis(np.array(ratios), 0, -1)
