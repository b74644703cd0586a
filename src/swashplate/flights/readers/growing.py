"""Recordings that a killed program left behind, as one of the readers."""

from __future__ import annotations

from swashplate.flights import growing
from swashplate.flights.flight import Flight
from swashplate.flights.readers.options import Options, refuse_mapping
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
    refuse_mapping(options, "a recording of swashplate", where=source.name)
    return growing.parse(source.content, where=source.name)
