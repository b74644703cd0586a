"""Autopilot logs in their real binary formats, written by the tests themselves from the formats' descriptions."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from swashplate.flights.maneuvers.ardupilot_chirp import Chirp

Row = tuple[str, tuple[Any, ...]]

_C_TYPES = {"b": "b", "B": "B", "M": "B", "h": "h", "H": "H", "i": "i", "I": "I", "q": "q", "Q": "Q", "f": "f"}
_C_TYPES |= {"d": "d", "n": "4s", "N": "16s", "Z": "64s", "c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "g": "e"}
_SCALED = {"c": 100, "C": 100, "e": 100, "E": 100, "L": 10_000_000}

# name -> (type, format, columns)
ARDUPILOT: dict[str, tuple[int, str, str]] = {
    "PARM": (32, "QNff", "TimeUS,Name,Value,Default"),
    "MSG": (33, "QZ", "TimeUS,Message"),
    "MODE": (34, "QMBB", "TimeUS,Mode,ModeNum,Rsn"),
    "EV": (35, "QB", "TimeUS,Id"),
    "SIDS": (10, "QBfffffff", "TimeUS,Ax,Mag,FSt,FSp,TFin,TC,TR,TFout"),
    "SIDD": (9, "Qfffffffff", "TimeUS,Time,Targ,F,Gx,Gy,Gz,Ax,Ay,Az"),
    "RATE": (75, "Qffffffffffff", "TimeUS,RDes,R,ROut,PDes,P,POut,YDes,Y,YOut,ADes,A,AOut"),
    "ATT": (72, "QccccCC", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw"),
    "ANG": (73, "Qffffff", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw"),
    "IMU": (164, "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ"),
    "RCIN": (60, "QHHH", "TimeUS,C1,C2,C3"),
    "RCOU": (62, "QHHH", "TimeUS,C1,C2,C3"),
    "RPM": (113, "QBf", "TimeUS,I,RPM"),
    "XYZ1": (201, "Qff", "TimeUS,Foo,Bar"),
}


def payload(letters: str, values: Sequence[Any]) -> bytes:
    packed = []
    for letter, value in zip(letters, values, strict=True):
        scaled = round(value * _SCALED[letter]) if letter in _SCALED else value
        packed.append(scaled.encode() if isinstance(scaled, str) else scaled)
    return struct.pack("<" + "".join(_C_TYPES[letter] for letter in letters), *packed)


def fmt(kind: int, length: int, name: str, letters: str, columns: str) -> bytes:
    body = struct.pack("<BB4s16s64s", kind, length, name.encode(), letters.encode(), columns.encode())
    return b"\xa3\x95\x80" + body


def dataflash(rows: Iterable[Row], formats: Mapping[str, tuple[int, str, str]] = ARDUPILOT) -> bytes:
    """Rows as a binary DataFlash log, all formats first."""
    out = [fmt(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")]
    for name, (kind, letters, columns) in formats.items():
        length = 3 + struct.calcsize("<" + "".join(_C_TYPES[letter] for letter in letters))
        out.append(fmt(kind, length, name, letters, columns))
    for name, values in rows:
        kind, letters, _ = formats[name]
        out.append(b"\xa3\x95" + bytes([kind]) + payload(letters, values))
    return b"".join(out)


def dataflash_text(rows: Iterable[Row], formats: Mapping[str, tuple[int, str, str]] = ARDUPILOT) -> str:
    """The same rows as a text log."""
    lines = ["FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns"]
    for name, (kind, letters, columns) in formats.items():
        lines.append(f"FMT, {kind}, 0, {name}, {letters}, {columns}")
    lines += [
        ", ".join([name, *(repr(float(v)) if isinstance(v, float) else str(v) for v in values)])
        for name, values in rows
    ]
    return "\n".join(lines) + "\n"


CHIRP = Chirp(
    axis=10, magnitude=0.15, start_hz=0.5, stop_hz=8.0, record=12.0, fade_in=1.0, fade_out=1.0, dwell=4.0
)  # fmt: skip


def ardupilot_rows(
    *, start: float = 20.0, rate: float = 50.0, until: float | None = None, disarm: bool = True
) -> list[Row]:
    """A short flight: armed, a roll sweep at the mixer that the roll rate follows, disarmed.

    Args:
        start: [s] on the autopilot's clock; rate: of the fast messages [Hz]; until: the last stamp [s], None for all.
    """

    def us(t: float) -> int:
        return round(1e6 * t)

    begin, entry = start, start + 1.0
    rows: list[Row] = [
        ("MSG", (us(begin), "ArduCopter V4.7.0-dev (1234abcd)")),
        ("MSG", (us(begin), "Frame: HELI")),
        ("PARM", (us(begin), "SID_AXIS", 10.0, 0.0)),
        ("PARM", (us(begin), "SCHED_LOOP_RATE", 400.0, 400.0)),
        ("EV", (us(begin), 10)),
        ("MODE", (us(begin), 0, 0, 2)),
    ]
    times = begin + np.arange(round(rate * (CHIRP.record + 4.0))) / rate
    chirp = CHIRP.signal(times - entry - 1.0)
    frequency = CHIRP.frequency(times - entry - 1.0)
    announced = False
    for k, (t, x, f) in enumerate(zip(times.tolist(), chirp.tolist(), frequency.tolist(), strict=True)):
        p, slow = 100.0 * x, k % 5 == 0
        if t >= entry and not announced:
            rows.append(("MODE", (us(t), 25, 25, 2)))
            c = CHIRP
            sids = (c.axis, c.magnitude, c.start_hz, c.stop_hz, c.fade_in, c.dwell, c.record, c.fade_out)
            rows.append(("SIDS", (us(t), *sids)))
            announced = True
        rows.append(("RATE", (us(t), 0.0, p, x, 0.0, 0.1 * p, 0.01 * x, 0.0, 0.0, 0.02, 0.0, 0.0, 0.5)))
        rows.append(("ANG", (us(t), 0.0, 2.0 * np.sin(t), 0.0, -3.0, 10.0, 90.0)))
        rows += [("IMU", (us(t), i, np.deg2rad(p), 0.0, 0.0, 0.1, 0.2, -9.8 - i)) for i in (0, 1)]
        if announced:
            rows.append(("SIDD", (us(t), t - entry, x, f, p, 0.0, 0.0, 0.1, 0.2, -9.8)))
        if slow:
            rows.append(("ATT", (us(t), 0.0, 2.0 * np.sin(t), 0.0, -3.0, 10.0, 90.0)))
            rows.append(("RCIN", (us(t), 1500, 1500 + k % 7, 0)))
            rows.append(("RCOU", (us(t), 1500, 1510, 1490)))
            rows.append(("RPM", (us(t), 0, 1500.0)))
            rows.append(("XYZ1", (us(t), 1.0, 2.0)))
    rows.append(("PARM", (us(times[-1]), "SID_AXIS", 11.0, 0.0)))
    if disarm:
        rows.append(("EV", (us(times[-1]), 11)))
    return [row for row in rows if until is None or row[1][0] <= us(until)]


PX4LOG: dict[str, tuple[int, str, str]] = {
    "TIME": (129, "Q", "StartTime"),
    "ATT": (2, "ffffff", "Roll,Pitch,Yaw,RollRate,PitchRate,YawRate"),
    "IMU": (4, "ffffff", "AccX,AccY,AccZ,GyroX,GyroY,GyroZ"),
    "ATTC": (9, "ffff", "Roll,Pitch,Yaw,Thrust"),
    "OUT0": (12, "fff", "Out0,Out1,Out2"),
    "STAT": (10, "Bf", "MainState,Load"),
    "VER": (11, "NZ", "Arch,FwGit"),
    "PARM": (13, "Nf", "Name,Value"),
    "FOO": (14, "f", "Bar"),
}


def px4_rows(n: int = 60) -> list[Row]:
    rows: list[Row] = [("VER", ("PX4FMU_V2", "abcdef")), ("PARM", ("MC_ROLL_P", 6.5))]
    for k in range(n):
        rows.append(("TIME", (5_000_000 + 20_000 * k,)))
        rows.append(("IMU", (0.1, 0.2, -9.8, 0.01, 0.02, 0.03)))
        if k % 2 == 0:
            rows.append(("ATT", (0.1, 0.2, 0.3, 0.01 * k, 0.0, 0.0)))
            rows.append(("ATTC", (0.01 * k, 0.0, 0.1, 0.5)))
        if k % 10 == 0:
            rows += [("OUT0", (1500.0, 1400.0, float("nan"))), ("STAT", (0 if k < 30 else 2, 0.3)), ("FOO", (1.0,))]
    return rows


def _ulog_message(kind: str, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body


def _ulog_info(kind: str, type_and_key: str, value: bytes) -> bytes:
    return _ulog_message(kind, bytes([len(type_and_key)]) + type_and_key.encode() + value)


ULOG_TOPICS = {
    "vehicle_angular_velocity": "uint64_t timestamp;uint64_t timestamp_sample;float[3] xyz;",
    "vehicle_attitude": "uint64_t timestamp;uint64_t timestamp_sample;float[4] q;",
    "vehicle_torque_setpoint": "uint64_t timestamp;uint64_t timestamp_sample;float[3] xyz;",
    "vehicle_thrust_setpoint": "uint64_t timestamp;uint64_t timestamp_sample;float[3] xyz;",
    "sensor_combined": "uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;",
    "actuator_servos": "uint64_t timestamp;float[4] control;",
    "vehicle_status": "uint64_t timestamp;uint8_t arming_state;uint8_t nav_state;uint8_t[6] _padding0;",
    "strange_topic": "uint64_t timestamp;float foo;",
}


def ulog(n: int = 100, *, dropout: bool = False, period_us: int = 4000) -> bytes:
    """A ULog file: header, flag bits, formats, information, parameters, subscriptions, data."""
    out = [b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1_000_000), _ulog_message("B", bytes(40))]
    out += [_ulog_message("F", f"{name}:{fields}".encode()) for name, fields in ULOG_TOPICS.items()]
    out.append(_ulog_info("I", "char[3] sys_name", b"PX4"))
    out.append(_ulog_info("P", "float MC_ROLLRATE_P", struct.pack("<f", 0.15)))
    out.append(_ulog_info("P", "int32_t MAV_TYPE", struct.pack("<i", 4)))
    out += [_ulog_message("A", struct.pack("<BH", 0, i) + name.encode()) for i, name in enumerate(ULOG_TOPICS)]

    def data(topic: str, form: str, *values: Any) -> bytes:
        return _ulog_message("D", struct.pack("<H" + form, list(ULOG_TOPICS).index(topic), *values))

    for k in range(n):
        t = 2_000_000 + period_us * k
        x = float(np.sin(2 * np.pi * k / 25))
        out.append(data("vehicle_angular_velocity", "QQ3f", t, t - 1000, 0.5 * x, 0.1, 0.0))
        out.append(data("vehicle_torque_setpoint", "QQ3f", t, t - 1000, 0.1 * x, 0.0, 0.05))
        out.append(data("vehicle_thrust_setpoint", "QQ3f", t, t - 1000, 0.0, 0.0, -0.6))
        if k % 2 == 0:
            half = 0.05 * x
            out.append(data("vehicle_attitude", "QQ4f", t, 0, np.cos(half), np.sin(half), 0.0, 0.0))
            out.append(data("sensor_combined", "Q6f", t, 0.5 * x, 0.1, 0.0, 0.1, 0.2, -9.8))
        if k % 10 == 0:
            out.append(data("actuator_servos", "Q4f", t, 0.1 * x, 0.2, 0.3, float("nan")))
            out.append(data("vehicle_status", "QBB", t, 2 if k else 1, 10))
            out.append(data("strange_topic", "Qf", t, 1.0))
        if k == n // 2:
            out.append(_ulog_message("L", b"6" + struct.pack("<Q", t) + b"Armed by RC"))
            out.append(_ulog_info("P", "float MC_ROLLRATE_P", struct.pack("<f", 0.2)))
            if dropout:
                out.append(_ulog_message("O", struct.pack("<H", 120)))
    return b"".join(out)
