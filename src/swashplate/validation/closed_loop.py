"""Predictions with a controller in the loop: its command answers the motion that is predicted, not what was flown.

A recorded command answers gusts that no prediction knows. Where past motion explains most of a command, a model that
runs on the recorded one turns against disturbances that it never met, and a model that fits there has taken in minus
the controller's inverse (docs/explanation/flights-under-feedback.md). Here the controller is identified beside the
aircraft instead: proportional to position and rate, some samples late. After a start nothing that was recorded of the
axis is used.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.filtering.arriving_commands import motors
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import FilterState, StochasticModel
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.time.beginning import FilterNumbers, numbers_and_constants
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.identification.time.record_filter import record_filter
from swashplate.validation.controller_law import Law, shares_of

_REFERENCE = 0.5
"""Seconds before a start over which the reference is averaged; it stays there."""
_REACH = 0.5
"""Seconds of past motion that a run carries: the command's delay and the aircraft's together."""


class _Loops(NamedTuple):
    """What one run needs of the closed axes: shares of the inputs (axes, inputs) and back (axes, inputs), gains on the
    body's states (axes, 12), samples from motion to aircraft (axes,), and from when each input answers (inputs,)."""

    shares: Array
    back: Array
    gains: Array
    late: NDArray[np.intp]
    since: NDArray[np.intp]


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
    delay_steps = np.round(delays / dt).astype(int)
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
        behind.append(min(lag + int(delay_steps[np.flatnonzero(share)[0]]), reach - 1))
    back = [share / (share @ share) for share in shares]
    answers = np.any(np.array(shares) != 0.0, axis=0)
    since = np.where(answers, known, ahead)
    loops = _Loops(np.array(shares), np.array(back), np.array(gains), np.array(behind), since)
    past = before[starts[:, None] + np.arange(1, reach + 1)]
    return _closed_ahead(
        model, filtered, numbers, loops, past, np.stack(references, axis=1), (reaching, voltage), starts, ahead
    )


def _closed_ahead(
    model: StochasticModel,
    filtered: FilterState,
    numbers: FilterNumbers,
    loops: _Loops,
    past: Array,
    reference: Array,
    recorded: tuple[Array, Array],
    starts: NDArray[np.intp],
    ahead: int,
) -> Array:
    """As `closed_ahead`; past: body states (starts, reach, 12), reference: (starts, axes), recorded: what reached the
    vehicle and the voltage by sample."""
    body, step = [model.vehicle.index(name) for name in PREDICTED], record_filter(model).step
    fade, constants = model.fade(Noise(*numbers.noise)), numbers_and_constants(model.vehicle, numbers.parameters)
    x, gust, drift = (np.asarray(part)[starts] for part in filtered[:3])
    states = np.empty((len(starts), ahead, x.shape[1]))
    for k in range(ahead):
        u = recorded[0][starts + k]
        answer = reference + np.sum(loops.gains * past[:, past.shape[1] - 1 - loops.late], axis=2)
        # The part of the inputs that is the axis's command becomes the answer, all else stays as recorded.
        u = np.where(k >= loops.since, u + (answer - u @ loops.shares.T) @ loops.back, u)
        states[:, k] = x = step(x, gust, drift, u, recorded[1][starts + k], constants)
        gust = fade * gust
        past = np.concatenate([past[:, 1:], x[:, None, body]], axis=1)
    return states
