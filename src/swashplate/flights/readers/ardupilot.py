"""ArduPilot logs, binary (`.bin`) and text (`.log`): what was measured, commanded, received and set.

Each message becomes a stream at its own rate. Quantities that several messages carry get the schema's plain name from
the first in `_MESSAGES` that the log has (the fast ANG before ATT, the controller's RATE before the inertial sensor)
and a suffix from the others (`phi_slow`, `p_imu`, `az_sid`). Times are the log's own: seconds since the autopilot's
start.

Source: ArduPilot's documentation of its log messages; units as given there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers import ardupilot_chirp
from swashplate.flights.provenance import Event
from swashplate.flights.readers import checks, clocked, dataflash, dataflash_text
from swashplate.flights.readers.ardupilot_events import seconds, story
from swashplate.flights.readers.dataflash import Messages, MessageTable
from swashplate.flights.readers.dataflash_index import HEAD, is_dataflash
from swashplate.flights.readers.options import Options, refuse_mapping
from swashplate.flights.readers.source import Places, Source, Stored
from swashplate.flights.schema import is_known
from swashplate.flights.stored_column import StoredColumn

NAME = "ardupilot"
VERSION = "1"
NAMES_UNITS = True


@dataclass(frozen=True)
class _Message:
    """How a message is read.

    Attributes:
        name: in the log; stream: ours.
        fields: field -> (channel, unit in the log).
        suffix: of channels that an earlier message has taken.
        instance: (field, number) where the message carries several sensors.
        total: channel that is the sum of all fields, "" for none.
    """

    name: str
    stream: str
    fields: Mapping[str, tuple[str, str]]
    suffix: str = ""
    instance: tuple[tuple[str, ...], int] | None = None
    total: str = ""


_INSTANCE = ("I", "Inst", "Instance", "C")
_INERTIAL = {
    "GyrX": ("p", "rad/s"), "GyrY": ("q", "rad/s"), "GyrZ": ("r", "rad/s"),
    "AccX": ("ax", "m/s^2"), "AccY": ("ay", "m/s^2"), "AccZ": ("az", "m/s^2"),
}  # fmt: skip
_ANGLES = {
    "Roll": ("phi", "deg"), "Pitch": ("theta", "deg"), "Yaw": ("psi", "deg"),
    "DesRoll": ("phi_demand", "deg"), "DesPitch": ("theta_demand", "deg"), "DesYaw": ("psi_demand", "deg"),
}  # fmt: skip
_ESTIMATE = {
    "PN": ("x", "m"), "PE": ("y", "m"), "PD": ("z", "m"), "VN": ("vx", "m/s"), "VE": ("vy", "m/s"), "VD": ("vz", "m/s"),
}  # fmt: skip


def _controller(message: str, axis: str) -> _Message:
    """The terms of a rate controller, whose sum goes to the mixer."""
    terms = {"P": "p", "I": "i", "D": "d", "FF": "f", "DFF": "df"}
    fields = {field: (f"pid_{term}_{axis}", "1") for field, term in terms.items()}
    return _Message(message, f"pid_{axis}", fields, total=f"pid_{axis}")


_MESSAGES = (
    _Message("RATE", "rates", {
        "R": ("p", "deg/s"), "P": ("q", "deg/s"), "Y": ("r", "deg/s"),
        "RDes": ("p_demand", "deg/s"), "PDes": ("q_demand", "deg/s"), "YDes": ("r_demand", "deg/s"),
        "ROut": ("mixer_roll", "1"), "POut": ("mixer_pitch", "1"), "YOut": ("mixer_yaw", "1"),
        "AOut": ("mixer_collective", "1"),
    }),
    _Message("ANG", "angles", _ANGLES),
    _Message("ATT", "attitude", _ANGLES, "slow"),
    _Message("IMU", "inertial", _INERTIAL, "imu", (_INSTANCE, 0)),
    _Message("IMU", "inertial_2", _INERTIAL, "imu2", (_INSTANCE, 1)),
    _Message("IMU", "inertial_3", _INERTIAL, "imu3", (_INSTANCE, 2)),
    _Message("IMU2", "inertial_2", _INERTIAL, "imu2"),
    _Message("IMU3", "inertial_3", _INERTIAL, "imu3"),
    _Message("SIDD", "system_identification", {
        "Targ": ("sid_target", ""), "F": ("sid_frequency", "Hz"),
        "Gx": ("p", "deg/s"), "Gy": ("q", "deg/s"), "Gz": ("r", "deg/s"),
        "Ax": ("ax", "m/s^2"), "Ay": ("ay", "m/s^2"), "Az": ("az", "m/s^2"),
    }, "sid"),
    _controller("PIDR", "roll"), _controller("PIDP", "pitch"), _controller("PIDY", "yaw"),
    _Message("RCIN", "received", {f"C{i}": (f"rcin_{i}", "us") for i in range(1, 17)}),
    _Message("RCOU", "sent", {f"C{i}": (f"rcout_{i}", "us") for i in range(1, 17)}),
    _Message("RPM", "rotor", {"RPM": ("omega_rotor", "rpm"), "rpm1": ("omega_rotor", "rpm")}, "", (_INSTANCE, 0)),
    *(_Message("ESC", f"esc_{k + 1}", {"RPM": (f"omega_motor_{k + 1}", "rpm")}, "", (_INSTANCE, k)) for k in range(8)),
    _Message("XKF1", "estimate", _ESTIMATE, "", (_INSTANCE, 0)),
    _Message("NKF1", "estimate", _ESTIMATE, "", (_INSTANCE, 0)),
    _Message("BARO", "barometer", {"Alt": ("altitude_baro", "m")}, "", (_INSTANCE, 0)),
    _Message("ARSP", "airspeed", {"Airspeed": ("airspeed", "m/s")}, "", (_INSTANCE, 0)),
    _Message("GYR", "gyro_raw", {f: _INERTIAL[f] for f in ("GyrX", "GyrY", "GyrZ")}, "raw", (_INSTANCE, 0)),
    _Message("ACC", "accelerometer_raw", {f: _INERTIAL[f] for f in ("AccX", "AccY", "AccZ")}, "raw", (_INSTANCE, 0)),
    _Message("VIBE", "vibration", {
        **{f"Vibe{axis}": (f"vibe_{axis.lower()}", "m/s^2") for axis in "XYZ"}, "Clip": ("clips", "1"),
        **{f"Clip{k}": (f"clips{f'_{k + 1}' * bool(k)}", "1") for k in range(3)},
    }, "", (("IMU", *_INSTANCE), 0)),
    _Message("GPS", "gps", {
        "Lat": ("latitude", "deg"), "Lng": ("longitude", "deg"), "Spd": ("gps_speed", "m/s"),
        "Status": ("gps_status", "1"), "NSats": ("gps_satellites", "1"), "HDop": ("gps_hdop", "1"),
    }, "", (_INSTANCE, 0)),
    _Message("POWR", "supply", {"Vcc": ("voltage_board", "V")}),
    _Message("BAT", "battery", {"Volt": ("voltage", "V"), "Curr": ("current", "A")}, "", (_INSTANCE, 0)),
)  # fmt: skip
_STORIES = ("FMT", "FMTU", "UNIT", "MULT", "PARM", "MSG", "MODE", "EV", "ERR", "ARM", "SIDS")


_AT_HAND = {
    "": ("TimeUS", "TimeMS"),
    **{
        name: {"Time", *(f for m in _MESSAGES if m.name == name for f in (*m.fields, *(m.instance or ((), 0))[0]))}
        for name in {message.name for message in _MESSAGES}
    },
}
_LONG = 200_000
"""Messages."""
_NEARLY_ALL = 0.999
"""Of the stamps: the largest of many may be a damaged one."""


def recognises(source: Source) -> bool:
    """A DataFlash file, binary or text, with ArduPilot's stamps (each message carries its own)."""
    if source.stored[:2] == HEAD or source.path.suffix.lower() == ".bin":
        return is_dataflash(source.stored) and not is_px4(source.stored)
    return dataflash_text.is_dataflash_text(source.text)


def is_px4(content: Stored) -> bool:
    """Whether a DataFlash file is one of PX4: its messages carry no time, a message TIME does."""
    head = content[: 1 << 16]
    return b"TIMEQ" in head and b"StartTime" in head


def read(source: Source, options: Options) -> Flight:
    """An ArduPilot log as a flight: one stream a message, autopilot's parameters and events in the provenance.

    What is damaged is left out and said: see `Provenance.damage` and `notes`. Where the clock starts anew, the longest
    run is read.

    Raises:
        FlightError: where nothing in the log can be used, or a mapping is given.
    """
    refuse_mapping(options, "an ArduPilot log", where=source.name)
    text, _ = source.text, source.hashing
    log = dataflash.messages(source.stored, _AT_HAND) if text is None else dataflash_text.messages(text)
    log, coarse = _stamped(log, source)
    log, end, said = _one_run(log)
    logged = story(log, end=end)
    left = clocked.Remarks(list(log.notes), [*log.damage, *filter(None, (said,)), *logged.damage])
    if "Plane" in logged.vehicle:  # its terms are angles of control surfaces, not commands to a mixer
        log = Messages({n: t for n, t in log.tables.items() if n[:3] != "PID"}, log.notes, log.damage)
    streams = _streams(log, logged.events, left)
    if not streams:
        raise FlightError(
            f"holds no flight: no known message has two samples ({sum(map(len, log.tables.values()))} messages of "
            f"{len(log.tables)} kinds found).",
            where=source.name,
            hint="Copy the log again; check that ATT, RATE or IMU are in LOG_BITMASK.",
        )
    left.notes += [*coarse, *_filters(logged.parameters, streams), *_remarks(log, streams)]
    provenance = source.provenance(
        NAME,
        VERSION,
        vehicle=logged.vehicle,
        firmware=logged.firmware,
        notes=tuple(left.notes),
        damage=tuple(left.damage),
        parameters=logged.parameters,
        events=logged.events,
    )
    return Flight(streams, provenance)


def _stamped(log: Messages, source: Source) -> tuple[Messages, tuple[str, ...]]:
    """The messages with times, and a note where they are not their own: firmware before 3.1 wrote none.

    The GPS's messages say when they came; what stands between two of them is spread evenly.

    Raises:
        FlightError: where no message says when it was written.
    """
    known = {message.name for message in _MESSAGES} - {"GPS"}
    there = {name: table for name, table in log.tables.items() if name in known and len(table)}
    if not there or any(np.isfinite(seconds(table)).any() for table in there.values()):
        return log, ()
    fixes = log.get("GPS")
    clock = np.zeros(0) if fixes is None else fixes.number("Time")
    good = np.isfinite(clock) & (np.diff(clock, prepend=-1.0) > 0.0)
    if fixes is None or good.sum() < 2:
        raise FlightError(
            f"the messages carry no time stamps (found {', '.join(sorted(there))}, expected TimeUS or TimeMS in each): "
            "firmware before 3.1 wrote none, and no GPS message says the time, so the log does not say when anything "
            "was measured.",
            where=source.name,
            channel="time",
            hint="Fly again with newer firmware: nothing can be identified from this log.",
        )
    place, micro = fixes.place[good], 1e3 * (clock[good] - clock[good][0])
    tables = {}
    for name, table in log.tables.items():
        kept = table if name in _STORIES else table.rows((table.place >= place[0]) & (table.place <= place[-1]))
        tables[name] = MessageTable({**kept.columns, "TimeUS": np.interp(kept.place, place, micro)}, kept.place)
    note = (
        "the messages carry no time stamps (firmware before 3.1): times are those of the GPS, spread evenly between "
        f"its messages ({1e-3 * float(np.median(np.diff(micro))):.0f} ms apart): good to look at, too coarse for a fit"
    )
    return Messages(tables, log.notes, log.damage), (note,)


def _one_run(log: Messages) -> tuple[Messages, float, str]:
    """The messages of the longest run between clock resets, its last stamp [s], and what was left out."""
    # Of a long log every kind has many messages: where no clock of one falls back nothing needs one row of all.
    if sum(map(len, log.tables.values())) > _LONG and all(map(_rises, log.tables.values())):
        return log, _last_of_rising([table for table in log.tables.values() if _stamps(table) is not None]), ""
    timed = list[tuple[Places, Array]]()
    for table in log.tables.values():
        good = np.isfinite(stamps := seconds(table))
        timed.append((table.place[good], stamps[good]))
    place = np.concatenate([p.astype(np.int64) for p, _ in timed]) if timed else np.zeros(0, np.int64)
    time = np.concatenate([t for _, t in timed]) if timed else np.zeros(0)
    order = np.argsort(place, kind="stable")
    (first, last), said = clocked.longest_run([(place[order], time[order])])
    if said:
        cut = {name: t.rows((t.place >= first) & (t.place < last)) for name, t in log.tables.items()}
        log = Messages({name: t for name, t in cut.items() if len(t)}, log.notes, log.damage)
    return log, _last_stamp(time[(place >= first) & (place < last)]), said


def _last_stamp(time: Array) -> float:
    return float(np.quantile(time, _NEARLY_ALL)) if time.size > 2000 else float(time.max(initial=0.0))


def _stamps(table: MessageTable) -> NDArray[np.generic] | None:
    return next((table.columns[name] for name in ("TimeUS", "TimeMS") if name in table.columns), None)


def _rises(table: MessageTable) -> bool:
    """Whether no stamp of a table is less than the one before it, or missing; it may have none."""
    stamps = _stamps(table)
    return stamps is None or bool(np.all(np.greater_equal(stamps[1:], stamps[:-1])))


def _last_of_rising(tables: Sequence[MessageTable]) -> float:
    """The last stamp of tables whose clocks never fall: what `_last_stamp` says, from their ends alone."""
    count = sum(map(len, tables))
    rank = _NEARLY_ALL * (count - 1)
    most = count - int(rank)
    ends = [seconds(table.rows(np.arange(max(0, len(table) - most), len(table)))) for table in tables]
    return float(np.interp(rank - (count - most), np.arange(most), np.sort(np.concatenate(ends))[-most:]))


def _chosen(table: MessageTable, wanted: tuple[tuple[str, ...], int] | None) -> MessageTable:
    """The messages of one sensor, where the message says which."""
    if wanted is None:
        return table
    names, number = wanted
    field = next((name for name in names if name in table.columns), None)
    if field is None:
        return table.rows(np.arange(len(table) if number == 0 else 0))
    return table.rows(table.number(field) == number)


def _streams(log: Messages, events: tuple[Event, ...], remarks: clocked.Remarks) -> dict[str, xr.Dataset]:
    streams: dict[str, xr.Dataset] = {}
    taken: set[str] = set()
    target_unit = next(
        (ardupilot_chirp.AXES.get(e.details["axis"], ("", ""))[1] for e in events if e.kind == "sweep"), ""
    )
    for message in _MESSAGES:
        table = log.get(message.name)
        if table is None or message.stream in streams:
            continue
        table = _chosen(table, message.instance)
        columns = dict[str, tuple[Array | StoredColumn, str]]()
        for field, (channel, unit) in message.fields.items():
            name = channel if channel not in taken else _with_suffix(channel, message.suffix)
            if name is None or name in taken or field not in table.columns:
                continue
            values = table.stored(field)
            if channel.startswith(("rcin", "rcout")) and not np.any(clocked.numbers_of(values)):
                continue  # a channel that nothing is connected to
            columns[name] = (values, target_unit if channel == "sid_target" else unit)
        if message.total and columns:
            terms = [clocked.numbers_of(values) for values, _ in columns.values()]
            columns[message.total] = (np.sum(terms, axis=0), "1")
        data = clocked.made_stream(message.stream, seconds(table), columns, remarks=remarks)
        if data is not None:
            streams[message.stream] = data
            taken |= set(map(str, data.data_vars))
    return streams


def _with_suffix(channel: str, suffix: str) -> str | None:
    """A channel's name as a second opinion; demands have none."""
    name = f"{channel}_{suffix}"
    return name if suffix and is_known(name) else None


_FILTERED = (
    ("INS_GYRO_FILTER", ("rates", "inertial"), "p q r"),
    ("INS_ACCEL_FILTER", ("inertial",), "ax ay az"),
)


def _filters(parameters: Mapping[str, float], streams: Mapping[str, xr.Dataset]) -> list[str]:
    """The autopilot's own low-passes on what it logs: second-order Butterworth, late by sqrt(2) / (2 pi corner)."""
    return [
        f"{channels} of {' and '.join(there)} have passed {name}, {corner:g} Hz: "
        f"{1e3 * 2**0.5 / (2 * np.pi * corner):.1f} ms of any delay found with them is the filter's"
        for name, homes, channels in _FILTERED
        if (corner := parameters.get(name, 0.0)) > 0.0 and (there := [home for home in homes if home in streams])
    ]


def _remarks(log: Messages, streams: Mapping[str, xr.Dataset]) -> list[str]:
    remarks = []
    if "system_identification" in streams:
        remarks.append("sid_target acts one loop of the controller after its stamp")
    for data in streams.values():
        for name in filter(lambda name: name.startswith("mixer_"), map(str, data.data_vars)):
            remarks += checks.constant_notes({name: np.asarray(data[name].values, dtype=np.float64)})
    counts = {name: len(table) for name, table in log.tables.items()}
    if "rates" not in streams:
        remarks.append("no RATE message, so no commands to the mixer: set ATTITUDE_MED or _FAST in LOG_BITMASK")
    remarks += clocked.unread(counts, (*_STORIES, *(message.name for message in _MESSAGES)))
    return remarks
