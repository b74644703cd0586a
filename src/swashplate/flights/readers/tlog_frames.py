"""Frames of a telemetry log (`.tlog`), and the tables of their messages on the autopilot's clock.

Eight bytes of time, then a MAVLink frame of version 1 or 2. Source: MAVLink's description of its frames and checksum
(mavlink.io); the time is big-endian microseconds since 1970.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.extras import library
from swashplate.flights.readers import clocked
from swashplate.flights.readers.source import Source

STAMP = 8
"""Bytes of time before a frame."""
_ONE, _TWO = 0xFE, 0xFD
_LATEST = 4_102_444_800_000_000  # us, the year 2100
_STATION = frozenset((6, 18, 26, 27, 30))  # MAV_TYPE of ground stations, companions, gimbals, beacons, cameras
_NOBODY = 8  # MAV_AUTOPILOT_INVALID


class _Frames(NamedTuple):
    """Frames of a log, in order: places and numbers, shape (n,), and bytes that belong to none."""

    place: NDArray[np.int64]
    stamp: NDArray[np.int64]
    header: NDArray[np.int64]
    length: NDArray[np.int64]
    kind: NDArray[np.int64]
    sender: NDArray[np.int64]
    lost: int


@dataclass(frozen=True)
class TelemetryTable:
    """The messages of one kind: places, times [s] and columns, shape (n,) or (n, k); texts are bytes."""

    place: NDArray[np.int64]
    time: Array
    columns: Mapping[str, NDArray[Any]]
    units: Mapping[str, str]


def frame_at(content: bytes, at: int) -> tuple[int, int, int, int, int, int] | None:
    """Time [us], end, payload's place and length, message and sender of the frame at a place; None where none is."""
    magic_at = at + STAMP
    if magic_at + 10 > len(content):
        return None
    magic, length = content[magic_at], content[magic_at + 1]
    stamp = int.from_bytes(content[at:magic_at], "big")
    if stamp > _LATEST:
        return None
    if magic == _ONE:
        header, end, kind, sender = magic_at + 6, magic_at + 8 + length, content[magic_at + 5], magic_at + 3
    elif magic == _TWO:
        signed = content[magic_at + 2]
        header, end = magic_at + 10, magic_at + 12 + length + 13 * (signed & 1)
        kind, sender = int.from_bytes(content[magic_at + 7 : magic_at + 10], "little"), magic_at + 5
    else:
        return None
    if end > len(content):
        return None
    return stamp, end, header, length, kind, content[sender] << 8 | content[sender + 1]


def _frames(content: bytes) -> _Frames:
    rows, at, lost, size = list[tuple[int, int, int, int, int, int]](), 0, 0, len(content)
    while at < size:
        frame = frame_at(content, at)
        if frame is None or not (frame[1] == size or frame_at(content, frame[1]) is not None):
            lost += 1
            at += 1
            continue
        stamp, end, header, length, kind, sender = frame
        rows.append((at, stamp, header, length, kind, sender))
        at = end
    place, when, begin, sizes, kinds, senders = np.array(rows, dtype=np.int64).reshape(-1, 6).T
    return _Frames(place, when, begin, sizes, kinds, senders, lost)


@cache
def _steps() -> NDArray[np.uint16]:
    """CRC-16/MCRF4XX by byte, as MAVLink's frames have it."""
    table = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        table = np.where(table & 1, (table >> 1) ^ 0x8408, table >> 1).astype(np.uint16)
    return table


def _sound(content: NDArray[np.uint8], frames: _Frames, chosen: NDArray[np.int64], extra: int) -> NDArray[np.bool_]:
    """Which of some frames of one kind hold the bytes that were sent."""
    sound, table = np.zeros(chosen.size, dtype=np.bool_), _steps()
    begin, end = frames.place[chosen] + STAMP + 1, frames.header[chosen] + frames.length[chosen]
    for size in np.unique(end - begin):
        alike = np.flatnonzero(end - begin == size)
        bytes_ = content[begin[alike][:, None] + np.arange(size)]
        crc = np.full(alike.size, 0xFFFF, dtype=np.uint16)
        for column in (*bytes_.T, np.full(alike.size, extra, dtype=np.uint8)):
            crc = (crc >> 8) ^ table[(crc ^ column) & 0xFF]
        sent = content[end[alike]].astype(np.uint16) | content[end[alike] + 1].astype(np.uint16) << 8
        sound[alike] = crc == sent
    return sound


def message_tables(source: Source) -> tuple[dict[str, TelemetryTable], clocked.Remarks, list[str]]:
    """Messages of the vehicle in the longest run of its clock, what is lost, and how late they came, in words."""
    dialect = library("pymavlink.dialects.v20.ardupilotmega", what="a telemetry log (.tlog)", where=source.path)
    content, frames, remarks = np.frombuffer(source.content, np.uint8), _frames(source.content), clocked.Remarks()
    raw: dict[int, dict[str, tuple[NDArray[np.int64], dict[str, NDArray[Any]], Mapping[str, str]]]] = {}
    broken = 0
    for kind in np.unique(frames.kind).tolist():
        message = dialect.mavlink_map.get(kind)
        if message is None:
            continue
        chosen = np.flatnonzero(frames.kind == kind)
        sound = _sound(content, frames, chosen, message.crc_extra)
        broken += int(chosen.size - sound.sum())
        chosen = chosen[sound]
        for sender in np.unique(frames.sender[chosen]).tolist():
            of_sender = chosen[frames.sender[chosen] == sender]
            columns = _columns(content, frames, of_sender, message)
            raw.setdefault(sender, {})[message.msgname] = (of_sender, columns, dict(message.fieldunits_by_name))
    if frames.lost:
        remarks.damage.append(f"{clocked.share(frames.lost, len(source.content), 'bytes')} belong to no frame")
    if broken:
        remarks.damage.append(f"{clocked.share(broken, frames.kind.size, 'frames')} have a wrong checksum and are lost")
    sender = _flying_system(raw)
    if sender is None:
        return {}, remarks, []
    return _timed(raw[sender], frames, remarks)


def _columns(
    content: NDArray[np.uint8], frames: _Frames, chosen: NDArray[np.int64], message: Any
) -> dict[str, NDArray[Any]]:
    """Fields of frames of one kind; what a frame of version 2 leaves out at its end is zero."""
    letters = re.findall(r"(\d*)([a-zA-Z])", message.unpacker.format)
    fields = [
        (name, f"S{count or 1}" if letter == "s" else f"<{letter if letter != 'c' else 'S1'}", (int(count),))
        if count and letter != "s"
        else (name, f"S{count or 1}" if letter in "sc" else f"<{letter}")
        for name, (count, letter) in zip(message.ordered_fieldnames, letters, strict=True)
    ]
    form = np.dtype([(f[0], _NUMPY.get(f[1], f[1]), *f[2:]) for f in fields])
    padded = np.zeros((chosen.size, form.itemsize), dtype=np.uint8)
    length, header = np.minimum(frames.length[chosen], form.itemsize), frames.header[chosen]
    for size in np.unique(length).tolist():
        alike = length == size
        padded[alike, :size] = content[header[alike][:, None] + np.arange(size)]
    table = padded.view(form)[:, 0] if chosen.size else np.zeros(0, form)
    return {name: table[name] for name in form.names or ()}


_NUMPY = {"<b": "i1", "<B": "u1", "<h": "<i2", "<H": "<u2", "<i": "<i4", "<I": "<u4", "<q": "<i8", "<Q": "<u8",
          "<f": "<f4", "<d": "<f8"}  # fmt: skip


def _flying_system(raw: Mapping[int, Mapping[str, Any]]) -> int | None:
    """The sender that is a vehicle's autopilot and says most; of no heartbeat the one that says most."""

    def said(sender: int) -> int:
        return sum(places.size for places, *_ in raw[sender].values())

    flying = []
    for sender, messages in raw.items():
        if "HEARTBEAT" in messages:
            beats = messages["HEARTBEAT"][1]
            if int(beats["type"][0]) not in _STATION and int(beats["autopilot"][0]) != _NOBODY:
                flying.append(sender)
    return max(flying or raw, key=said, default=None)


def _timed(
    raw: Mapping[str, tuple[NDArray[np.int64], dict[str, NDArray[Any]], Mapping[str, str]]],
    frames: _Frames,
    remarks: clocked.Remarks,
) -> tuple[dict[str, TelemetryTable], clocked.Remarks, list[str]]:
    """The messages of the longest run, on the autopilot's clock, and in words how late they came."""
    timed = {name: columns["time_boot_ms"] / 1e3 for name, (_, columns, _) in raw.items() if "time_boot_ms" in columns}
    received = {name: frames.stamp[at] / 1e6 for name, (at, *_) in raw.items()}
    stamped = timed or received
    place = np.concatenate([frames.place[raw[name][0]] for name in stamped])
    boot, came = (np.concatenate([times[name] for name in stamped]) for times in (stamped, received))
    order = np.argsort(place)
    place, boot, came = place[order], boot[order], came[order]
    (first, last), lost = clocked.longest_run([(place, boot)])
    remarks.damage += [lost] if lost else []
    inside = (place >= first) & (place < last)
    boot, came = boot[inside], came[inside]
    if not boot.size:
        return {}, remarks, []
    offset = float(np.quantile(came - boot, 0.01)) if timed else float(came.min())
    zero = 0.0 if timed else offset
    tables = {}
    for name, (at, columns, units) in raw.items():
        kept = (frames.place[at] >= first) & (frames.place[at] < last)
        time = received[name] - offset
        if name in timed:
            time = timed[name] - zero
        elif "time_usec" in columns:  # since the start, or since 1970: only the first is this clock
            micro = columns["time_usec"] / 1e6
            good = np.abs(micro - time) < 60.0
            time = micro if timed and good.all() else time
        tables[name] = TelemetryTable(
            frames.place[at][kept], time[kept], {k: v[kept] for k, v in columns.items()}, units
        )
    delay = np.quantile(came - boot - offset, 0.95) if timed else 0.0
    note = f"what has no time of its own is stamped where it came in: up to {1e3 * delay:.0f} ms later (95 %)"
    return {name: t for name, t in tables.items() if t.place.size}, remarks, [note] if timed else []
