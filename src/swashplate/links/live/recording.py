"""What was flown by hand as flights on disk: the truth, and what motion capture would have logged of it.

A recording has a number of its own in its folder, whoever else records there and whatever earlier sessions left. It is
on disk while it is flown (`recording-N.growing`, beside the vehicle as `card-N.toml`), so that a program that is killed
leaves it there; the next session makes the flights of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swashplate.atomic import added_when_complete, make_folder
from swashplate.errors import FlightError, SwashError
from swashplate.flights.flight import Flight
from swashplate.flights.growing import SUFFIX
from swashplate.links.notices import Say
from swashplate.links.recorder import begin, read_grown, salvage
from swashplate.models.catalogue import vehicle as load_vehicle
from swashplate.models.doubts import monitored
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.record import unflown

SHORTEST, LONGEST = 2.0, 1800.0
"""Seconds: less is a slip of the finger, more is another recording."""


@dataclass(frozen=True)
class SavedRecording:
    """A recording as flights.

    Attributes:
        number: its own. path: the log; the truth lies beside it.
        vehicle: that flew.
        seconds: its length. period: between its samples [s].
        inputs: of the vehicle, shape (n, n_inputs).
    """

    number: int
    path: Path
    vehicle: Vehicle
    seconds: float
    period: float
    inputs: NDArray[np.float64]


class LiveRecording:
    """A recording that is being flown.

    Args:
        vehicle: what flies.
        period: between rows [s].
        folder: made if missing.

    Raises:
        SwashError: where the folder cannot be written to.

    Attributes:
        number: under which it is saved, if no other program takes that name.
        path: the growing file.
        trouble: why it has stopped while the flight goes on; "" where it has not.
    """

    def __init__(self, vehicle: Vehicle, *, period: float, folder: Path) -> None:
        make_folder(folder)
        like = unflown(vehicle, details={"flown": "by hand, live"})
        log, self._growing = begin((folder / f"recording-{n}.nc" for n in count(1)), like=like, taken=_taken)
        self.vehicle, self.number, self.path, self.trouble = vehicle, _number(log), self._growing.path, ""
        self._period = period
        try:
            vehicle.save(_card(log))
        except BaseException:
            self._growing.discard()
            raise

    @property
    def seconds(self) -> float:
        """How long it is."""
        return self._growing.rows * self._period

    def add(self, row: NDArray[np.float64]) -> None:
        """Keep states, inputs and surroundings of one period. Where that fails the flight goes on: see `trouble`."""
        if self.trouble:
            return
        if self.seconds >= LONGEST:
            self.trouble = f"The recording ends here: it has {LONGEST:g} s. Save it, and begin another one."
            return
        try:
            self._growing.append(self._growing.rows * self._period, row.tolist())
        except OSError as error:
            self.trouble = f"The recording has stopped after {self.seconds:.1f} s: {self.path}: {error.strerror}."

    def finish(self) -> SavedRecording:
        """Write `recording-N.nc` (with sensor noise, as a log) and `recording-N-truth.nc`; the growing file goes.

        Raises:
            FlightError: for less than `SHORTEST` seconds, of which nothing is kept; where the flights cannot be
                written, with the growing file's name, which stays.
        """
        if self.seconds < SHORTEST:
            problem = f"the recording has {self.seconds:.1f} s, expected at least {SHORTEST:g} s."
            self._growing.discard()
            _card(self.path).unlink(missing_ok=True)
            raise FlightError(problem)
        try:
            flight = read_grown(self.path)
            assert flight is not None
            saved = _save(flight, self.vehicle, self.path)
        except BaseException as error:
            self._growing.close()
            if not isinstance(error, SwashError):
                raise
            kept = f"What was flown stays in {self.path}: `swash inspect` reads it, and the next `swash live` saves it."
            raise FlightError(error.problem, where=error.where, hint=kept) from None
        self._growing.discard()
        return saved


def recover(folder: Path, say: Say) -> tuple[Path, ...]:
    """Make flights of what sessions that were killed have left in a folder; returns the logs."""

    def keep(left: Path, flight: Flight) -> Path:
        return _save(flight, load_vehicle(str(_card(left))), left).path

    grown = [left for left in folder.glob(f"recording-*{SUFFIX}") if left.stem.removeprefix("recording-").isdecimal()]
    return salvage(sorted(grown), keep, say, shortest=SHORTEST)


def _save(flight: Flight, vehicle: Vehicle, growing: Path) -> SavedRecording:
    """The flights of a growing file, under its number, or under the first free one where that was taken since.

    The number seeds the noise. Nothing is overwritten, whatever other programs do meanwhile.
    """
    from swashplate.simulation.sensors import QUIET, observe

    truth = monitored(flight, vehicle)
    first = _number(growing)
    for number in count(first):
        log = growing.with_name(f"recording-{number}.nc")
        if number != first and (_taken(log) or log.with_suffix(SUFFIX).exists()):
            continue
        try:
            with added_when_complete(_truth(log)) as one, added_when_complete(log) as other:
                truth.save(one)
                observe(truth, vehicle, sensors=QUIET, seed=number).save(other)
        except FileExistsError:  # somebody put one there who does not know of claims
            continue
        if number != first:
            vehicle.save(_card(log))
        inputs = truth.array(vehicle.input_names)
        return SavedRecording(number, log, vehicle, truth.duration, truth.duration / (len(inputs) - 1), inputs)
    raise AssertionError("numbers end")


def _number(log: Path) -> int:
    return int(log.stem.removeprefix("recording-"))


def _truth(log: Path) -> Path:
    return log.with_stem(f"{log.stem}-truth")


def _card(log: Path) -> Path:
    return log.with_name(f"card-{_number(log)}.toml")


def _taken(log: Path) -> bool:
    places = (log, _truth(log), log.with_name(f"identified-{_number(log)}"), _card(log))
    return any(path.exists() for path in places)
