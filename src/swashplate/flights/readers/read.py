"""`read`: the file's content decides which reader it gets, not its name."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Protocol

from swashplate.errors import FlightError
from swashplate.flights import datasets
from swashplate.flights.epoch import rebased
from swashplate.flights.flight import Flight
from swashplate.flights.readers import blackbox, checks, no_log
from swashplate.flights.readers.options import Options, cut, load_mapping, split_log, split_window, with_units
from swashplate.flights.readers.source import Source, open_source
from swashplate.registry import Registry


class Reader(Protocol):
    """What a reader module offers.

    One whose logs name their own units may say `NAMES_UNITS = True`: it gets no units, and those that a user gives are
    applied to what it read.
    """

    NAME: str
    VERSION: str

    def recognises(self, source: Source) -> bool: ...

    def read(self, source: Source, options: Options) -> Flight: ...


_OURS = (
    "ulog",
    "ardupilot",
    "px4log",
    "blackbox",
    "tlog",
    "rosbag",
    "mat_table",
    "nanobench",
    "netcdf",
    "growing",
    "optitrack",
    "vicon",
    "blackbox_csv",
    "xplane",
    "delimited",
)
_LAST = "delimited"  # nearly any text looks like a plain table
_TABLES = ("mat_table", _LAST)  # readers that a mapping of columns has a meaning for
READERS: Registry[Reader] = Registry(
    "readers",
    what="reader of flight logs",
    own={name: f"swashplate.flights.readers.{name}" for name in _OURS},
)
"""Asked in this order, other packages' readers (entry points) before the plain table, which is asked last."""


def read(
    path_or_name: str | os.PathLike[str],
    *,
    units: Mapping[str, str] | None = None,
    mapping: str | os.PathLike[str] | Mapping[str, Any] | None = None,
    body: str | None = None,
    rotation: str | None = None,
    body_axes: str | None = None,
    world_axes: str | None = None,
    bad_stamps: str = "error",
    log: int | None = None,
) -> Flight:
    """Reads a flight log: ArduPilot DataFlash (`.bin`, `.log`), PX4 ULog (`.ulg`) or `.px4log`, a ground station's
    telemetry (`.tlog`), Blackbox of Rotorflight and Betaflight (`.bbl`, `.bfl`, or exported as CSV), a ROS bag (1 or
    2), MATLAB files (`.mat`), tables of text (CSV), X-Plane's Data.txt, a NanoBench CSV file, a swashplate netCDF file,
    a Vicon or OptiTrack CSV export.

    ULog files and ROS bags need `pip install 'swashplate[logs]'`, telemetry `swashplate[link]`.

    Args:
        path_or_name: the file, or the folder of a rosbag2; or a file of a public data set as
            "coax56/flight_2011-08-01_vertical". "FILE@5-30" reads the seconds 5 to 30 of it, "FILE#2" the second log
            of a Blackbox file; a file that is called so wins.
        units: units by channel (CSV) or field (`.mat`, "position" of a motion capture file) where the file says none,
            or the wrong ones.
        mapping: a TOML file, or its content as a dictionary, that says which columns of a table, or which variables of
            a `.mat`, are which channels (`readers/delimited.py`); its table `[mocap]` may hold the next four.
        body: the tracked body, where a motion capture file has several.
        rotation: how three logged angles are meant: "helical" or "euler_xyz", where the file does not say.
        body_axes: where the tracked body's logged axes point, for example "forward-left-up" (a bag's default).
        world_axes: where the room's logged axes point, for example "north-west-up" (a bag's default: "east-north-up").
        bad_stamps: "error", or "drop" to leave out samples whose time repeats or goes backwards.
        log: which of the logs in a Blackbox file, from 1; the longest if not given.

    Returns:
        The flight in SI units, radians, NED and FRD, at its native rates, not repaired in any way. Where stamps are
        large (Unix time) all streams begin in the first second, and `Flight.epoch` says what was taken off.

    Raises:
        FlightError, UnitError: naming the file, the channel, what was found, what was expected and what to do.
        DatasetError: where a data set's file is named that is not on this machine.
    """
    named, window = split_window(path_or_name)
    file, number = split_log(named)
    if log is not None and number is not None:
        raise FlightError(f"names log {number}, and log={log} is given too.", where=named, hint="Give one of them.")
    options = Options(
        units=units or {},
        mapping=load_mapping(mapping),
        mapping_file="" if mapping is None or isinstance(mapping, Mapping) else os.fspath(mapping),
        body=body,
        rotation=rotation,
        body_axes=body_axes,
        world_axes=world_axes,
        bad_stamps=bad_stamps,
        log=number if log is None else log,
    )
    flight = _with_limits(_entire(datasets.locate(file), options))
    return flight if window is None else cut(flight, *window, where=file)


def _with_limits(flight: Flight) -> Flight:
    """The flight, with what lies beyond the schema's limits among the damage (once: a saved flight may say it)."""
    origin = flight.provenance
    beyond = tuple(text for text in checks.beyond_limits(flight) if text not in origin.damage)
    return replace(flight, provenance=replace(origin, damage=(*origin.damage, *beyond))) if beyond else flight


def _entire(path: str | os.PathLike[str], options: Options) -> Flight:
    """One log of a file from its first sample to its last."""
    source = open_source(path)
    no_log.refuse(source)
    if options.log is not None and not blackbox.recognises(source):
        raise FlightError(
            "holds one log only.",
            where=source.path,
            channel="log",
            hint="Only Blackbox files hold several: leave it out.",
        )
    if "channels" in options.mapping:  # columns are named, so it is a table, whichever reader would know its head
        reader = next((READERS[name] for name in _TABLES if READERS[name].recognises(source)), None)
        if reader is None:
            raise FlightError(
                f"is no table, and the mapping names columns; it starts with {source.content[:8]!r}.",
                where=source.path,
                channel="mapping",
                hint="Leave the mapping out: the log says itself what its channels are.",
            )
        return rebased(reader.read(source, options))
    for name in (*(name for name in READERS if name != _LAST), _LAST):
        reader = READERS[name]
        if reader.recognises(source):
            if getattr(reader, "NAMES_UNITS", False):
                flight = reader.read(source, replace(options, units={}))
                return rebased(with_units(flight, options.units, where=source.name))
            return rebased(reader.read(source, options))
    raise FlightError(
        f"is no flight log that is known; it starts with {source.content[:8]!r}.",
        where=source.path,
        hint="Known are ArduPilot (.bin, .log), PX4 (.ulg, .px4log), telemetry (.tlog), Blackbox (.bbl), ROS bags, "
        "MATLAB (.mat), X-Plane's Data.txt, NanoBench CSV, swashplate netCDF (.nc), CSV (columns parted by comma, "
        "semicolon or tab), and the exports of Vicon and OptiTrack.",
    )
