"""Predictions with a controller in the loop: its command answers the motion that is predicted, not what was flown.

A recorded command answers gusts that no prediction knows. Where past motion explains most of a command, a model that
runs on the recorded one turns against disturbances that it never met, and a model that fits there has taken in minus
the controller's inverse (docs/explanation/flights-under-feedback.md). Here the controller is identified beside the
aircraft instead: proportional to position and rate, some samples late. After a start nothing that was recorded of the
axis is used.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.filtering.arriving_commands import motors
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import FilterState, StochasticModel
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.time.beginning import FilterNumbers
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.identification.time.record_filter import RUNS, whole
from swashplate.jax_on_demand import jax, jit, jnp
from swashplate.validation.controller_law import Law, shares_of

_REFERENCE = 0.5
"""Seconds before a start over which the reference is averaged; it stays there."""
_REACH = 0.5
"""Seconds of past motion that a run carries: the command's delay and the aircraft's together."""


class _Loops(NamedTuple):
    """What one run needs of the closed axes: shares of the inputs (axes, inputs) and back (axes, inputs), gains on the
    body's states (axes, 12), samples from motion to aircraft (axes,), and from when each input answers (inputs,)."""

    shares: Any
    back: Any
    gains: Any
    late: Any
    since: Any


def closed_ahead(
    model: StochasticModel,
    filtered: FilterState,
    numbers: FilterNumbers,
    laws: Sequence[Law],
    inputs: Array,
    reaching: Array,
    voltage: Array,
    starts: NDArray[np.intp],
    ahead: int,
) -> Array:
    """States 1, 2, ... samples after some starts with loops closed (starts, ahead, states).

    Args:
        model, numbers: of the filter. filtered: its states after each reading.
        laws: of the closed axes. inputs: as recorded (n, inputs).
        reaching, voltage: what reaches the vehicle at each sample, `ahead` samples beyond the last start.
        starts: samples. ahead: how many samples to predict.
    """
    vehicle, dt = model.vehicle, model.dt
    nuisance = Nuisance(*(float(value) for value in numbers.nuisance))
    trims = np.array([getattr(nuisance, f"trim_{name}", 0.0) for name in vehicle.input_names], dtype=float)
    delays = np.where(motors(vehicle), nuisance.delay_motor, nuisance.delay_servo)
    late = np.round(delays / dt).astype(int)
    # What reaches the vehicle is a curve through four logged samples: until here, all are from before the start.
    known = np.maximum(np.floor(delays / dt).astype(int) - 1, 0)
    body = np.asarray(filtered.x)[:, [vehicle.index(name) for name in PREDICTED]]
    reach = round(_REACH / dt)
    before = np.concatenate([np.repeat(body[:1], reach, axis=0), body])
    shares, gains, behind, references = [], [], [], []
    for law in laws:
        share = shares_of(vehicle, law.axis)
        gain = np.array([dict(zip(law.motion, law.gains, strict=True)).get(name, 0.0) for name in PREDICTED])
        lag = round(law.lag / dt)
        left = np.cumsum(np.concatenate([[0.0], inputs @ share - (before @ gain)[reach - lag : len(before) - lag]]))
        low = np.maximum(starts + 1 - round(_REFERENCE / dt), 0)
        references.append((left[starts + 1] - left[low]) / (starts + 1 - low) + share @ trims)
        shares.append(share)
        gains.append(gain)
        behind.append(min(lag + int(late[np.flatnonzero(share)[0]]), reach - 1))
    back = [share / (share @ share) for share in shares]
    answers = np.any(np.array(shares) != 0.0, axis=0)
    since = np.where(answers, known, ahead)
    loops = _Loops(np.array(shares), np.array(back), np.array(gains), np.array(behind), since)
    parts = []
    for first in range(0, len(starts), RUNS):
        here = np.pad(starts[first : first + RUNS], (0, max(0, first + RUNS - len(starts))), mode="edge")
        rows = here[:, None] + np.arange(ahead)
        begin = jax.tree.map(lambda part, at=here: np.asarray(part)[at], filtered)
        past = before[here[:, None] + np.arange(1, reach + 1)]
        reference = np.stack(references, axis=1)[np.minimum(np.arange(first, first + RUNS), len(starts) - 1)]
        parts.append(_closed_ahead(model, begin, numbers, loops, past, reference, reaching[rows], voltage[rows]))
    return whole(parts, len(starts))


@jit(static_argnums=0)
def _closed_ahead(
    model: StochasticModel,
    begin: FilterState,
    numbers: FilterNumbers,
    loops: _Loops,
    past: Float[jax.Array, "runs reach states"],
    reference: Float[jax.Array, "runs axes"],
    recorded: Float[jax.Array, "runs samples inputs"],
    voltage: Float[jax.Array, "runs samples"],
) -> Any:
    vehicle, noise = model.vehicle, Noise(*numbers.noise)
    parameters = vehicle.parameters(*numbers.parameters)
    body = jnp.array([vehicle.index(name) for name in PREDICTED])

    def advance(x: Any, acting: Any, now: tuple[Any, Any]) -> Any:
        return model.step(x, acting, now[0], parameters, now[1])

    def run(state: FilterState, past: Any, wanted: Any, recorded: Any, voltage: Any) -> Any:
        def sample(carried: tuple[FilterState, Any], now: tuple[Int[jax.Array, ""], Any, Any]) -> Any:
            (state, past), (k, u, volts) = carried, now
            answer = wanted + jnp.sum(loops.gains * past[past.shape[0] - 1 - loops.late], axis=1)
            # The part of the inputs that is the axis's command becomes the answer, all else stays as recorded.
            u = jnp.where(k >= loops.since, u + (answer - loops.shares @ u) @ loops.back, u)
            following = model.predict(state, noise, advance, (u, volts))
            return (following, jnp.concatenate([past[1:], following.x[body][None]])), following.x

        return jax.lax.scan(sample, (state, past), (jnp.arange(len(recorded)), recorded, voltage))[1]

    return jax.vmap(run)(begin, past, reference, recorded, voltage)
