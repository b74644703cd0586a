"""What a user may tell a reader that the file does not say: units, a mapping, a window, a log among several."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from swashplate import documents
from swashplate.errors import FlightError, UnitError
from swashplate.flights import units
from swashplate.flights.datasets import locate
from swashplate.flights.flight import Flight
from swashplate.flights.schema import LOGGED_UNIT, channel
from swashplate.registry import listed, nearest

_MOCAP_KEYS = ("body", "rotation", "body_axes", "world_axes")


@dataclass(frozen=True)
class Options:
    """Arguments of `read` as the readers see them.

    Attributes:
        units: units by column or field name, where the file has none or wrong ones.
        mapping: the parsed mapping file (see `readers/delimited.py`).
        mapping_file: its name, for messages about it; "" where it was given as a dictionary.
        body: the tracked body, where a motion capture file has several.
        rotation: "helical", "euler_xyz" or "quaternion", where the file does not say.
        body_axes: where the logged body axes x, y, z point, for example "forward-left-up".
        world_axes: where the logged world axes x, y, z point, for example "north-west-up".
        bad_stamps: "error", or "drop" to leave out samples whose time does not increase.
        log: which of a file's logs is read, from 1; None for the longest.
    """

    units: Mapping[str, str] = field(default_factory=dict)
    mapping: Mapping[str, Any] = field(default_factory=dict)
    mapping_file: str = ""
    body: str | None = None
    rotation: str | None = None
    body_axes: str | None = None
    world_axes: str | None = None
    bad_stamps: str = "error"
    log: int | None = None


def load_mapping(mapping: str | os.PathLike[str] | Mapping[str, Any] | None) -> Mapping[str, Any]:
    """The mapping as a dictionary, read from a TOML file where a path is given."""
    if mapping is None:
        return {}
    if isinstance(mapping, Mapping):
        return mapping
    hint = "Correct the mapping file; `docs/howto/your-own-csv.md` has one to copy."
    document = documents.read_document(Path(mapping), form="toml", error=FlightError, hint=hint)
    if not document:
        raise FlightError("says nothing.", where=Path(mapping), hint=hint)
    return document


def with_mocap_table(options: Options) -> Options:
    """Options completed from the mapping's table `[mocap]`; arguments win over the file."""
    table = options.mapping.get("mocap", {})
    if not isinstance(table, Mapping) or set(table) - set(_MOCAP_KEYS):
        raise FlightError(
            f"the mapping's table [mocap] may hold {', '.join(_MOCAP_KEYS)}; found {table!r}.",
            where=options.mapping_file or None,
            hint="Correct the key.",
        )
    given: dict[str, Any] = {key: getattr(options, key) or table.get(key) for key in _MOCAP_KEYS}
    wrong = [key for key, value in given.items() if not isinstance(value, str | None)]
    if wrong:
        raise FlightError(
            f"'{wrong[0]}' in the mapping's table [mocap] must be text.",
            where=options.mapping_file or None,
            channel=wrong[0],
        )
    return replace(options, **given)


def refuse_mapping(options: Options, what: str, *, where: str) -> None:
    """Raises a FlightError where a mapping is given for a file whose channels are known, such as "a ULog file"."""
    if options.mapping:
        raise FlightError(
            f"a mapping has no meaning for {what}: its channels are known.", where=where, hint="Leave it out."
        )


def with_units(flight: Flight, given: Mapping[str, str], *, where: str) -> Flight:
    """The flight with the numbers of some channels taken in other units than the log says, noted in its provenance.

    Args:
        given: unit by channel, as `{"p": "-rad/s"}` for a gyro that counts the other way, or `{"q": "deg/s"}` for one
            whose numbers are degrees. It stands in place of the unit that the channel was logged in.

    Raises:
        UnitError: no such channel, or a unit of another quantity.
    """
    streams, notes = dict(flight.streams), []
    for name, unit in given.items():
        if name not in flight:
            raise UnitError(
                f"a unit is given for a channel that the log lacks; it has {listed(flight.channels)}.",
                where=where,
                channel=name,
                hint=nearest(name, flight.channels) or "Correct the name that the unit is given for.",
            )
        inside = str(flight[name].attrs.get("units", ""))
        before = str(flight[name].attrs.get(LOGGED_UNIT, "")) or inside
        factor = units.to_inside(1.0, unit, expected=inside, channel=name, where=where) / units.to_inside(1.0, before)
        for stream, data in streams.items():
            if name in data:
                changed = (data[name] * float(factor)).assign_attrs({**data[name].attrs, LOGGED_UNIT: unit})
                streams[stream] = data.assign({name: changed})
        notes.append(f"{name}: taken in {unit}, which was given, and not in {before}, as the log has it")
    noted = replace(flight.provenance, notes=(*flight.provenance.notes, *notes))
    return replace(flight.with_streams(streams), provenance=noted)


def unit_to_give(flight: Flight, name: str, *, sign: str, looks_like: str = "") -> str:
    """The option that mends a channel: it replaces the unit that the file was read with, sign and all.

    Args:
        flight, name: the flight, and its channel.
        sign: "-" where the sign must be turned, "" where it is right.
        looks_like: the unit that its numbers are in; "" where its own is right.
    """
    inside = channel(name).unit
    attributes = flight[name].attrs
    logged = str(attributes.get(LOGGED_UNIT, "")) or inside or str(attributes.get("units", "")) or "1"
    turned, unsigned = logged.startswith("-"), logged.removeprefix("-")
    if looks_like and unsigned != inside:
        return f"It was read as {logged}; check its unit."
    signed = "-" if turned != bool(sign) else ""
    return f"Give --unit {name}={signed}{looks_like or unsigned}."


_WINDOW = re.compile(r"(?P<file>.+)@(?P<start>\d+(?:\.\d*)?)-(?P<stop>\d+(?:\.\d*)?)")
_LOG = re.compile(r"(?P<file>.+)#(?P<number>\d{1,6})")


def split_window(text: str | os.PathLike[str]) -> tuple[str, tuple[float, float] | None]:
    """`FILE@START-STOP` as the file and the window [s]; a file of just this name wins."""
    name = os.fspath(text)
    match = _WINDOW.fullmatch(name)
    if match is None or Path(name).exists():
        return name, None
    return match["file"], (float(match["start"]), float(match["stop"]))


def split_log(text: str) -> tuple[str, int | None]:
    """`FILE#N` as the file and which of its logs is meant; a file of just this name wins."""
    match = _LOG.fullmatch(text)
    return (text, None) if match is None or Path(text).exists() else (match["file"], int(match["number"]))


def is_log(named: object, *, matrices: bool) -> bool:
    """Whether a text names a log and no model: by its ending, which a model's name lacks, or as a folder (rosbag2).

    Args:
        named: a text or a path. matrices: whether a .mat is an export's matrices, else it is a log.
    """
    if not isinstance(named, str | os.PathLike):
        return False
    file = Path(locate(split_log(split_window(named)[0])[0]))
    return file.is_dir() or file.suffix.lower() not in ("", ".toml", ".json", *([".mat"] * matrices))


def cut(flight: Flight, start: float, stop: float, *, where: str) -> Flight:
    """The window of a flight, its limits [s] in the flight's time or in the log's own.

    Args:
        where: the file, for messages.

    Raises:
        FlightError: for a window that holds nothing.
    """
    if flight.epoch and start >= flight.epoch:  # given as the log has them
        start, stop = start - flight.epoch, stop - flight.epoch
    if not (start < stop and start < flight.stop and stop > flight.start):
        raise FlightError(
            f"the window {start:g}-{stop:g} s holds nothing; the flight runs from {flight.start:.2f} to "
            f"{flight.stop:.2f} s.",
            where=where,
            hint="Give FILE@START-STOP in the log's seconds, as `swash inspect` shows them.",
        )
    return flight.between(start, stop)
