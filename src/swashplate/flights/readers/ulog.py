"""PX4's ULog (`.ulg`), described by pyulog (Goppert, Kueng and others): one stream a topic, at its own rate.

SI units, radians, FRD and NED as logged. Where a topic says when its sample was measured (`timestamp_sample`), that is
its time: the transport through the estimator is then no delay of the helicopter. Source: PX4's message definitions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.flights.provenance import Event
from swashplate.flights.readers import checks, clocked, dataflash
from swashplate.flights.readers.dataflash import MessageTable, Wanted
from swashplate.flights.readers.options import Options, refuse_mapping
from swashplate.flights.readers.source import Source
from swashplate.flights.readers.ulog_messages import MAGIC
from swashplate.flights.readers.ulog_topics import Topic, Topics
from swashplate.flights.schema import QUATERNION
from swashplate.flights.stored_column import StoredColumn

NAME = "ulog"
VERSION = "1"
NAMES_UNITS = True

_ARMED = 2


@dataclass(frozen=True)
class _Topic:
    """How a topic is read: fields -> (channel, unit, factor); `measured`: its sample's time is the stamp."""

    name: str
    stream: str
    fields: Mapping[str, tuple[str, str, float]]
    measured: bool = False


def _same(names: Mapping[str, str], unit: str) -> dict[str, tuple[str, str, float]]:
    return {field: (channel, unit, 1.0) for field, channel in names.items()}


def _row(prefix: str, channels: tuple[str, ...], unit: str) -> dict[str, tuple[str, str, float]]:
    return {f"{prefix}[{i}]": (channel, unit, 1.0) for i, channel in enumerate(channels)}


def _numbered(prefix: str, channel: str, count: int, unit: str) -> dict[str, tuple[str, str, float]]:
    return _row(prefix, tuple(f"{channel}_{i + 1}" for i in range(count)), unit)


_MIXER = ("mixer_roll", "mixer_pitch", "mixer_yaw", "mixer_collective")
_STICKS = ("stick_roll", "stick_pitch", "stick_yaw", "stick_throttle")
# A channel that an earlier topic gave is left out of the later ones.
_TOPICS = (
    _Topic("vehicle_angular_velocity", "rates", _row("xyz", ("p", "q", "r"), "rad/s"), measured=True),
    _Topic("vehicle_attitude", "attitude", {
        **_row("q", QUATERNION, "1"), **_same({"rollspeed": "p", "pitchspeed": "q", "yawspeed": "r"}, "rad/s"),
    }, measured=True),
    _Topic("vehicle_torque_setpoint", "torque", _row("xyz", _MIXER[:3], "1")),
    _Topic("vehicle_thrust_setpoint", "thrust", {"xyz[2]": ("mixer_collective", "1", -1.0)}),
    _Topic("actuator_controls_0", "controls", _row("control", _MIXER, "1")),
    _Topic("sensor_combined", "inertial", {
        **_row("gyro_rad", ("p_imu", "q_imu", "r_imu"), "rad/s"),
        **_row("accelerometer_m_s2", ("ax", "ay", "az"), "m/s^2"),
    }),
    _Topic("vehicle_acceleration", "acceleration", _row("xyz", ("ax", "ay", "az"), "m/s^2"), measured=True),
    _Topic("vehicle_rates_setpoint", "rate_demand", _same(
        {"roll": "p_demand", "pitch": "q_demand", "yaw": "r_demand"}, "rad/s"
    )),
    _Topic("vehicle_attitude_setpoint", "attitude_demand", _same(
        {"roll_body": "phi_demand", "pitch_body": "theta_demand", "yaw_body": "psi_demand"}, "rad"
    )),
    _Topic("vehicle_local_position", "position", {
        **_same({axis: axis for axis in ("x", "y", "z")}, "m"),
        **_same({axis: axis for axis in ("vx", "vy", "vz")}, "m/s"),
    }),
    _Topic("actuator_motors", "motors", _numbered("control", "motor", 12, "1")),
    _Topic("actuator_servos", "servos", _numbered("control", "servo", 8, "1")),
    _Topic("actuator_outputs", "sent", _numbered("output", "rcout", 16, "us")),
    _Topic("input_rc", "received", _numbered("values", "rcin", 18, "us")),
    _Topic("manual_control_setpoint", "sticks", {
        **_same(dict(zip(("roll", "pitch", "yaw", "throttle"), _STICKS, strict=True)), "1"),
        **_same(dict(zip(("y", "x", "r", "z"), _STICKS, strict=True)), "1"),
    }),
    _Topic("rpm", "rotor", _same({"rpm_estimate": "omega_rotor", "indicated_frequency_rpm": "omega_rotor"}, "rpm")),
    _Topic("esc_status", "escs", {f"esc[{i}].esc_rpm": (f"omega_esc_{i + 1}", "rpm", 1.0) for i in range(8)}),
    _Topic("airspeed", "airspeed", _same({"true_airspeed_m_s": "airspeed"}, "m/s")),
    _Topic("battery_status", "battery", {"voltage_v": ("voltage", "V", 1.0), "current_a": ("current", "A", 1.0)}),
)  # fmt: skip


def recognises(source: Source) -> bool:
    """The magic bytes of a ULog file."""
    return source.stored[: len(MAGIC)] == MAGIC


def read(source: Source, options: Options) -> Flight:
    """A ULog file as a flight: one stream a topic; parameters, messages and dropouts in the provenance.

    Raises:
        FlightError: where pyulog is not installed, nothing in the log can be used, or a mapping is given.
    """
    refuse_mapping(options, "a ULog file", where=source.name)
    log = Topics(source.stored, source.name)
    remarks = clocked.Remarks()
    streams: dict[str, xr.Dataset] = {}
    taken: set[str] = set()
    first = _first_instances(log.topics)
    for topic in _TOPICS:
        dataset = _stream(topic, first.pop(topic.name, None), taken, remarks)
        if dataset is not None:
            streams[topic.stream] = dataset
            taken |= set(map(str, dataset.data_vars))
    if not streams:
        raise FlightError(
            f"holds no flight: none of its {len(log.topics)} topics is known and has two samples.",
            where=source.name,
            hint="Copy the log again; check the logging profile (SDLOG_PROFILE).",
        )
    commands = {name: np.asarray(d[name].values) for d in streams.values() for name in _MIXER if name in d}
    remarks.notes += checks.constant_notes(commands)
    counts = {f"{one.name}/{one.instance}" if one.instance else one.name: _stamped(one) for one in log.topics}
    remarks.notes += clocked.unread(counts, [topic.name for topic in _TOPICS])
    info = log.log.msg_info_dict
    provenance = source.provenance(
        NAME,
        VERSION,
        vehicle=" ".join(str(info[key]) for key in ("sys_name", "ver_hw", "ver_sw") if key in info),
        firmware=str(info.get("sys_name", "")),
        notes=tuple(remarks.notes),
        damage=(*_damage(log), *remarks.damage),
        parameters={str(k): float(v) for k, v in log.log.initial_parameters.items() if isinstance(v, int | float)},
        events=_events(log.log, first),
    )
    return Flight(streams, provenance)


def _first_instances(topics: Sequence[Topic]) -> dict[str, MessageTable]:
    """The first instance of each topic, what the schema knows of it at hand: the file is gone through once."""
    read = {topic.name: {"timestamp", *topic.fields, *("timestamp_sample",) * topic.measured} for topic in _TOPICS}
    read["vehicle_status"] = {"timestamp", "arming_state", "nav_state"}
    first = {topic.name: topic for topic in reversed(topics) if topic.instance == 0}
    by_content = dict[int, list[Topic]]()
    for topic in first.values():
        by_content.setdefault(id(topic.content), []).append(topic)
    tables = dict[str, MessageTable]()
    for together in by_content.values():
        wanted = [
            Wanted(one.kind, one.kind.at, [name for name in one.kind.factors if name in read.get(one.name, ())])
            for one in together
        ]
        read_now = dataflash.tables(together[0].content, wanted)
        tables |= {one.name: table for one, table in zip(together, read_now, strict=True)}
    return tables


def _stamped(topic: Topic) -> int:
    return len(topic) if "timestamp" in topic.kind.factors else 0


def _stream(topic: _Topic, table: MessageTable | None, taken: set[str], remarks: clocked.Remarks) -> xr.Dataset | None:
    if table is None or "timestamp" not in table.columns:
        return None
    time = table.number("timestamp") / 1e6
    if topic.measured and "timestamp_sample" in table.columns:
        sampled = table.number("timestamp_sample") / 1e6
        time = np.where(sampled > 0.0, sampled, time)
    columns: dict[str, tuple[Array | StoredColumn, str]] = {}
    for field, (channel, unit, factor) in topic.fields.items():
        if field in table.columns and channel not in taken and channel not in columns:
            values = table.stored(field)
            if unit != "us" or np.any(clocked.numbers_of(values) > 0.0):  # outputs that nothing is connected to
                columns[channel] = (values.times(factor) if isinstance(values, StoredColumn) else factor * values, unit)
    return clocked.made_stream(topic.stream, time, columns, remarks=remarks)


def _damage(topics: Topics) -> list[str]:
    damage, log = [], topics.log
    if topics.lost:
        damage.append(f"{topics.lost} bytes in the middle belong to no message: they were skipped")
    elif log.file_corruption:
        damage.append("some messages do not fit their descriptions: pyulog skipped them")
    if topics.unfinished:
        damage.append("the log is cut off: its last message is unfinished")
    lost = sum(float(dropout.duration) for dropout in log.dropouts) / 1e3
    if log.dropouts:
        damage.append(f"{len(log.dropouts)} dropouts: the logger lost {lost:.2f} s in all")
    return damage


def _events(log: Any, first: Mapping[str, MessageTable]) -> tuple[Event, ...]:
    events = [Event(float(m.timestamp) / 1e6, "message", str(m.message)) for m in log.logged_messages]
    for stamp, name, value in log.changed_parameters:
        if isinstance(value, int | float):
            details = {"name": str(name), "value": float(value)}
            events.append(Event(float(stamp) / 1e6, "parameter", f"{name}: -> {value:.6g}", details))
    for dropout in log.dropouts:
        seconds = float(dropout.duration) / 1e3
        events.append(Event(float(dropout.timestamp) / 1e6, "dropout", f"{seconds:.3f} s lost", {"seconds": seconds}))
    status = first["vehicle_status"].columns if "vehicle_status" in first else {}
    for field, states in (("arming_state", ("disarmed", "armed")), ("nav_state", None)):
        if field not in status or "timestamp" not in status:
            continue
        values = np.asarray(status[field], dtype=np.int64)
        changes = np.flatnonzero(np.diff(values, prepend=-1))
        for i in changes.tolist():
            number = int(values[i])
            kind = "mode" if states is None else states[number == _ARMED]
            text = f"navigation state {number}" if states is None else kind
            events.append(Event(float(status["timestamp"][i]) / 1e6, kind, text, {"number": number}))
    return tuple(sorted(events, key=lambda event: event.time))
