"""That no stretch of a log is used twice: a hold-out that the fit has seen proves nothing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.flights.readers.windows import split_window


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
