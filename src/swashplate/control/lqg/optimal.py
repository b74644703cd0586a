"""Discrete linear-quadratic regulators and steady Kalman filters, and the words for what cannot be held or seen.

The regulator's Riccati equation is solved by scipy, the filter's by `swashplate.filtering.riccati`. Modes are judged by
the test of Popov, Belevitch and Hautus on a balanced model: rank [F - z I, G] and [F - z I; H] at every eigenvalue z.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg

from swashplate.arrays import Array, Complex, largest_first
from swashplate.errors import ControllerError
from swashplate.filtering.observer import ObserverPlan
from swashplate.filtering.riccati import gain_at, settled_covariance, through
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.linearize import LinearModel

_UNIT_CIRCLE = 1e-6
"""Distance to the unit circle within which a mode counts as one that does not decay by itself."""
_BLIND = 1e-7
"""Smallest singular value of the balanced test, over its largest, below which a direction is not reached or seen."""
_NAMED = 0.3
"""Share of the largest component from which a state is named in a direction."""


@dataclass(frozen=True)
class UnreachedDirection:
    """A combination of states that a mode moves in and that no input reaches, or no sensor sees.

    Attributes:
        mode: eigenvalue of the sampled model.
        shares: states by name with their components, in units of the scaling, largest first.
        margin: smallest singular value of the test over the largest: 0 where nothing is reached or seen.
    """

    mode: complex
    shares: tuple[tuple[str, float], ...]
    margin: float

    def __str__(self) -> str:
        (_, first), *_ = self.shares
        return " ".join(
            f"{'+' if value * first > 0 else '-'}{abs(value / first):.2g} {name}" if i else name
            for i, (name, value) in enumerate(self.shares)
        )


def unseen(
    F: Array, H: Array, names: Sequence[str], *, scale: Array, all_modes: bool = False
) -> tuple[UnreachedDirection, ...]:
    """Directions that no output sees, of modes that do not decay (or of all), by the test at every eigenvalue.

    Args:
        F, H: sampled model and outputs (each output already in units of its noise).
        names: of the states.
        scale: what counts as one in each state.
        all_modes: also decaying modes.
    """
    balanced = F * scale[None, :] / scale[:, None], H * scale[None, :]
    outputs = balanced[1] / max(float(np.linalg.norm(balanced[1], 2)), 1e-300)
    directions: list[UnreachedDirection] = []
    for z in _modes(balanced[0], all_modes):
        test = np.vstack([balanced[0] - z * np.eye(F.shape[0]), outputs])
        _, values, right = np.linalg.svd(test)
        blind = [i for i, value in enumerate(values) if value <= _BLIND * values[0]]
        if blind:
            vectors = np.column_stack([_turned_real(right[i].conj()) for i in blind])
            margin = float(values[blind[-1]] / values[0])
            directions += [
                UnreachedDirection(complex(z), shares(vector, names), margin) for vector in pivoted_basis(vectors).T
            ]
    return tuple(directions)


def pivoted_basis(basis: Array) -> Array:
    """Another basis of the same columns' span, each column with a state of its own: easier to put into words."""
    _, _, pivots = scipy.linalg.qr(basis.T, pivoting=True)
    kept = np.sort(pivots[: basis.shape[1]])
    turned = basis @ np.linalg.inv(basis[kept])
    return np.asarray(turned / np.linalg.norm(turned, axis=0), dtype=np.float64)


def unreached(F: Array, G: Array, names: Sequence[str], *, scale: Array) -> tuple[UnreachedDirection, ...]:
    """Directions of modes that do not decay and that no input reaches (the dual of `unseen`)."""
    return unseen(F.T, G.T, names, scale=1.0 / scale)


def _modes(F: Array, all_modes: bool) -> Complex:
    values = np.linalg.eigvals(F).astype(np.complex128)
    chosen = values if all_modes else values[np.abs(values) > 1.0 - _UNIT_CIRCLE * 1e2]
    # Chains of integrators leave a cloud of eigenvalues about one: the test is made at one itself.
    near = np.abs(chosen - 1.0) < 1e-3
    kept = [complex(z) for z in chosen[~near] if z.imag >= 0.0]
    return np.array([*([1.0 + 0j] if near.any() else []), *kept], dtype=np.complex128)


def _turned_real(vector: Any) -> Array:
    largest = vector[int(np.argmax(np.abs(vector)))]
    turned = np.real(vector * np.conj(largest) / abs(largest))
    return np.asarray(turned / np.linalg.norm(turned), dtype=np.float64)


def shares(vector: Array, names: Sequence[str]) -> tuple[tuple[str, float], ...]:
    """The states that take part in a direction most, largest first."""
    order = largest_first(np.abs(vector))
    return tuple((names[i], float(vector[i])) for i in order if abs(vector[i]) >= _NAMED * abs(vector[order[0]]))


def regulator(F: Array, G: Array, Q: Array, R: Array, names: Sequence[str], *, scale: Array, where: str) -> Array:
    """Gain K of u = -K x that minimises the sum of x'Qx + u'Ru (Anderson and Moore 1990, ch. 2), shape (m, n).

    Args:
        F, G: sampled model.
        Q, R: weights, shapes (n, n) and (m, m).
        names: of the states, for messages.
        scale: what counts as one in each state.
        where: the model, for messages.

    Raises:
        ControllerError: for weights of the wrong size, or naming the mode and direction that no input reaches or that
            no weight asks to be held.
    """
    check_weights(Q, R, *G.shape, where=where)
    lost = unreached(F, G, names, scale=scale)
    if lost:
        raise ControllerError(
            f"no input moves {lost[0]} (mode {_named(lost[0].mode)}): it cannot be stabilised.",
            where=where,
            hint="Leave that state out, or add an input.",
        )
    try:
        X = scipy.linalg.solve_discrete_are(F, G, Q, R)
    except (np.linalg.LinAlgError, ValueError):
        free = unseen(F, Q, names, scale=scale)
        what = f"; no weight asks that {free[0]} is held" if free else ""
        raise ControllerError(
            f"no state feedback stabilises it{what}.", where=where, hint="Give that state a weight."
        ) from None
    return np.asarray(np.linalg.solve(R + G.T @ X @ G, G.T @ X @ F), dtype=np.float64)


def check_weights(Q: Array, R: Array, n: int, m: int, *, where: str) -> None:
    """Raise `ControllerError` where weights have the wrong size or sign."""
    for name, W, size in (("state weights", Q, n), ("input weights", R, m)):
        if np.shape(W) != (size, size):
            raise ControllerError(f"have shape {np.shape(W)}, expected ({size}, {size}).", where=where, channel=name)
    if np.min(np.linalg.eigvalsh(R)) <= 0.0 or np.min(np.linalg.eigvalsh(Q)) < -1e-9 * np.max(np.abs(Q)):
        raise ControllerError("must be positive (inputs) and not negative (states).", where=where, channel="weights")


def steady_filter(
    F: Array, H: Array, Q: Array, R: Array, names: Sequence[str], *, scale: Array, where: str
) -> tuple[Array, Array]:
    """Gain L of the update x + L (y - H x) and covariance of the prediction, of the steady Kalman filter.

    Raises:
        ControllerError: naming the direction that does not decay and that no sensor sees.
    """
    hidden = unseen(F, H / np.sqrt(np.diag(R))[:, None], names, scale=scale)
    if hidden:
        raise ControllerError(
            f"no sensor sees {hidden[0]} (mode {_named(hidden[0].mode)}).",
            where=where,
            channel="sensors",
            hint="Add a sensor that does, or hold less.",
        )
    try:
        # In units of the scaling and of each reading's noise: metres beside radians per second cost digits.
        sigma = np.sqrt(np.diag(R))
        P = settled_covariance(
            through(
                F * scale[None, :] / scale[:, None],
                H * scale[None, :] / sigma[:, None],
                Q / np.outer(scale, scale),
                R / np.outer(sigma, sigma),
            )
        ) * np.outer(scale, scale)
    except (np.linalg.LinAlgError, ValueError):
        raise ControllerError("no steady Kalman filter exists for these sensors.", where=where) from None
    L = gain_at(P, H, R)
    return np.asarray(L, dtype=np.float64), np.asarray(P, dtype=np.float64)


def _named(z: complex) -> str:
    if abs(z - 1.0) < 1e-3:
        return "an integrator"
    return f"z = {z.real:.4f}{f' +- {abs(z.imag):.4f}j' if z.imag else ''}"


ALLOWED: Mapping[str, float] = {
    **dict.fromkeys(("x", "y"), 0.3),
    "z": 0.2,
    **dict.fromkeys(("u", "v", "w"), 0.6),
    **dict.fromkeys(("phi", "theta"), 0.2),
    "psi": 0.2,
    **dict.fromkeys(("p", "q", "r"), 0.8),
    **dict.fromkeys(("sum_ahead", "sum_right"), 0.6),
    **dict.fromkeys(("sum_down", "sum_heading"), 0.4),
}
"""Deviations [m, m/s, rad, rad/s, and their integrals] that weigh as much as `EFFORT` of an input's range (Bryson)."""
EFFORT = 0.1
EFFORTS: Mapping[str, float] = dict.fromkeys(("motor_lower", "motor_upper"), 0.04)
"""Inputs with another share: motors are slow, and pushing them hard only heats them."""
SUMS = ("sum_ahead", "sum_right", "sum_down", "sum_heading")
LAG_AT_CROSSOVER = 1.0 / 3.0
"""rad that delay and sampling together may take from a loop's phase at its crossover."""
DISC = 2.0 * np.tan(np.pi / 8.0)
"""Disc margin of 45 degrees and 7.7 dB: what a place held more tightly must leave of all loops at once."""
TIGHTER, TIGHTEST = 0.84, 0.1
"""A step towards a tighter place, and the last, as shares of what `ALLOWED` allows."""
PLACE = ("x", "y", "sum_ahead", "sum_right")
_ABOVE = 1.2
"""Times the frequency of a mode that only an input holds: its loop must cross above it."""
_DAMPED = 0.05
"""Damping ratio below which a mode must be held."""
_SLOWEST = 0.5
"""rad/s; slower modes ask nothing of a crossover."""
_REACHED = 0.1
"""Share of the strongest input's hold on a mode from which an input counts as one that holds it."""


def bryson(
    vehicle: Vehicle,
    names: Sequence[str],
    *,
    allowed: Mapping[str, float] | None = None,
    effort: Mapping[str, float] | None = None,
) -> tuple[Array, Array]:
    """Weights of states by name and of inputs: one over the square of what is allowed (Bryson's rule)."""
    deviations, shares = {**ALLOWED, **(allowed or {})}, {**EFFORTS, **(effort or {})}
    Q = np.diag([1.0 / deviations[name] ** 2 if name in deviations else 0.0 for name in names])
    spans = zip(vehicle.input_names, vehicle.input_limits, strict=True)
    return Q, np.diag([1.0 / (shares.get(name, EFFORT) * (high - low)) ** 2 for name, (low, high) in spans])


def typical(name: str) -> float:
    """What counts as one in a state, when directions are compared."""
    inner = {"a1": 0.05, "b1": 0.05, "c": 0.1, "d": 0.1, "omega_lower": 20.0, "omega_upper": 20.0, "omega": 10.0}
    return ALLOWED.get(name, inner.get(name, 0.1))


def checked_weights(
    vehicle: Vehicle,
    names: Sequence[str],
    allowed: Mapping[str, float],
    effort: Mapping[str, float] | float | None,
    *,
    where: str,
) -> dict[str, float]:
    """The effort by input that was given.

    Raises:
        ControllerError: for a state or an input that there is not, or a number that is not above zero.
    """
    unknown = sorted(set(allowed) - set(names))
    if unknown:
        raise ControllerError(
            f"is not a state: {', '.join(unknown)}; expected {', '.join(names)}.", where=where, channel="allowed"
        )
    if effort is None:
        effort = {}
    elif not isinstance(effort, Mapping):
        effort = dict.fromkeys(vehicle.input_names, effort)
    strange = sorted(set(effort) - set(vehicle.input_names))
    if strange:
        raise ControllerError(
            f"is not an input: {', '.join(strange)}; expected {', '.join(vehicle.input_names)}.",
            where=where,
            channel="effort",
        )
    if any(not value > 0.0 for value in (*allowed.values(), *effort.values())):
        raise ControllerError("must be above zero.", where=where, channel="allowed and effort")
    return dict(effort)


def square(weights: Any) -> Array:
    """Weights as a matrix; a list is its diagonal."""
    matrix = np.asarray(weights, dtype=np.float64)
    return np.diag(matrix) if matrix.ndim == 1 else matrix


def total_delays(plan: ObserverPlan, *, computation: float | None = None) -> Array:
    """What lies between a motion and the answer to it, by input [s].

    The input's delay, half a sample of hold, the age of the quickest sensor's reading (an observer bridges the slower
    ones with it), and the computation: where it is known the plan's delays have it, otherwise one sample is left.

    Args:
        plan: sensors, rate, delays.
        computation: [s]; None where nobody said.
    """
    age = min((s.delay + 0.5 * max(0.0, 1.0 / s.rate - plan.dt) for s in plan.sensors), default=0.0)
    left = plan.dt if computation is None else 0.0
    return np.array(plan.delays) * plan.dt + 0.5 * plan.dt + age + left


def crossover_limits(plan: ObserverPlan, models: Sequence[LinearModel], *, computation: float | None = None) -> Array:
    """The crossover that each input's loop should stay below [rad/s]: 1 / (3 total delay).

    A mode that does not damp itself is held only by a loop that crosses above it: the limit of the inputs that hold it
    is no lower than `_ABOVE` times its frequency.
    """
    limits = LAG_AT_CROSSOVER / total_delays(plan, computation=computation)
    spans = np.array([high - low for low, high in plan.equations.vehicle.input_limits])
    for model in models:
        values, left = np.linalg.eig(model.A.T)
        hold = np.abs(left.T @ model.B) * spans
        for value, strength in zip(values, hold, strict=True):
            weak = value.real > -_DAMPED * abs(value) and abs(value) > _SLOWEST
            if weak and strength.max() > 0.0:
                share = strength / strength.max()
                limits = np.where(share > _REACHED, np.maximum(limits, _ABOVE * abs(value)), limits)
    return np.asarray(limits)
