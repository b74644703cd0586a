"""Flights as the options of a verb ask for them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from swashplate.cli import options

if TYPE_CHECKING:
    from swashplate.flights.flight import Flight


@dataclass(frozen=True)
class LogOptions:
    """What the user says about logs that the logs do not say themselves.

    Attributes:
        mapping: a file that maps columns to channels.
        units: units by channel or field.
        drop_bad_stamps: leave out samples whose time does not increase.
        as_logged: channels that contradict each other are used as they are.
    """

    mapping: Path | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    drop_bad_stamps: bool = False
    as_logged: bool = False


def asked(
    mapping: Path | None, unit: Sequence[str] | None, drop_bad_stamps: bool, as_logged: bool = False
) -> LogOptions:
    """The options as what is said about logs."""
    return LogOptions(mapping, options.assignments(unit, option="--unit"), drop_bad_stamps, as_logged)


def read(text: str, *, how: LogOptions | None = None) -> Flight:
    """The flight that `text` names, as `sp.read`; a saved simulation goes by its file's name.

    Raises:
        FlightError, UnitError, DatasetError: as the readers say.
    """
    from swashplate.flights.consistency import UNCHECKED
    from swashplate.flights.readers.read import read as read_log
    from swashplate.flights.readers.windows import split_log, split_window

    chosen = how or LogOptions()
    flight = read_log(
        text,
        mapping=chosen.mapping,
        units=chosen.units,
        bad_stamps="drop" if chosen.drop_bad_stamps else "error",
    )
    if chosen.as_logged:
        flight = flight.done(UNCHECKED)
    if not flight.provenance.simulated:
        return flight
    # Messages and reports name the file, not "simulated coax", of which there may be several.
    called = Path(split_log(split_window(text)[0])[0]).name
    return replace(flight, provenance=replace(flight.provenance, source=called))


def read_all(texts: Iterable[str] | None, *, how: LogOptions | None = None) -> list[Flight]:
    """Flights as logged."""
    return [read(text, how=how) for text in texts or ()]


def conditioned(texts: Iterable[str], *, rate: float, cutoff: float, how: LogOptions | None = None) -> list[Flight]:
    """Flights read and brought to one rate, each step in its history."""
    return [read(text, how=how).condition(rate=rate, cutoff=cutoff) for text in texts]
