"""A hold of hover or steady flight by state feedback, for any vehicle that can be linearised.

The gains are those of a linear-quadratic regulator about a trim (Anderson and Moore 1990): enough to keep a vehicle
around during a maneuver and to fly it from rest, and no more.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.linalg

from swashplate.arrays import Array
from swashplate.engine.symbols import ArrayFunctions, Operand, Symbols
from swashplate.errors import SwashError
from swashplate.models.vehicle import Vehicle
from swashplate.physics.rigid_body import RigidBody
from swashplate.simulation.controller import Step, StepController
from swashplate.simulation.linearize import linearize
from swashplate.simulation.trim import Trim

_ALLOWED = {
    **dict.fromkeys(("x", "y"), 2.0),
    "z": 0.5,
    **dict.fromkeys(("u", "v", "w"), 2.0),
    **dict.fromkeys(("phi", "theta", "psi"), 0.3),
    **dict.fromkeys(("p", "q", "r"), 1.0),
}
"""Deviations [m, m/s, rad, rad/s] that weigh as much as a tenth of an input's range (Bryson's rule)."""

_GROWS = 1.001
"""A sampled loop whose deviations grow more than this from sample to sample does not hold; a free place has 1."""


@dataclass(frozen=True)
class StateHold(StepController):
    """A controller for `simulate_closed_loop`: see `state_hold`."""

    rate: float
    memory: Array
    gains: Array
    step: Step


_RATES = (50.0, 100.0, 200.0, 400.0)
"""Of a hold whose rate is not given [Hz]."""


def state_hold(
    vehicle: Vehicle,
    trim: Trim,
    *,
    rate: float | None = None,
    effort: float = 0.1,
    along: Array | None = None,
    spans: Array | None = None,
) -> StateHold:
    """A hold of the trim's attitude, velocity, height, heading and (at rest) place.

    Args:
        vehicle: any with a rigid body.
        trim: what to hold; inputs that it held itself (a throttle) stay.
        rate: how often it runs [Hz]; the slowest of 50, 100, 200 and 400 that its gains allow, if not given.
        effort: share of an input's range that weighs as much as the allowed deviations.
        along: combinations of inputs that it moves, shape (n_inputs, k); each input alone if not given.
        spans: their ranges [unit of the inputs], shape (k,); those of the inputs' limits if not given.

    Raises:
        SwashError: where no gain exists that holds it, or none at this rate.
    """
    model = linearize(vehicle, trim)
    held = {name for name, _ in vehicle.trim_held}
    free = [i for i, name in enumerate(vehicle.input_names) if name not in held]
    if along is None or spans is None:
        along = np.eye(len(vehicle.input_names))[:, free]
        spans = np.array([high - low for low, high in vehicle.input_limits])[free]
    B = model.B @ along
    weights = np.array([1.0 / _ALLOWED[name] ** 2 if name in _ALLOWED else 0.0 for name in model.states])
    if trim.speed or trim.lateral or trim.climb or trim.turn:
        weights[:3] = 1e-6  # the place moves on
    try:
        cost = scipy.linalg.solve_continuous_are(
            model.A - 1e-6 * np.eye(len(weights)),
            B,
            np.diag(weights),
            np.diag(1.0 / (effort * spans) ** 2),
        )
    except np.linalg.LinAlgError:
        raise SwashError(
            "no state feedback holds this trim.",
            where=vehicle.name,
            hint="Check its controls with `swash vehicle linearize`.",
        ) from None
    K = along @ (((effort * spans) ** 2)[:, None] * B.T @ cost)
    if trim.speed or trim.lateral or trim.climb or trim.turn:
        K[:, :2] = 0.0
    rates = _RATES if rate is None else (rate,)
    growths = [_growth(model.A, model.B, K, each) for each in rates]
    slowest = next((each for each, grows in zip(rates, growths, strict=True) if grows <= _GROWS), None)
    if slowest is None:
        raise SwashError(
            f"the state feedback is too fast for {rates[-1]:g} samples a second: from one to the next a deviation "
            f"grows {growths[-1]:.2f} times, expected to fade.",
            where=vehicle.name,
            hint="Give a higher rate=, or a smaller effort=.",
        )
    step = partial(state_hold_step, inputs=len(vehicle.input_names), states=len(weights))
    return StateHold(slowest, np.zeros(1), np.concatenate([K.ravel(), trim.inputs, trim.state]), _hashable(step))


def _growth(A: Array, B: Array, K: Array, rate: float) -> float:
    """By how much the worst deviation grows from one sample to the next, with commands held between them."""
    n, m = B.shape
    held_over = scipy.linalg.expm(np.block([[A, B], [np.zeros((m, n + m))]]) / rate)
    return float(np.abs(np.linalg.eigvals(held_over[:n, :n] - held_over[:n, n:] @ K)).max())


def _hashable(step: Step) -> Step:
    """One function per size, so that other gains compile nothing anew."""
    keywords = step.keywords  # pyrefly: ignore[missing-attribute]
    return _STEPS.setdefault((keywords["inputs"], keywords["states"]), step)


_STEPS: dict[tuple[int, int], Step] = {}


def state_hold_step(
    memory: Symbols,
    measured: Symbols,
    reference: Symbols,
    gains: Symbols,
    xp: ArrayFunctions,
    *,
    inputs: int,
    states: int,
) -> tuple[Operand, Operand]:
    """Inputs for a measured state row: the trim's, less the gains times the deviation in heading axes."""
    K = gains[: inputs * states].reshape(inputs, states)
    commanded, rest = gains[inputs * states : inputs * states + inputs], gains[inputs * states + inputs :]
    body = RigidBody(*(measured[i] for i in range(len(RigidBody._fields))))
    turned = body.psi - reference[3]
    turned = xp.arctan2(xp.sin(turned), xp.cos(turned))
    c, s = xp.cos(reference[3]), xp.sin(reference[3])
    north, east = body.x - reference[0], body.y - reference[1]
    # The gains belong to a heading of zero: the place error is turned into the wanted heading's axes, and cut.
    ahead = xp.clip(c * north + s * east, -3.0, 3.0)
    right = xp.clip(-s * north + c * east, -3.0, 3.0)
    below = xp.clip(body.z - reference[2], -2.0, 2.0)
    away = measured[:states] - rest
    place, heading = xp.stack([ahead, right, below]), xp.atleast_1d(turned)
    deviation = xp.concatenate([place, away[3:8], heading, away[9:]])
    return memory, commanded - K @ deviation
