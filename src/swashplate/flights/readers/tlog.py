"""Telemetry logs of ground stations (`.tlog`): eight bytes of time before each MAVLink frame, version 1 or 2.

The messages are those of pymavlink's dialect, as for a running autopilot (`links/mavlink`; needs the extra `link`). A
ground station gets what the radio lets through, a few samples a second: enough to look at, too slow for a fit, which
the flight's notes say. Times are the autopilot's own where a message has one; the others are those of reception, on the
autopilot's clock.

Source: MAVLink's description of its frames and checksum (mavlink.io); the time is big-endian microseconds since 1970.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.extras import library
from swashplate.flights.flight import Flight
from swashplate.flights.provenance import Event
from swashplate.flights.readers import clocked
from swashplate.flights.readers.ardupilot_events import is_firmware, mode_name
from swashplate.flights.readers.options import Options, refuse_mapping
from swashplate.flights.readers.source import Source

NAME = "tlog"
VERSION = "1"
NAMES_UNITS = True

_ONE, _TWO = 0xFE, 0xFD
_STAMP, _CHAIN = 8, 4
_LATEST = 4_102_444_800_000_000  # us, the year 2100
_JUMP = 86_400_000_000  # us between two neighbours of one log
_STATION = frozenset((6, 18, 26, 27, 30))  # MAV_TYPE of ground stations, companions, gimbals, beacons, cameras
_NOBODY = 8  # MAV_AUTOPILOT_INVALID
_ARMED = 128  # of the base mode
_FIRMWARES: Mapping[int, str] = {
    1: "ArduPlane", 5: "AntennaTracker", 10: "ArduRover", 11: "ArduRover", 12: "ArduSub",
    **dict.fromkeys((2, 3, 4, 13, 14, 15, 29, 35), "ArduCopter"), **dict.fromkeys(range(19, 26), "ArduPlane"),
}  # fmt: skip
"""ArduPilot's firmware by MAV_TYPE, which says whose modes are counted."""
_PX4 = {1: "MANUAL", 2: "ALTCTL", 3: "POSCTL", 4: "AUTO", 5: "ACRO", 6: "OFFBOARD", 7: "STABILIZED", 8: "RATTITUDE"}
_PX4_AUTO = {1: "READY", 2: "TAKEOFF", 3: "LOITER", 4: "MISSION", 5: "RTL", 6: "LAND", 8: "FOLLOW", 9: "PRECLAND"}
_G, _INERTIAL = 9.80665e-3, ("xgyro", "ygyro", "zgyro", "xacc", "yacc", "zacc")
_Fields = Mapping[str, tuple[str, str, float]]


def _inertial(gyro: float, force: float, suffix: str) -> _Fields:
    names = [f"{name}{suffix}" for name in ("p", "q", "r", "ax", "ay", "az")]
    units = [("rad/s", gyro)] * 3 + [("m/s^2", force)] * 3
    return {f: (name, *unit) for f, name, unit in zip(_INERTIAL, names, units, strict=True)}


# message -> (stream, field -> (channel, unit, factor)); what an earlier message gave is left out.
_MESSAGES: Mapping[str, tuple[str, _Fields]] = {
    "ATTITUDE": ("attitude", {
        "roll": ("phi", "rad", 1.0), "pitch": ("theta", "rad", 1.0), "yaw": ("psi", "rad", 1.0),
        "rollspeed": ("p", "rad/s", 1.0), "pitchspeed": ("q", "rad/s", 1.0), "yawspeed": ("r", "rad/s", 1.0),
    }),
    "ATTITUDE_TARGET": ("attitude_demand", {
        "body_roll_rate": ("p_demand", "rad/s", 1.0), "body_pitch_rate": ("q_demand", "rad/s", 1.0),
        "body_yaw_rate": ("r_demand", "rad/s", 1.0),
    }),
    "NAV_CONTROLLER_OUTPUT": ("navigation", {
        "nav_roll": ("phi_demand", "deg", 1.0), "nav_pitch": ("theta_demand", "deg", 1.0),
    }),
    "LOCAL_POSITION_NED": ("position", {
        "x": ("x", "m", 1.0), "y": ("y", "m", 1.0), "z": ("z", "m", 1.0),
        "vx": ("vx", "m/s", 1.0), "vy": ("vy", "m/s", 1.0), "vz": ("vz", "m/s", 1.0),
    }),
    "HIGHRES_IMU": ("inertial", _inertial(1.0, 1.0, "_imu")),
    "RAW_IMU": ("inertial", _inertial(1e-3, _G, "_imu")),  # ArduPilot sends scaled numbers in it; PX4 does not send it
    "SCALED_IMU2": ("inertial_2", _inertial(1e-3, _G, "_imu2")),
    "SCALED_IMU3": ("inertial_3", _inertial(1e-3, _G, "_imu3")),
    "GPS_RAW_INT": ("gps", {
        "lat": ("latitude", "deg", 1e-7), "lon": ("longitude", "deg", 1e-7), "vel": ("gps_speed", "m/s", 1e-2),
        "fix_type": ("gps_status", "1", 1.0), "satellites_visible": ("gps_satellites", "1", 1.0),
        "eph": ("gps_hdop", "1", 1e-2),
    }),
    "RC_CHANNELS": ("received", {f"chan{i}_raw": (f"rcin_{i}", "us", 1.0) for i in range(1, 17)}),
    "RC_CHANNELS_RAW": ("received", {f"chan{i}_raw": (f"rcin_{i}", "us", 1.0) for i in range(1, 9)}),
    "SERVO_OUTPUT_RAW": ("sent", {f"servo{i}_raw": (f"rcout_{i}", "us", 1.0) for i in range(1, 17)}),
    "VFR_HUD": ("airspeed", {"airspeed": ("airspeed", "m/s", 1.0)}),
    "VIBRATION": ("vibration", {
        **{f"vibration_{axis}": (f"vibe_{axis}", "m/s^2", 1.0) for axis in "xyz"},
        **{f"clipping_{k}": (f"clips{f'_{k + 1}' * bool(k)}", "1", 1.0) for k in range(3)},
    }),
    "RPM": ("rotor", {"rpm1": ("omega_rotor", "rpm", 1.0)}),
    "POWER_STATUS": ("supply", {"Vcc": ("voltage_board", "V", 1e-3)}),
    "SYS_STATUS": ("battery", {"voltage_battery": ("voltage", "V", 1e-3), "current_battery": ("current", "A", 1e-2)}),
}  # fmt: skip
_NONE = {"current_battery": -1, "eph": 65_535, "vel": 65_535}
"""What says that there is no such number."""
_TOLD = ("HEARTBEAT", "STATUSTEXT", "PARAM_VALUE")


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


def recognises(source: Source) -> bool:
    """Whether some frames follow each other, each behind a time that goes on."""
    end, before, seen = 0, 0, 0
    while seen < _CHAIN and (frame := _frame_at(source.content, end)) is not None:
        stamp, end = frame[0], frame[1]
        if seen and abs(stamp - before) > _JUMP:
            return False
        before, seen = stamp, seen + 1
    return seen == _CHAIN or (seen > 0 and end == len(source.content))


def read(source: Source, options: Options) -> Flight:
    """A telemetry log as a flight: one stream a message; parameters, modes and messages in the provenance.

    Raises:
        FlightError: where nothing in the log can be used, or a mapping is given.
        MissingLibraryError: where pymavlink is not installed.
    """
    refuse_mapping(options, "a telemetry log", where=source.name)
    tables, told, late = _tables(source)
    streams: dict[str, xr.Dataset] = {}
    taken: set[str] = set()
    for name, (stream_name, fields) in _MESSAGES.items():
        table = tables.get(name)
        if table is None or stream_name in streams:
            continue
        columns = {
            channel: (_numbers(table.columns[field], field) * factor, unit)
            for field, (channel, unit, factor) in fields.items()
            if field in table.columns and channel not in taken and not _dead(channel, table.columns[field])
        }
        made = clocked.made_stream(stream_name, table.time, columns, told=told)
        if made is not None:
            streams[stream_name] = made
            taken |= set(map(str, made.data_vars))
    if not streams:
        raise FlightError(
            f"holds no flight: no known message has two samples ({', '.join(sorted(tables)) or 'none'} found).",
            where=source.name,
            hint="Was the autopilot connected? Its own log (.bin, .ulg) tells more.",
        )
    kind, firmware = _vehicle(tables)
    parameters = _parameters(tables.get("PARAM_VALUE"))
    if kind is not None:
        parameters["MAV_TYPE"] = float(kind)
    rate = _rate(streams)
    told.notes += [
        f"telemetry, {rate:.3g} samples a second of the fastest message: good to look at, too slow for a fit. The "
        "autopilot's own log has the rates",
        *late,
        *clocked.unread({n: len(t.place) for n, t in tables.items()}, (*_TOLD, *_MESSAGES)),
    ]
    events = (*_modes(tables.get("HEARTBEAT"), firmware), *_texts(tables.get("STATUSTEXT")))
    provenance = source.provenance(
        NAME,
        VERSION,
        vehicle=firmware,
        firmware=firmware,
        notes=tuple(told.notes),
        damage=tuple(told.damage),
        parameters=parameters,
        events=tuple(sorted(events, key=lambda event: event.time)),
    )
    return Flight(streams, provenance)


def tables_of(source: Source) -> Mapping[str, TelemetryTable]:
    """All messages of the vehicle in a telemetry log, by name."""
    return _tables(source)[0]


def number_columns(table: TelemetryTable) -> dict[str, NDArray[Any]]:
    """Its fields that are a number a message, without its times."""
    return {
        name: values
        for name, values in table.columns.items()
        if values.ndim == 1 and values.dtype.kind in "fiu" and name not in ("time_boot_ms", "time_usec")
    }


# ---- frames ----------------------------------------------------------------------------------------------------------
def _frame_at(content: bytes, at: int) -> tuple[int, int, int, int, int, int] | None:
    """Time [us], end, payload's place and length, message and sender of the frame at a place; None where none is."""
    magic_at = at + _STAMP
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
        frame = _frame_at(content, at)
        if frame is None or not (frame[1] == size or _frame_at(content, frame[1]) is not None):
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
    begin, end = frames.place[chosen] + _STAMP + 1, frames.header[chosen] + frames.length[chosen]
    for size in np.unique(end - begin):
        alike = np.flatnonzero(end - begin == size)
        bytes_ = content[begin[alike][:, None] + np.arange(size)]
        crc = np.full(alike.size, 0xFFFF, dtype=np.uint16)
        for column in (*bytes_.T, np.full(alike.size, extra, dtype=np.uint8)):
            crc = (crc >> 8) ^ table[(crc ^ column) & 0xFF]
        sent = content[end[alike]].astype(np.uint16) | content[end[alike] + 1].astype(np.uint16) << 8
        sound[alike] = crc == sent
    return sound


def _tables(source: Source) -> tuple[dict[str, TelemetryTable], clocked.Remarks, list[str]]:
    """Messages of the vehicle in the longest run of its clock, what is lost, and how late they came, in words."""
    dialect = library("pymavlink.dialects.v20.ardupilotmega", what="a telemetry log (.tlog)", where=source.path)
    content, frames, told = np.frombuffer(source.content, np.uint8), _frames(source.content), clocked.Remarks()
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
            own = chosen[frames.sender[chosen] == sender]
            columns = _columns(content, frames, own, message)
            raw.setdefault(sender, {})[message.msgname] = (own, columns, dict(message.fieldunits_by_name))
    if frames.lost:
        told.damage.append(f"{clocked.share(frames.lost, len(source.content), 'bytes')} belong to no frame")
    if broken:
        told.damage.append(f"{clocked.share(broken, frames.kind.size, 'frames')} have a wrong checksum and are lost")
    sender = _flown(raw)
    if sender is None:
        return {}, told, []
    return _timed(raw[sender], frames, told)


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
    whole = np.zeros((chosen.size, form.itemsize), dtype=np.uint8)
    length, header = np.minimum(frames.length[chosen], form.itemsize), frames.header[chosen]
    for size in np.unique(length).tolist():
        alike = length == size
        whole[alike, :size] = content[header[alike][:, None] + np.arange(size)]
    table = whole.view(form)[:, 0] if chosen.size else np.zeros(0, form)
    return {name: table[name] for name in form.names or ()}


_NUMPY = {"<b": "i1", "<B": "u1", "<h": "<i2", "<H": "<u2", "<i": "<i4", "<I": "<u4", "<q": "<i8", "<Q": "<u8",
          "<f": "<f4", "<d": "<f8"}  # fmt: skip


def _flown(raw: Mapping[int, Mapping[str, Any]]) -> int | None:
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
    told: clocked.Remarks,
) -> tuple[dict[str, TelemetryTable], clocked.Remarks, list[str]]:
    """The messages of the longest run, on the autopilot's clock, and in words how late they came."""
    own = {name: columns["time_boot_ms"] / 1e3 for name, (_, columns, _) in raw.items() if "time_boot_ms" in columns}
    received = {name: frames.stamp[at] / 1e6 for name, (at, *_) in raw.items()}
    stamped = own or received
    place = np.concatenate([frames.place[raw[name][0]] for name in stamped])
    boot, came = (np.concatenate([times[name] for name in stamped]) for times in (stamped, received))
    order = np.argsort(place)
    place, boot, came = place[order], boot[order], came[order]
    (first, last), lost = clocked.longest_run([(place, boot)])
    told.damage += [lost] if lost else []
    inside = (place >= first) & (place < last)
    boot, came = boot[inside], came[inside]
    if not boot.size:
        return {}, told, []
    offset = float(np.quantile(came - boot, 0.01)) if own else float(came.min())
    zero = 0.0 if own else offset
    tables = {}
    for name, (at, columns, units) in raw.items():
        kept = (frames.place[at] >= first) & (frames.place[at] < last)
        time = received[name] - offset
        if name in own:
            time = own[name] - zero
        elif "time_usec" in columns:  # since the start, or since 1970: only the first is this clock
            micro = columns["time_usec"] / 1e6
            good = np.abs(micro - time) < 60.0
            time = micro if own and good.all() else time
        tables[name] = TelemetryTable(
            frames.place[at][kept], time[kept], {k: v[kept] for k, v in columns.items()}, units
        )
    late = np.quantile(came - boot - offset, 0.95) if own else 0.0
    words = f"what has no time of its own is stamped where it came in: up to {1e3 * late:.0f} ms later (95 %)"
    return {name: t for name, t in tables.items() if t.place.size}, told, [words] if own else []


# ---- what it says ----------------------------------------------------------------------------------------------------
def _numbers(values: NDArray[Any], field: str) -> Array:
    numbers = np.asarray(values, dtype=np.float64)
    return np.where(numbers == _NONE[field], np.nan, numbers) if field in _NONE else numbers


def _dead(channel: str, values: NDArray[Any]) -> bool:
    """Whether nothing is connected to a channel, or a number is never there."""
    pulse = channel.startswith(("rcin", "rcout"))
    return bool(pulse and (not values.any() or (values == 65_535).all())) or values.ndim > 1


def _rate(streams: Mapping[str, xr.Dataset]) -> float:
    return max(1.0 / float(np.median(np.diff(data["time"].values))) for data in streams.values())


def _text(value: bytes) -> str:
    return value.split(b"\0")[0].decode("utf-8", "replace").strip()


def _vehicle(tables: Mapping[str, TelemetryTable]) -> tuple[int | None, str]:
    """MAV_TYPE, and the firmware as a message says it, or as its kind is called; "" where none is known."""
    beats, texts = tables.get("HEARTBEAT"), tables.get("STATUSTEXT")
    if beats is None:
        return None, ""
    kind, autopilot = int(beats.columns["type"][0]), int(beats.columns["autopilot"][0])
    said = [] if texts is None else [_text(value) for value in texts.columns["text"].tolist()]
    firmware = {3: _FIRMWARES.get(kind, ""), 12: "PX4"}.get(autopilot, "")
    return kind, next(filter(is_firmware, said), firmware)


def _parameters(table: TelemetryTable | None) -> dict[str, float]:
    """As they were first told; PX4 sends the bytes of whole numbers, which are left out."""
    told: dict[str, float] = {}
    if table is None:
        return told
    columns = table.columns
    rows = zip(columns["param_id"].tolist(), columns["param_value"].tolist(), strict=True)
    for name, value in rows:
        text = _text(name)
        if re.fullmatch(r"\w+", text) and math.isfinite(value) and not 0.0 < abs(value) < 1e-37:
            told.setdefault(text, float(value))
    return told


def _modes(table: TelemetryTable | None, firmware: str) -> Iterator[Event]:
    if table is None:
        return
    before: tuple[int | None, bool] = (None, False)
    rows = zip(*(table.columns[name].tolist() for name in ("custom_mode", "base_mode")), strict=True)
    for time, (mode, base) in zip(table.time.tolist(), rows, strict=True):
        armed = bool(base & _ARMED)
        if mode != before[0]:
            yield Event(time, "mode", _mode(mode, firmware), {"number": mode})
        if armed != before[1]:
            yield Event(time, "armed" if armed else "disarmed", "armed" if armed else "disarmed")
        before = (mode, armed)


def _mode(number: int, firmware: str) -> str:
    if firmware.startswith("PX4"):
        main, sub = number >> 16 & 0xFF, number >> 24
        name = _PX4.get(main, f"mode {main}")
        return f"{name} {_PX4_AUTO.get(sub, sub)}" if main == 4 and sub else name
    return mode_name(firmware if is_firmware(firmware) else f"{firmware} V0", number)


def _texts(table: TelemetryTable | None) -> Iterator[Event]:
    if table is not None:
        for time, value in zip(table.time.tolist(), table.columns["text"].tolist(), strict=True):
            if text := _text(value):
                yield Event(time, "message", text)
