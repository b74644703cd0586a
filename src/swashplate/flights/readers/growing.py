"""Recordings that a killed program left behind, as one of the readers."""

from __future__ import annotations

from swashplate.errors import FlightError
from swashplate.flights import growing
from swashplate.flights.flight import Flight
from swashplate.flights.readers.options import Options
from swashplate.flights.readers.source import Source

NAME = "growing"
VERSION = "1"


def recognises(source: Source) -> bool:
    return source.content.startswith(growing.MAGIC)


def read(source: Source, options: Options) -> Flight:
    """The flight up to the last whole sample, with the provenance it was begun with.

    Raises:
        FlightError: where its head is damaged, or units or a mapping are given.
    """
    if options.units or options.mapping:
        raise FlightError(
            "units and mappings have no meaning for a recording of swashplate: its units are known.",
            where=source.name,
            hint="Leave them out.",
        )
    return growing.parse(source.content, where=source.name)
