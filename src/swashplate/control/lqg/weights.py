"""Weights of a linear-quadratic design by Bryson's rule, and how fast its loops may be for their delays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import ControllerError
from swashplate.filtering.observer import ObserverPlan
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.linearize import LinearModel

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
