"""Recordings that a killed program left behind, as one of the readers."""

from __future__ import annotations

from swashplate.errors import FlightError
from swashplate.flights import growing
from swashplate.flights.flight import Flight
from swashplate.flights.readers.options import Options
from swashplate.flights.readers.source import Source

NAME = "growing"
VERSION = "1"
NAMES_UNITS = True


def recognises(source: Source) -> bool:
    return source.content.startswith(growing.MAGIC)


def read(source: Source, options: Options) -> Flight:
    """The flight up to the last whole sample, with the provenance it was begun with.

    Raises:
        FlightError: where its head is damaged, or a mapping is given.
    """
    if options.mapping:
        raise FlightError(
            "a mapping has no meaning for a recording of swashplate: its channels are known.",
            where=source.name,
            hint="Leave it out.",
        )
    return growing.parse(source.content, where=source.name)
