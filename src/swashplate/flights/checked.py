"""Logs as they are taken to work: contradictions stop one, problems go into every report, no stretch is used twice."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path

from swashplate.errors import FlightError
from swashplate.flights.consistency import UNCHECKED, refuse_inconsistent
from swashplate.flights.flight import Flight
from swashplate.flights.inspect import problems
from swashplate.flights.provenance import Problem
from swashplate.flights.readers.options import split_window


def checked(flight: Flight, used: Collection[str] | None = None) -> Flight:
    """The flight with the problems of its channels in its provenance (`Provenance.problems`).

    Args:
        used: the channels that are worked on; what is wrong with others is neither told nor stops anything. None: all.
            Where the user takes the log as it is, a wrong scale is a problem like others.

    Raises:
        FlightError: channels that contradict each other, as `refuse_inconsistent` says.
    """
    taken = any(step.operation == UNCHECKED for step in flight.history)
    said = [Problem(str(finding), () if taken else finding.scale) for finding in refuse_inconsistent(flight, used=used)]
    if used is not None:
        kept = {home: data[[n for n in data.data_vars if n in used]] for home, data in flight.streams.items()}
        flight, entire = flight.with_streams({home: data for home, data in kept.items() if data.data_vars}), flight
    else:
        entire = flight
    said += [Problem(text) for text in problems(flight, entire)]
    before = entire.provenance.problems
    return replace(entire, provenance=replace(entire.provenance, problems=tuple(dict.fromkeys((*before, *said)))))


def check_disjoint(flights: Sequence[Flight], names: Sequence[str] | None = None) -> None:
    """That no two flights hold the same stretch of the same log.

    Args:
        flights: to compare.
        names: as the user calls them, files as far as they are files; the flights' sources where None.

    Raises:
        FlightError: naming the two.
    """
    called = [flight.provenance.source for flight in flights] if names is None else names
    for i, (one, name) in enumerate(zip(flights, called, strict=True)):
        for other, other_name in zip(flights[:i], called[:i], strict=True):
            hashed = one.provenance.sha256 and one.provenance.sha256 == other.provenance.sha256
            # Logs of one file, FILE#1 and FILE#2, are different flights.
            hashed = hashed and one.provenance.source.partition("#")[2] == other.provenance.source.partition("#")[2]
            # A saved simulation has no hash of its own.
            named = names is not None and _file(name) == _file(other_name)
            if (hashed or named) and one.start < other.stop and other.start < one.stop:
                raise FlightError(
                    f"is the same stretch of the same log as {other_name}.",
                    where=name,
                    hint="Give another flight, or two windows of it: FILE@0-20 and FILE@20-40.",
                )


def _file(name: str) -> Path:
    return Path(split_window(name)[0]).resolve()
