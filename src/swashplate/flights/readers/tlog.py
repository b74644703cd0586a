"""Telemetry logs of ground stations (`.tlog`): eight bytes of time before each MAVLink frame, version 1 or 2.

The messages are those of pymavlink's dialect, as for a running autopilot (`links/mavlink`; needs the extra `link`). A
ground station gets what the radio lets through, a few samples a second: enough to look at, too slow for a fit, which
the flight's notes say. Times are the autopilot's own where a message has one; the others are those of reception, on the
autopilot's clock.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.flights.provenance import Event
from swashplate.flights.readers import clocked
from swashplate.flights.readers.ardupilot_events import is_firmware, mode_name
from swashplate.flights.readers.options import Options, refuse_mapping
from swashplate.flights.readers.source import Source
from swashplate.flights.readers.tlog_frames import TelemetryTable, frame_at, message_tables

NAME = "tlog"
VERSION = "1"
NAMES_UNITS = True

_CHAIN = 4
_JUMP = 86_400_000_000  # us between two neighbours of one log
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


def recognises(source: Source) -> bool:
    """Whether some frames follow each other, each behind a time that goes on."""
    end, before, count = 0, 0, 0
    while count < _CHAIN and (frame := frame_at(source.content, end)) is not None:
        stamp, end = frame[0], frame[1]
        if count and abs(stamp - before) > _JUMP:
            return False
        before, count = stamp, count + 1
    return count == _CHAIN or (count > 0 and end == len(source.content))


def read(source: Source, options: Options) -> Flight:
    """A telemetry log as a flight: one stream a message; parameters, modes and messages in the provenance.

    Raises:
        FlightError: where nothing in the log can be used, or a mapping is given.
        MissingLibraryError: where pymavlink is not installed.
    """
    refuse_mapping(options, "a telemetry log", where=source.name)
    tables, remarks, delays = message_tables(source)
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
        data = clocked.made_stream(stream_name, table.time, columns, remarks=remarks)
        if data is not None:
            streams[stream_name] = data
            taken |= set(map(str, data.data_vars))
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
    remarks.notes += [
        f"telemetry, {rate:.3g} samples a second of the fastest message: good to look at, too slow for a fit. The "
        "autopilot's own log has the rates",
        *delays,
        *clocked.unread({n: len(t.place) for n, t in tables.items()}, (*_TOLD, *_MESSAGES)),
    ]
    events = (*_modes(tables.get("HEARTBEAT"), firmware), *_texts(tables.get("STATUSTEXT")))
    provenance = source.provenance(
        NAME,
        VERSION,
        vehicle=firmware,
        firmware=firmware,
        notes=tuple(remarks.notes),
        damage=tuple(remarks.damage),
        parameters=parameters,
        events=tuple(sorted(events, key=lambda event: event.time)),
    )
    return Flight(streams, provenance)


def tables_of(source: Source) -> Mapping[str, TelemetryTable]:
    """All messages of the vehicle in a telemetry log, by name."""
    return message_tables(source)[0]


def number_columns(table: TelemetryTable) -> dict[str, NDArray[Any]]:
    """Its fields that are a number a message, without its times."""
    return {
        name: values
        for name, values in table.columns.items()
        if values.ndim == 1 and values.dtype.kind in "fiu" and name not in ("time_boot_ms", "time_usec")
    }


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
    parameters: dict[str, float] = {}
    if table is None:
        return parameters
    columns = table.columns
    rows = zip(columns["param_id"].tolist(), columns["param_value"].tolist(), strict=True)
    for name, value in rows:
        text = _text(name)
        if re.fullmatch(r"\w+", text) and math.isfinite(value) and not 0.0 < abs(value) < 1e-37:
            parameters.setdefault(text, float(value))
    return parameters


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
