"""From what a user calls a flight to a `Flight`: a file, a data set's file, or a window of one."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from swashplate.errors import FlightError

if TYPE_CHECKING:
    from swashplate.flights.flight import Flight

_WINDOW = re.compile(r"(?P<file>.+)@(?P<start>\d+(?:\.\d*)?)-(?P<stop>\d+(?:\.\d*)?)")
_LOG = re.compile(r"(?P<file>.+)#(?P<number>\d{1,6})")


@dataclass(frozen=True)
class Reading:
    """What the user says about logs that the logs do not say themselves.

    Attributes:
        mapping: a file that maps columns to channels.
        units: units by channel or field.
        drop_bad_stamps: leave out samples whose time does not increase.
        channels: the log's channel by the name that it gets instead.
    """

    mapping: Path | None = None
    units: dict[str, str] = field(default_factory=dict)
    drop_bad_stamps: bool = False
    channels: Mapping[str, str] = field(default_factory=dict)


def split_window(text: str) -> tuple[str, tuple[float, float] | None]:
    """`FILE@START-STOP` as the file and the window [s]; a file of just this name wins."""
    found = None if Path(text).exists() else _WINDOW.fullmatch(text)
    return (text, None) if found is None else (found["file"], (float(found["start"]), float(found["stop"])))


def split_log(text: str) -> tuple[str, int | None]:
    """`FILE#N` as the file and which of its logs is meant; a file of just this name wins."""
    found = None if Path(text).exists() else _LOG.fullmatch(text)
    return (text, None) if found is None else (found["file"], int(found["number"]))


def read(text: str, *, how: Reading | None = None) -> Flight:
    """The flight, or the window of one, that `text` names, as logged; a saved simulation by its file's name.

    `FILE#N@START-STOP`: the log in a file of several, and the window [s]; both may be left out.

    Raises:
        FlightError, UnitError, DatasetError: as the readers say.
    """
    from swashplate.flights import datasets
    from swashplate.flights.readers.read import read as read_log

    chosen = how or Reading()
    named, window = split_window(text)
    file, log = split_log(named)
    flight = read_log(
        datasets.locate(file),
        mapping=chosen.mapping,
        units=chosen.units,
        bad_stamps="drop" if chosen.drop_bad_stamps else "error",
        log=log,
    )
    if flight.provenance.simulated:
        # Messages and reports name the file, not "simulated coax", of which there may be several.
        flight = replace(flight, provenance=replace(flight.provenance, source=Path(file).name))
    if window is None:
        return flight
    start, stop = window
    if flight.epoch and start >= flight.epoch:  # given as the log has them
        start, stop = start - flight.epoch, stop - flight.epoch
    if not (start < stop and start < flight.stop and stop > flight.start):
        raise FlightError(
            f"the window {start:g}-{stop:g} s holds nothing; the flight runs from {flight.start:.2f} to "
            f"{flight.stop:.2f} s.",
            where=file,
            hint="Give FILE@START-STOP in the log's seconds, as `swash inspect` shows them.",
        )
    return flight.between(start, stop)


def conditioned(texts: Iterable[str], *, rate: float, cutoff: float, how: Reading | None = None) -> list[Flight]:
    """Flights read and brought to one rate, each step in its history."""
    return [read(text, how=how).condition(rate=rate, cutoff=cutoff) for text in texts]


def check_disjoint(flights: Sequence[Flight], names: Sequence[str]) -> None:
    """That no stretch of a log is used twice: a hold-out that the fit has seen proves nothing.

    Raises:
        FlightError: naming the two.
    """
    for i, (one, name) in enumerate(zip(flights, names, strict=True)):
        for other, other_name in zip(flights[:i], names[:i], strict=True):
            hashed = one.provenance.sha256 and one.provenance.sha256 == other.provenance.sha256
            # Logs of one file, FILE#1 and FILE#2, are different flights.
            hashed = hashed and one.provenance.source.partition("#")[2] == other.provenance.source.partition("#")[2]
            # A saved simulation has no hash of its own.
            named = Path(split_window(name)[0]).resolve() == Path(split_window(other_name)[0]).resolve()
            if (hashed or named) and one.start < other.stop and other.start < one.stop:
                raise FlightError(
                    f"is the same stretch of the same log as {other_name}.",
                    where=name,
                    hint="Give another flight, or two windows of it: FILE@0-20 and FILE@20-40.",
                )
