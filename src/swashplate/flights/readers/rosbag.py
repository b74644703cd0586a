"""ROS bags: rosbag1 (`.bag`) and rosbag2 (a folder with metadata.yaml, or one `.db3` or `.mcap`), decoded by `rosbags`
in a process of its own (`rosbag_frames`).

Each topic of a known message type becomes a stream, stamped by its header, counted from the bag's first message. ROS
has x forward, y left, z up on board and x east, y north, z up in the world (REP 103); another world or body is said by
`world_axes` and `body_axes`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.atomic import scratch_folder
from swashplate.errors import FlightError
from swashplate.extras import library
from swashplate.flights import foreign
from swashplate.flights.flight import Flight
from swashplate.flights.readers import clocked, frames
from swashplate.flights.readers.options import Options, with_mocap_table
from swashplate.flights.readers.rosbag_types import TYPES
from swashplate.flights.readers.source import Source
from swashplate.flights.schema import QUATERNION

NAME = "rosbag"
VERSION = "1"
NAMES_UNITS = True

_BODY, _WORLD = "forward-left-up", "east-north-up"
_MAGIC = (b"#ROSBAG V", b"\x89MCAP0\r\n", b"SQLite format 3\0")


def recognises(source: Source) -> bool:
    """A rosbag's magic bytes, or a folder with rosbag2's metadata."""
    return source.path.is_dir() or source.content.startswith(_MAGIC)


_UNITS = {"voltage": "V", "current": "A", "rcin": "us", "rcout": "us", "stick": "1", "mixer": "1"}


def read(source: Source, options: Options) -> Flight:
    """A ROS bag as a flight: one stream a topic of a known type; other topics are listed in the notes.

    Args:
        source: the bag.
        options: `world_axes` and `body_axes` where they are not ROS's own.

    Raises:
        FlightError: where rosbags is not installed, the bag cannot be opened, or nothing in it can be used.
    """
    options = with_mocap_table(options)
    if set(options.mapping) - {"mocap"}:
        raise FlightError(
            "a mapping of channels has no meaning for a ROS bag: its channels are known.",
            where=source.name,
            hint="Leave them out; world_axes and body_axes may be given.",
        )
    body = frames.axes(options.body_axes or _BODY, where=source.name)
    world = frames.axes(options.world_axes or _WORLD, where=source.name)
    topics, counts, begin, damage = _received(source)
    remarks = clocked.Remarks(damage=damage)
    streams: dict[str, xr.Dataset] = {}
    taken: set[str] = set()
    for topic, received in _one_run(topics, remarks).items():
        name = re.sub(r"\W+", "_", topic.strip("/")) or "topic"
        columns = _columns(received.numbers, name, body=body, world=world)
        named = {c if c not in taken else f"{c}_{name}": value for c, value in columns.items()}
        data = clocked.made_stream(name, received.time, named, remarks=remarks)
        if data is not None and name not in streams:
            streams[name] = data
            taken |= set(map(str, data.data_vars))
    if not streams:
        listed = ", ".join(f"{topic} ({kind})" for topic, kind in counts) or "none"
        raise FlightError(
            f"holds no flight: no topic of a known type has two messages; its topics are {listed}"
            f"{''.join(f'; {text}' for text in damage)}.",
            where=source.name,
            hint="Record poses, odometry, inertial sensors, sticks or servo commands.",
        )
    by_topic = {f"{topic} [{kind}]": n for (topic, kind), n in counts.items()}
    remarks.notes += clocked.unread(by_topic, [f"{topic} [{kind}]" for topic, kind in counts if kind in TYPES])
    said = source.provenance(
        NAME, VERSION, notes=tuple(remarks.notes), damage=tuple(remarks.damage), epoch=begin * 1e-9
    )
    return Flight(streams, said)


@dataclass(frozen=True)
class _Topic:
    """Messages of a topic: places in the bag and stamps [s from the first message], shape (n,), and numbers by name."""

    place: NDArray[np.int64]
    time: Array
    numbers: Mapping[str, Array]

    def cut(self, keep: clocked.Mask) -> _Topic:
        numbers = {name: values[keep] for name, values in self.numbers.items()}
        return _Topic(self.place[keep], self.time[keep], numbers)


def _one_run(topics: dict[str, _Topic], remarks: clocked.Remarks) -> dict[str, _Topic]:
    """The topics in the longest run between clock resets; nodes may have clocks of their own."""
    (first, last), said = clocked.longest_run([(topic.place, topic.time) for topic in topics.values()])
    if not said:
        return topics
    remarks.damage.append(said)
    cut = {name: topic.cut((topic.place >= first) & (topic.place < last)) for name, topic in topics.items()}
    return {name: topic for name, topic in cut.items() if topic.place.size}


def fields_of(source: Source) -> dict[str, tuple[NDArray[np.int64], Array, dict[str, Array]]]:
    """Every number of every topic whose type is known: places, times on the bag's clock [s], values by their fields.

    Raises:
        FlightError: where rosbags is not installed, or the bag cannot be opened.
    """
    topics, _, begin, _ = _received(source, every=True)
    return {name.strip("/"): (one.place, one.time + begin * 1e-9, dict(one.numbers)) for name, one in topics.items()}


def _received(
    source: Source, *, every: bool = False
) -> tuple[dict[str, _Topic], dict[tuple[str, str], int], int, list[str]]:
    """Messages by topic, their number by topic and type, first stamp [ns], damage."""
    library("rosbags", what="a ROS bag", where=source.name)
    topics: dict[str, _Topic] = {}
    counts: dict[tuple[str, str], int] = {}
    begin, damage = 0, list[str]()
    with scratch_folder() if source.path.is_dir() else nullcontext() as scratch:
        for head, content in foreign.frames("rosbag", source.path, size=source.size, scratch=scratch, every=every):
            if "topic" in head:
                table = np.frombuffer(content).reshape(-1, 2 + len(head["names"]))
                numbers = {name: table[:, 2 + k].copy() for k, name in enumerate(head["names"])}
                topics[head["topic"]] = _Topic(table[:, 0].astype(np.int64), table[:, 1].copy(), numbers)
            elif head:
                counts = {(topic, kind): n for topic, kind, n in head["counts"]}
                begin, damage = head["begin"], head["damage"]
    return topics, counts, begin, damage


def _columns(numbers: Mapping[str, Array], topic: str, *, body: Array, world: Array) -> dict[str, tuple[Array, str]]:
    """Channels with their units in FRD and NED from a topic's numbers, NaN where a message lacks one."""
    raw = dict(numbers)
    columns: dict[str, tuple[Array, str]] = {}
    for prefix, channels, unit, turn in _vectors(body, world):
        parts = [raw.pop(f"{prefix}{axis}", None) for axis in "xyz"]
        if all(part is not None for part in parts):
            turned = frames.to_local(np.stack([p for p in parts if p is not None], axis=-1), turn)
            columns |= {channel: (values, unit) for channel, values in zip(channels, turned.T, strict=True)}
    if all(name in raw for name in QUATERNION):
        q = np.stack([raw.pop(name) for name in QUATERNION], axis=-1)
        if np.any(q != 0.0):
            attitude = frames.attitude(q, world=world, body=body)
            columns |= {name: (values, "1") for name, values in zip(QUATERNION, attitude.T, strict=True)}
    for name, values in raw.items():
        family = name.partition("_")[0]
        channel = name.replace("value", topic, 1) if family == "value" else name
        if family not in ("rcin", "rcout") or np.any(values > 0.0):
            columns[channel] = (values, _UNITS.get(family, ""))
    return columns


def _vectors(body: Array, world: Array) -> Iterator[tuple[str, tuple[str, str, str], str, Array]]:
    yield "position_", ("x", "y", "z"), "m", world
    yield "velocity_", ("u", "v", "w"), "m/s", body
    yield "rate_", ("p", "q", "r"), "rad/s", body
    yield "force_", ("ax", "ay", "az"), "m/s^2", body
