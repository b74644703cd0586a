"""The log of early PX4 firmware (`.px4log`, `.bin`): DataFlash messages without time stamps of their own.

A message TIME stands before each group of messages and stamps them all. SI units, radians, FRD and NED as logged.
Source: PX4's description of its sdlog2 messages.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
import xarray as xr

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.flights.provenance import Event
from swashplate.flights.readers import ardupilot, checks, clocked, dataflash
from swashplate.flights.readers.dataflash import Messages, MessageTable
from swashplate.flights.readers.dataflash_index import is_dataflash
from swashplate.flights.readers.options import Options, refuse_mapping
from swashplate.flights.readers.source import Source

NAME = "px4log"
VERSION = "1"
NAMES_UNITS = True

# message -> (stream, field -> (channel, unit)); a quantity that an earlier message gave is left out.
_MESSAGES: Mapping[str, tuple[str, Mapping[str, tuple[str, str]]]] = {
    "ATT": ("attitude", {
        "Roll": ("phi", "rad"), "Pitch": ("theta", "rad"), "Yaw": ("psi", "rad"),
        "RollRate": ("p", "rad/s"), "PitchRate": ("q", "rad/s"), "YawRate": ("r", "rad/s"),
    }),
    "ATTC": ("controls", {
        "Roll": ("mixer_roll", "1"), "Pitch": ("mixer_pitch", "1"), "Yaw": ("mixer_yaw", "1"),
        "Thrust": ("mixer_collective", "1"),
    }),
    "ATSP": ("attitude_demand", {
        "RollSP": ("phi_demand", "rad"), "PitchSP": ("theta_demand", "rad"), "YawSP": ("psi_demand", "rad"),
    }),
    "ARSP": ("rate_demand", {
        "RollRateSP": ("p_demand", "rad/s"), "PitchRateSP": ("q_demand", "rad/s"), "YawRateSP": ("r_demand", "rad/s"),
    }),
    "IMU": ("inertial", {
        "GyroX": ("p_imu", "rad/s"), "GyroY": ("q_imu", "rad/s"), "GyroZ": ("r_imu", "rad/s"),
        "AccX": ("ax", "m/s^2"), "AccY": ("ay", "m/s^2"), "AccZ": ("az", "m/s^2"),
    }),
    "LPOS": ("position", {
        "X": ("x", "m"), "Y": ("y", "m"), "Z": ("z", "m"),
        "VX": ("vx", "m/s"), "VY": ("vy", "m/s"), "VZ": ("vz", "m/s"),
    }),
    "OUT0": ("sent", {f"Out{i}": (f"rcout_{i + 1}", "us") for i in range(8)}),
    "RC": ("sticks", {
        **{f"C{i}": (f"stick_{i + 1}", "1") for i in range(8)}, **{f"Ch{i}": (f"stick_{i + 1}", "1") for i in range(8)},
    }),
    "AIRS": ("airspeed", {"TrueSpeed": ("airspeed", "m/s")}),
    "BATT": ("battery", {"V": ("voltage", "V"), "C": ("current", "A")}),
}  # fmt: skip


def recognises(source: Source) -> bool:
    """A DataFlash file whose stamps are messages of their own."""
    return is_dataflash(source.stored) and ardupilot.is_px4(source.stored)


def read(source: Source, options: Options) -> Flight:
    """A log of early PX4 firmware as a flight: one stream a message; parameters and firmware in the provenance.

    Raises:
        FlightError: where nothing in the log can be used, or a mapping is given.
    """
    refuse_mapping(options, "a PX4 log", where=source.name)
    log = dataflash.messages(source.stored)
    clock = log.get("TIME") or MessageTable({}, np.zeros(0, np.int64))
    (first, last), said = clocked.longest_run([(clock.place, clock.number("StartTime") / 1e6)])
    remarks = clocked.Remarks(list(log.notes), [*log.damage, *filter(None, (said,))])
    clock = clock.rows((clock.place >= first) & (clock.place < last))
    streams: dict[str, xr.Dataset] = {}
    for name, (stream_name, fields) in _MESSAGES.items():
        table = log.get(name)
        if table is None or not len(clock):
            continue
        table = table.rows((table.place > clock.place[0]) & (table.place < last))
        present = {field: place for field, place in fields.items() if field in table.columns}
        columns = {channel: (table.number(field), unit) for field, (channel, unit) in present.items()}
        data = clocked.made_stream(stream_name, _stamps(table, clock), columns, remarks=remarks)
        if data is not None:
            streams[stream_name] = data
    if not streams:
        raise FlightError(
            f"holds no flight: no known message has two samples after a TIME message ({len(clock)} of these).",
            where=source.name,
            hint="Copy the log again.",
        )
    remarks.notes += _remarks(log, streams)
    provenance = source.provenance(
        NAME,
        VERSION,
        vehicle=_firmware(log),
        notes=tuple(remarks.notes),
        damage=tuple(remarks.damage),
        parameters=_parameters(log),
        events=_states(log, clock),
    )
    return Flight(streams, provenance)


def _stamps(table: MessageTable, clock: MessageTable) -> Array:
    """The time [s] of each message: that of the last TIME message before it."""
    group = np.searchsorted(clock.place, table.place) - 1
    return np.asarray(clock.number("StartTime")[np.maximum(group, 0)] / 1e6)


def _parameters(log: Messages) -> dict[str, float]:
    table = log.get("PARM")
    if table is None:
        return {}
    rows = zip(table.text("Name"), table.number("Value").tolist(), strict=True)
    return {name: value for name, value in rows if re.fullmatch(r"\w+", name) and np.isfinite(value)}


def _states(log: Messages, clock: MessageTable) -> tuple[Event, ...]:
    table = log.get("STAT")
    if table is None or not len(clock):
        return ()
    field = "MainState" if "MainState" in table.columns else "State"
    events: list[Event] = []
    for time, state in zip(_stamps(table, clock).tolist(), table.number(field).tolist(), strict=True):
        text = f"state {state:.0f}"
        if np.isfinite(state) and (not events or events[-1].text != text):
            events.append(Event(time, "mode", text, {"number": state}))
    return tuple(events)


def _firmware(log: Messages) -> str:
    table = log.get("VER")
    return " ".join(field for name in ("Arch", "FwGit") for field in table.text(name)[:1]) if table is not None else ""


def _remarks(log: Messages, streams: Mapping[str, xr.Dataset]) -> list[str]:
    remarks = []
    if "inertial" in streams:
        down = float(np.median(streams["inertial"].get("az", xr.DataArray([-1.0])).values))
        if down > 0.0:
            remarks.append(
                f"az is {down:.2f} m/s^2 in the median: its axes are not forward-right-down, or it lay on its back"
            )
    inputs = {
        str(name): np.asarray(values.values, dtype=np.float64)
        for data in streams.values()
        for name, values in data.data_vars.items()
        if str(name).startswith("mixer_")
    }
    remarks += checks.constant_notes(inputs)
    counts = {name: len(table) for name, table in log.tables.items()}
    remarks += clocked.unread(counts, ("FMT", "TIME", "PARM", "VER", "STAT", *_MESSAGES))
    return remarks
