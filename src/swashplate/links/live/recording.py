"""What was flown by hand as flights on disk: the truth, and what motion capture would have logged of it.

A recording has a number of its own in its folder, whoever else records there and whatever earlier sessions left.
"""

from __future__ import annotations

from itertools import count
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swashplate.atomic import added_when_complete, make_folder
from swashplate.errors import FlightError
from swashplate.models.vehicle import Vehicle

SHORTEST, LONGEST = 2.0, 1800.0
"""Seconds: less is a slip of the finger, more fills the memory."""


def save_recording(
    vehicle: Vehicle, rows: list[NDArray[np.float64]], *, period: float, folder: Path
) -> tuple[int, Path]:
    """Write `recording-N.nc` (with sensor noise, as a log) and `recording-N-truth.nc` under the first free number N.

    N, which seeds the noise, is free where the folder has neither these files nor what is made of them
    (`identified-N`, `card-N.toml`). Nothing is overwritten, whatever other programs do meanwhile.

    Args:
        vehicle: what flew.
        rows: states, inputs and surroundings side by side, one row a controller period.
        period: between rows [s].
        folder: made if missing.

    Returns:
        The number, and the log's path.

    Raises:
        FlightError: for less than two seconds, or where the folder cannot be written to.
    """
    from swashplate.links.recorder import begin
    from swashplate.simulation.record import simulated_flight
    from swashplate.simulation.sensors import QUIET, observe

    if len(rows) * period < SHORTEST:
        raise FlightError(f"the recording has {len(rows) * period:.1f} s, expected at least {SHORTEST:g} s.")
    table, n = np.stack(rows), len(vehicle.state_names)
    time = np.asarray(np.arange(len(rows)) * period, dtype=np.float64)
    truth = simulated_flight(vehicle, time, table[:, :n], table[:, n:], details={"flown": "by hand, live"})
    make_folder(folder)
    unflown = truth.with_streams({name: data.isel(time=slice(0, 0)) for name, data in truth.streams.items()})
    first = 1
    while True:
        names = (folder / f"recording-{number}.nc" for number in count(first))
        log, claim = begin(names, like=unflown, taken=_taken)
        number = _number(log)
        try:
            with added_when_complete(_truth(log)) as one, added_when_complete(log) as other:
                truth.save(one)
                observe(truth, vehicle, sensors=QUIET, seed=number).save(other)
            return number, log
        except FileExistsError:  # somebody put one there who does not know of claims
            first = number + 1
        finally:
            claim.discard()


def _number(log: Path) -> int:
    return int(log.stem.removeprefix("recording-"))


def _truth(log: Path) -> Path:
    return log.with_stem(f"{log.stem}-truth")


def _taken(log: Path) -> bool:
    number = _number(log)
    made = (log, _truth(log), log.with_name(f"identified-{number}"), log.with_name(f"card-{number}.toml"))
    return any(path.exists() for path in made)
