"""What was flown by hand as flights on disk: the truth, and what motion capture would have logged of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swashplate.errors import FlightError
from swashplate.simulation.record import simulated_flight
from swashplate.simulation.sensors import QUIET, observe
from swashplate.vehicles.vehicle import Vehicle

SHORTEST, LONGEST = 2.0, 1800.0
"""Seconds: less is a slip of the finger, more fills the memory."""


def save_recording(
    vehicle: Vehicle, rows: list[NDArray[np.float64]], *, period: float, folder: Path, number: int
) -> Path:
    """Write `recording-N.nc` (with sensor noise, as a log) and `recording-N-truth.nc`; returns the first.

    Args:
        vehicle: what flew.
        rows: states, inputs and surroundings side by side, one row a controller period.
        period: between rows [s].
        folder: made if missing.
        number: of the recording; it seeds the noise.

    Raises:
        FlightError: for less than two seconds.
    """
    if len(rows) * period < SHORTEST:
        raise FlightError(f"the recording has {len(rows) * period:.1f} s, expected at least {SHORTEST:g} s.")
    table, n = np.stack(rows), len(vehicle.state_names)
    time = np.asarray(np.arange(len(rows)) * period, dtype=np.float64)
    truth = simulated_flight(vehicle, time, table[:, :n], table[:, n:], details={"flown": "by hand, live"})
    folder.mkdir(parents=True, exist_ok=True)
    truth.save(folder / f"recording-{number}-truth.nc")
    return observe(truth, vehicle, sensors=QUIET, seed=number).save(folder / f"recording-{number}.nc")
