"""What is in a ROS bag, told in frames by the process that reads it (`foreign_process`): `rosbags` decodes it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import chdir
from pathlib import Path
from typing import Any

import numpy as np

from swashplate.errors import FlightError
from swashplate.flights.foreign_process import Frame, UnpackedError, limit_met
from swashplate.flights.readers.rosbag_types import TYPES, Row, every_number

_ZSTANDARD = b"\x28\xb5\x2f\xfd"
_PIECE = 1 << 20  # bytes that are unpacked at once


def frames(path: Path, *, disk: int = 0, every: bool = False) -> Iterator[Frame]:
    """A bag's messages of known types, by topic.

    Args:
        path: the bag.
        disk: bytes that its packed files may unpack to.
        every: all numbers of all types that the bag defines, by their own names, and not those that are read.

    Yields:
        {"topic", "names", "bytes"} with, for each message, its place in the bag, its stamp [s from the first message]
        and its numbers by name, NaN where it lacks one (float64); at the end {"counts": [[topic, type, messages]],
        "begin": first stamp [ns], "damage": words}.

    Raises:
        FlightError: where nothing of it can be read.
        UnpackedError: where its packed files unpack to more.
        MemoryError: as it says.
    """
    if path.is_dir():
        _measure_packed(path, disk)
    stamps, rows, counts, begin, damage = _collected(path, every=every)
    for topic, received in rows.items():
        names = list(dict.fromkeys(name for row in received for name in row))
        table = np.array([[row.get(name, np.nan) for name in names] for row in received])
        stamped = np.hstack([np.array(stamps[topic]), table.reshape(len(received), len(names))])
        yield {"topic": topic, "names": names, "bytes": stamped.nbytes}, stamped.tobytes()
    yield {"counts": [[*key, n] for key, n in counts.items()], "begin": begin, "damage": damage}, b""
    yield {}, b""


def _measure_packed(folder: Path, most: int) -> None:
    """Unpacks the files that are packed whole, and keeps nothing: `rosbags` would write all of it to the disk."""
    zstandard, unpacked = None, 0
    for place in folder.iterdir():
        if not place.is_file():
            continue
        with place.open("rb") as packed:
            if packed.read(len(_ZSTANDARD)) != _ZSTANDARD:
                continue
            if zstandard is None:
                from rosbags.rosbag2.reader import zstd as zstandard
            packed.seek(0)
            with zstandard.open(packed, "rb") as content:
                while piece := content.read(_PIECE):
                    unpacked += len(piece)
                    if unpacked > most:
                        raise UnpackedError(place.name)


Collected = tuple[dict[str, list[tuple[int, float]]], dict[str, list[Row]], dict[tuple[str, str], int], int, list[str]]


def _collected(path: Path, *, every: bool) -> Collected:
    """By topic places and stamps, and numbers; messages by topic and type, first stamp [ns], damage."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    known_types: Mapping[str, Callable[[Any], Row]] = TYPES
    stamps: dict[str, list[tuple[int, float]]] = {}
    rows: dict[str, list[Row]] = {}
    counts: dict[tuple[str, str], int] = {}
    damage: list[str] = []
    begin = 0
    try:
        # Bags of older ROS 2 carry no definitions; the messages that are read here have not changed since.
        with (
            chdir(
                path if path.is_dir() else path.parent
            ),  # SQLite would take ?, # and % of a folder's name for its own
            AnyReader(
                [Path() if path.is_dir() else Path(path.name)], default_typestore=get_typestore(Stores.LATEST)
            ) as bag,
        ):
            begin = int(bag.start_time)
            for connection in bag.connections:
                key = (connection.topic, connection.msgtype)
                counts[key] = counts.get(key, 0) + int(connection.msgcount)
            known = [c for c in bag.connections if c.msgtype in (bag.typestore.types if every else known_types)]
            try:
                for place, (connection, received, raw) in enumerate(bag.messages(known) if known else ()):
                    message = bag.deserialize(raw, connection.msgtype)
                    at = _stamp(message, received)
                    stamps.setdefault(connection.topic, []).append((place, (at - begin) * 1e-9))
                    rows.setdefault(connection.topic, []).append(
                        every_number(message) if every else known_types[connection.msgtype](message)
                    )
            except Exception as error:  # a damaged bag can raise anything in there
                if limit_met(error):
                    raise
                read_so_far = sum(map(len, rows.values()))
                damage.append(f"the bag is damaged after {read_so_far} messages: {_sentence(error)}")
    except Exception as error:
        if limit_met(error):
            raise
        if not rows:
            raise FlightError(
                f"does not open as a ROS bag: {_sentence(error)}.",
                hint="It was perhaps not closed: mend it with `rosbag reindex` (ros2 bag reindex), or copy it again.",
            ) from error
    return stamps, rows, counts, begin, damage


def _sentence(error: Exception) -> str:
    return (str(error) or type(error).__name__).strip().rstrip(".")


def _stamp(message: Any, received: int) -> int:
    """The header's time [ns], or the time of recording where there is none."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    ns = int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec) if stamp is not None else 0
    return ns or int(received)
