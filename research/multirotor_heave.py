"""How much of the acceleration along body z can be explained, for `multirotor_scores.py`.

Four numbers of each flight, all R^2 below `SLOW`: what two sensors agree on (nothing can be told better), what a
regression with the flight's own coefficients reaches in its own data (no equations of this kind can do better), what
the model says on commands and voltage alone, and what it says with what its filter knew some time before.

What is explained is the acceleration of the tracked point in the room, seen along the tracked body's z. Not the slope
of the body-z velocity: there an error of the attitude counts with the whole speed, 0.01 m/s for 0.4 degrees at 1.5 m/s.
Along the thrust it counts with what acts across, which is next to nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import butter, lfilter, savgol_filter, sosfiltfilt
from scipy.spatial.transform import Rotation

from swashplate.arrays import Array
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core.records import Record
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import LABORATORY_GRAVITY

SLOW = 3.0
"""Hz below which the acceleration is compared."""

BEFORE = (0.1, 0.5)
"""Seconds before at which the filter's knowledge is taken."""

_EDGE = 0.3
"""Seconds at the end that a filter without phase does not reach."""

_SHIFT = 0.08
"""Seconds by which the two sensors' clocks may differ."""


@dataclass(frozen=True)
class Heave:
    """Of one record: the spread of the acceleration [m/s^2], and R^2 as the module says, in its order."""

    name: str
    spread: float
    agreed: float
    own: float
    alone: float
    levelled: float
    known: tuple[float, ...]

    @property
    def cells(self) -> tuple[str, ...]:
        told = (self.agreed, self.own, self.alone, self.levelled, *self.known)
        return (f"`{self.name.split('.')[0]}`", f"{self.spread:.2f}", *(f"{value:.2f}" for value in told))


@dataclass(frozen=True)
class Acting:
    """What a filter saw beside the equations [m/s^2] (n,): a drift that stays, a gust that fades with `time` [s]."""

    drift: Array
    gust: Array
    time: float

    def later(self, seconds: float, dt: float) -> Array:
        """What was to be expected some seconds before, as predictions expect it (n,)."""
        held = self.drift + self.gust * np.exp(-seconds / self.time)
        k = round(seconds / dt)
        return np.concatenate([np.full(k, held[0]), held[:-k]])


HEADS = ("flight", "spread [m/s²]", "tracking and accelerometer agree", "regression of its own", "model on commands",
         "without its constant error", *(f"known {seconds:g} s before" for seconds in BEFORE))  # fmt: skip


def measured_force(body: Array, dt: float) -> Array:
    """Specific force along body z [m/s^2] from the tracked motion, shape (n,)."""
    felt = savgol_filter(body[:, :3], 5, 2, deriv=2, delta=dt, axis=0) - [0.0, 0.0, LABORATORY_GRAVITY]
    return np.asarray(Rotation.from_euler("ZYX", body[:, [8, 7, 6]]).apply(felt, inverse=True)[:, 2])


def heave(
    vehicle: Vehicle, record: Record, nuisance: Nuisance, body: Array, force: Array, acting: Acting, felt: Array,
    first: int,
) -> Heave:  # fmt: skip
    """The numbers of one record.

    Args:
        body: states (n, 12) as tracked. force: along z from the model without the flight's constant (n,).
        acting: along z, what the filter saw beside the equations. felt: the accelerometer's z (n,).
        first: sample from which on it counts.
    """
    sos = butter(4, SLOW, fs=1.0 / record.dt, output="sos")
    kept = slice(first, -round(_EDGE / record.dt))

    def slow(row: Any) -> Array:
        return np.asarray(sosfiltfilt(sos, row)[kept])

    truth = slow(measured_force(body, record.dt))
    spread = float(np.var(truth))

    def explained(predicted: Array) -> float:
        return 1.0 - float(np.mean((truth - predicted) ** 2)) / spread

    shifts = range(-round(_SHIFT / record.dt), round(_SHIFT / record.dt) + 1)
    nearest = max((slow(np.roll(felt, k)) for k in shifts), key=lambda row: float(np.corrcoef(row, truth)[0, 1]))
    columns = np.stack([np.ones(truth.size), *(slow(column) for column in _columns(vehicle, record, body))], axis=1)
    own = columns @ np.linalg.lstsq(columns, truth, rcond=None)[0]
    push, alone = float(nuisance.push_w), slow(force)
    later = [acting.later(seconds, record.dt) for seconds in BEFORE]
    return Heave(
        record.name,
        float(np.sqrt(spread)),
        min(1.0, float(np.cov(nearest, truth)[0, 1]) / spread),
        explained(own),
        explained(alone + push),
        explained(alone + (truth - alone).mean()),
        tuple(explained(alone + slow(row)) for row in later),
    )


def _columns(vehicle: Vehicle, record: Record, body: Array) -> list[Array]:
    """What a flight's own regression may use: rotors, voltage, motion, height and time."""
    keep = float(np.exp(-record.dt / vehicle.card.parameters["tau_drive"].value))
    driven = record.inputs * record.voltage[:, None]
    speeds = lfilter([1.0 - keep], [1.0, -keep], driven - driven[0], axis=0) + driven[0]
    u, v, w = body[:, 3:6].T
    turning = speeds.sum(axis=1)
    return [turning, *(speeds**2).T, record.voltage, w * turning, u**2 + v**2, body[:, 2], record.time - record.time[0]]
