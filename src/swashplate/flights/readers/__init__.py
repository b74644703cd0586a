"""Readers: from a log file to a `Flight`. The file's content decides which reader it gets, not its name.

A reader is a module with `NAME`, `VERSION` (both go into the flight's provenance with the file's hash),
`recognises(source)` and `read(source, options)`.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol, cast

from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.flights.readers import (
    analogue,
    ardupilot,
    coax56,
    delimited,
    netcdf,
    optitrack,
    px4log,
    rosbag,
    ulog,
    vicon,
)
from swashplate.flights.readers.options import Options, load_mapping
from swashplate.flights.readers.source import Source, open_source


class Reader(Protocol):
    """What a reader module offers."""

    NAME: str
    VERSION: str

    def recognises(self, source: Source) -> bool: ...

    def read(self, source: Source, options: Options) -> Flight: ...


# Asked in this order; the plain table comes last because nearly any text looks like one.
READERS = cast(tuple[Reader, ...], (ardupilot, px4log, ulog, rosbag, coax56, netcdf, optitrack, vicon, delimited))


def read(
    path: str | Path,
    *,
    units: Mapping[str, str] | None = None,
    mapping: str | Path | Mapping[str, Any] | None = None,
    body: str | None = None,
    rotation: str | None = None,
    body_axes: str | None = None,
    world_axes: str | None = None,
    bad_stamps: str = "error",
) -> Flight:
    """Reads a flight log: ArduPilot DataFlash (`.bin`, `.log`), PX4 ULog (`.ulg`) or `.px4log`, a ROS bag (1 or 2), a
    CoaX-56 `.mat` record, a swashplate netCDF or CSV file, a Vicon or OptiTrack CSV export.

    ULog files and ROS bags need `pip install swashplate[logs]`.

    Args:
        path: the file, or the folder of a rosbag2.
        units: units by channel (CSV) or field (`.mat`, "position" of a motion capture file) where the file says none,
            or the wrong ones.
        mapping: a TOML file, or its content as a dictionary, that says which columns of a CSV file are which channels
            (`readers/delimited.py`); its table `[mocap]` may hold the next four. With a table `[recorder]` it is the
            calibration of an analogue recorder (`readers/analogue.py`).
        body: the tracked body, where a motion capture file has several.
        rotation: how three logged angles are meant: "helical" or "euler_xyz", where the file does not say.
        body_axes: where the tracked body's logged axes point, for example "forward-left-up" (a bag's default).
        world_axes: where the room's logged axes point, for example "north-west-up" (a bag's default: "east-north-up").
        bad_stamps: "error", or "drop" to leave out samples whose time repeats or goes backwards.

    Returns:
        The flight in SI units, radians, NED and FRD, at its native rates, not repaired in any way.

    Raises:
        FlightError, UnitError: naming the file, the channel, what was found, what was expected and what to do.
    """
    source = open_source(path)
    options = Options(
        units=units or {},
        mapping=load_mapping(mapping),
        mapping_file="" if mapping is None or isinstance(mapping, Mapping) else str(mapping),
        body=body,
        rotation=rotation,
        body_axes=body_axes,
        world_axes=world_axes,
        bad_stamps=bad_stamps,
    )
    if analogue.is_calibration(options.mapping):
        return analogue.read(source, options)
    for reader in READERS:
        if reader.recognises(source):
            return reader.read(source, options)
    raise FlightError(
        f"is no flight log that is known; it starts with {source.content[:8]!r}.",
        where=source.path,
        hint="Known are ArduPilot (.bin, .log), PX4 (.ulg, .px4log), ROS bags, CoaX-56 .mat, swashplate netCDF (.nc), "
        "CSV (columns parted by comma, semicolon or tab), and the CSV exports of Vicon and OptiTrack.",
    )


__all__ = ["READERS", "Options", "Reader", "Source", "read"]
