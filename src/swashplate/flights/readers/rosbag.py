"""ROS bags: rosbag1 (`.bag`) and rosbag2 (a folder with metadata.yaml, or one `.db3` or `.mcap`), decoded by `rosbags`.

Each topic of a known message type becomes a stream, stamped by its header, counted from the bag's first message. ROS
has x forward, y left, z up on board and x east, y north, z up in the world (REP 103); another world or body is said by
`world_axes` and `body_axes`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.extras import library
from swashplate.flights.flight import Flight
from swashplate.flights.readers import clocked, frames
from swashplate.flights.readers.options import Options, with_mocap_table
from swashplate.flights.readers.source import Source
from swashplate.flights.schema import QUATERNION

NAME = "rosbag"
VERSION = "1"
NAMES_UNITS = True

Row = dict[str, float]

_BODY, _WORLD = "forward-left-up", "east-north-up"
_MAGIC = (b"#ROSBAG V", b"\x89MCAP0\r\n", b"SQLite format 3\0")


def recognises(source: Source) -> bool:
    """A rosbag's magic bytes, or a folder with rosbag2's metadata."""
    return source.path.is_dir() or source.content.startswith(_MAGIC)


def _vector(prefix: str, v: Any) -> Row:
    return {f"{prefix}{axis}": float(getattr(v, axis)) for axis in "xyz"}


def _turn(q: Any) -> Row:
    return {f"q{axis}": float(getattr(q, axis)) for axis in "wxyz"}


def _imu(m: Any) -> Row:
    row = {**_vector("rate_", m.angular_velocity), **_vector("force_", m.linear_acceleration)}
    absent = len(m.orientation_covariance) and m.orientation_covariance[0] == -1.0
    return row if absent else {**row, **_turn(m.orientation)}


def _pose(m: Any) -> Row:
    pose = getattr(m.pose, "pose", m.pose)
    return {**_vector("position_", pose.position), **_turn(pose.orientation)}


def _odometry(m: Any) -> Row:
    twist = m.twist.twist
    return {**_pose(m), **_vector("velocity_", twist.linear), **_vector("rate_", twist.angular)}


def _transform(m: Any) -> Row:
    return {**_vector("position_", m.transform.translation), **_turn(m.transform.rotation)}


def _listed(name: str, values: Any, start: int = 1) -> Row:
    return {f"{name}_{i}": float(value) for i, value in enumerate(values, start)}


_MIXER = ("mixer_roll", "mixer_pitch", "mixer_yaw", "mixer_collective")
# message type -> its numbers by (vector) channel; "value" takes the topic's name.
_TYPES: Mapping[str, Callable[[Any], Row]] = {
    "sensor_msgs/msg/Imu": _imu,
    "geometry_msgs/msg/PoseStamped": _pose,
    "geometry_msgs/msg/PoseWithCovarianceStamped": _pose,
    "geometry_msgs/msg/TransformStamped": _transform,
    "nav_msgs/msg/Odometry": _odometry,
    "sensor_msgs/msg/Joy": lambda m: _listed("stick", m.axes),
    "sensor_msgs/msg/BatteryState": lambda m: {"voltage": float(m.voltage), "current": float(m.current)},
    "mavros_msgs/msg/RCIn": lambda m: _listed("rcin", m.channels),
    "mavros_msgs/msg/RCOut": lambda m: _listed("rcout", m.channels),
    "mavros_msgs/msg/ActuatorControl": lambda m: dict(zip(_MIXER, map(float, m.controls), strict=False)),
    "std_msgs/msg/Float32": lambda m: {"value": float(m.data)},
    "std_msgs/msg/Float64": lambda m: {"value": float(m.data)},
    "std_msgs/msg/Float32MultiArray": lambda m: _listed("value", m.data),
    "std_msgs/msg/Float64MultiArray": lambda m: _listed("value", m.data),
}
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
    stamps, rows, counts, begin, damage = _collected(source)
    told = clocked.Remarks(damage=damage)
    times, rows = _one_run(stamps, rows, told)
    streams: dict[str, xr.Dataset] = {}
    taken: set[str] = set()
    for topic, received in rows.items():
        name = re.sub(r"\W+", "_", topic.strip("/")) or "topic"
        columns = _columns(received, name, body=body, world=world)
        named = {c if c not in taken else f"{c}_{name}": value for c, value in columns.items()}
        made = clocked.made_stream(name, times[topic], named, told=told)
        if made is not None and name not in streams:
            streams[name] = made
            taken |= set(map(str, made.data_vars))
    if not streams:
        listed = ", ".join(f"{topic} ({kind})" for topic, kind in counts) or "none"
        raise FlightError(
            f"holds no flight: no topic of a known type has two messages; its topics are {listed}.",
            where=source.name,
            hint="Record poses, odometry, inertial sensors, sticks or servo commands.",
        )
    by_topic = {f"{topic} [{kind}]": n for (topic, kind), n in counts.items()}
    told.notes += clocked.unread(by_topic, [f"{topic} [{kind}]" for topic, kind in counts if kind in _TYPES])
    said = source.provenance(NAME, VERSION, notes=tuple(told.notes), damage=tuple(told.damage), epoch=begin * 1e-9)
    return Flight(streams, said)


Stamps = dict[str, list[tuple[int, float]]]
"""By topic: place in the bag and stamp [s from the first message] of each message."""
Collected = tuple[Stamps, dict[str, list[Row]], dict[tuple[str, str], int], int, list[str]]


def _one_run(
    stamps: Stamps, rows: dict[str, list[Row]], told: clocked.Remarks
) -> tuple[dict[str, Array], dict[str, list[Row]]]:
    """Stamps [s] and numbers by topic, of the longest run between clock resets; nodes may have clocks of their own."""
    places = {topic: np.array([place for place, _ in pairs], dtype=np.int64) for topic, pairs in stamps.items()}
    times = {topic: np.array([time for _, time in pairs]) for topic, pairs in stamps.items()}
    (first, last), said = clocked.longest_run([(places[topic], times[topic]) for topic in stamps])
    if not said:
        return times, rows
    told.damage.append(said)
    kept = {topic: (place >= first) & (place < last) for topic, place in places.items()}
    cut = {topic: [row for row, keep in zip(rows[topic], kept[topic], strict=True) if keep] for topic in rows}
    return {topic: times[topic][kept[topic]] for topic in rows if cut[topic]}, {t: c for t, c in cut.items() if c}


def _collected(source: Source) -> Collected:
    """Stamps and numbers by topic, messages by topic and type, first stamp [ns], damage."""
    anyreader = library("rosbags.highlevel", what="a ROS bag", where=source.name)
    typesys = library("rosbags.typesys", what="a ROS bag", where=source.name)
    stamps: Stamps = {}
    rows: dict[str, list[Row]] = {}
    counts: dict[tuple[str, str], int] = {}
    damage: list[str] = []
    begin = 0
    try:
        # Bags of older ROS 2 carry no definitions; the messages that are read here have not changed since.
        store = typesys.get_typestore(typesys.Stores.LATEST)
        with anyreader.AnyReader([source.path], default_typestore=store) as bag:
            begin = int(bag.start_time)
            for connection in bag.connections:
                key = (connection.topic, connection.msgtype)
                counts[key] = counts.get(key, 0) + int(connection.msgcount)
            known = [c for c in bag.connections if c.msgtype in _TYPES]
            try:
                for place, (connection, received, raw) in enumerate(bag.messages(known) if known else ()):
                    message = bag.deserialize(raw, connection.msgtype)
                    at = _stamp(message, received)
                    stamps.setdefault(connection.topic, []).append((place, (at - begin) * 1e-9))
                    rows.setdefault(connection.topic, []).append(_TYPES[connection.msgtype](message))
            except Exception as error:  # a damaged bag can raise anything in there
                read_so_far = sum(map(len, rows.values()))
                damage.append(f"the bag is damaged after {read_so_far} messages: {_words(error)}")
    except Exception as error:
        if not rows:
            raise FlightError(
                f"does not open as a ROS bag: {_words(error)}.",
                where=source.name,
                hint="It was perhaps not closed: mend it with `rosbag reindex` (ros2 bag reindex), or copy it again.",
            ) from error
    return stamps, rows, counts, begin, damage


def _words(error: Exception) -> str:
    return (str(error) or type(error).__name__).strip().rstrip(".")


def _stamp(message: Any, received: int) -> int:
    """The header's time [ns], or the time of recording where there is none."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    ns = int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec) if stamp is not None else 0
    return ns or int(received)


def _columns(rows: list[Row], topic: str, *, body: Array, world: Array) -> dict[str, tuple[Array, str]]:
    """Channels with their units in FRD and NED from a topic's numbers, NaN where a message lacks one."""
    names = dict.fromkeys(name for row in rows for name in row)
    raw = {name: np.array([row.get(name, np.nan) for row in rows]) for name in names}
    made: dict[str, tuple[Array, str]] = {}
    for prefix, channels, unit, turn in _vectors(body, world):
        parts = [raw.pop(f"{prefix}{axis}", None) for axis in "xyz"]
        if all(part is not None for part in parts):
            turned = frames.to_local(np.stack([p for p in parts if p is not None], axis=-1), turn)
            made |= {channel: (values, unit) for channel, values in zip(channels, turned.T, strict=True)}
    if all(name in raw for name in QUATERNION):
        q = np.stack([raw.pop(name) for name in QUATERNION], axis=-1)
        if np.any(q != 0.0):
            attitude = frames.attitude(q, world=world, body=body)
            made |= {name: (values, "1") for name, values in zip(QUATERNION, attitude.T, strict=True)}
    for name, values in raw.items():
        family = name.partition("_")[0]
        channel = name.replace("value", topic, 1) if family == "value" else name
        if family not in ("rcin", "rcout") or np.any(values > 0.0):
            made[channel] = (values, _UNITS.get(family, ""))
    return made


def _vectors(body: Array, world: Array) -> Iterator[tuple[str, tuple[str, str, str], str, Array]]:
    yield "position_", ("x", "y", "z"), "m", world
    yield "velocity_", ("u", "v", "w"), "m/s", body
    yield "rate_", ("p", "q", "r"), "rad/s", body
    yield "force_", ("ax", "ay", "az"), "m/s^2", body
