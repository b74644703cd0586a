"""swashplate's own netCDF files, as one of the readers. What is in them is in the schema already."""

from __future__ import annotations

from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.flights.readers.options import Options, refuse_mapping
from swashplate.flights.readers.source import Source

NAME = "netcdf"
VERSION = "1"
NAMES_UNITS = True

_HDF5 = b"\x89HDF\r\n\x1a\n"
_CLASSIC = b"CDF"


def recognises(source: Source) -> bool:
    """An HDF5 file (netCDF 4), or a classic netCDF file, which `read` refuses in words."""
    return source.content.startswith((_HDF5, _CLASSIC))


def read(source: Source, options: Options) -> Flight:
    """The flight as it was saved, with the provenance it was saved with.

    Raises:
        FlightError: where it is no netCDF file that swashplate wrote, or where a mapping is given.
    """
    if source.content.startswith(_CLASSIC):
        raise FlightError(
            "is a classic netCDF file, not one that swashplate wrote.", where=source.name, hint="Export it as CSV."
        )
    refuse_mapping(options, "a swashplate netCDF file", where=source.name)
    return Flight.load(source.path)
