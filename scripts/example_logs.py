"""Make the example logs that ship in the wheel: two cuts of our own models under unmodified ArduPilot, one simulation.

    python scripts/example_logs.py ../shared/data/ardupilot_firmware

A DataFlash log describes itself, so a cut is a choice of its messages, byte for byte: some kinds, between two times,
no more often than a rate. Models, flights and logs were made for this project (the folder's NOTES.md). The flight
without a sweep is simulated here, with an oscillation and a shaken stretch whose times are written below.
"""

from __future__ import annotations

import struct
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from swashplate.arrays import Array
from swashplate.flights.readers import dataflash, dataflash_index

OUT = Path(__file__).resolve().parents[1] / "src" / "swashplate" / "flights" / "examples"
ALL = 1e9
_DESCRIBE = ("FMT", "FMTU", "UNIT", "MULT", "VER")
_SLOW = {
    "ATT": 10.0, "CTUN": 5.0, "VIBE": 5.0, "GPS": 5.0, "BAT": 2.0, "RCIN": 5.0, "RCOU": 5.0, "XKF1": 5.0,
    "XKF4": 2.0, "SIDS": ALL, "MODE": ALL, "MSG": ALL, "PARM": ALL,
}  # fmt: skip
_PARAMETERS = (
    b"ATC_", b"INS_GYRO", b"INS_ACCEL_F", b"INS_HNT", b"SID_", b"SCHED_LOOP", b"H_", b"FRAME", b"IM_", b"LOG_", b"EK3_",
    b"RCMAP", b"RC1_", b"RC2_", b"RC3_", b"RC4_", b"SERVO1_", b"SERVO2_", b"SERVO3_", b"PILOT", b"PSC_", b"LOIT",
)  # fmt: skip


@dataclass(frozen=True)
class Cut:
    """One example: which log, between which times [s], and the highest rate [Hz] of each kind of message."""

    source: str
    start: float
    stop: float
    rates: dict[str, float] = field(default_factory=dict)


CUTS = {
    "helicopter_sweeps.bin": Cut(
        "raptor50_three_sweeps.BIN", 178.0, 271.0, {"RATE": ALL, "SIDD": ALL, "ANG": 20.0}
    ),
    "coax_flight.bin": Cut("coax_roll_yaw_sweeps.BIN", 117.4, 161.0, {"RATE": 60.0, "SIDD": 60.0}),
}  # fmt: skip


def cut(content: bytes, chosen: Cut) -> bytes:
    """The chosen messages of a log, in their order."""
    kinds, taken = dataflash.kinds(content), []
    log = dataflash.messages(content)
    used = set(_DESCRIBE) | set(_SLOW) | set(chosen.rates)
    for name, table in log.tables.items():
        if name not in used or name in ("FMT", "FMTU"):
            continue
        kind = next(k for k in kinds if k.name == name)
        size, rate, last = kind.dtype.itemsize + 3, chosen.rates.get(name, _SLOW.get(name, ALL)), {}
        stamps = 1e-6 * table.number("TimeUS")
        told = name in ("PARM", "MODE", "MSG", *_DESCRIBE)
        which = next((table.columns[c].tolist() for c in ("I", "C", "Inst") if c in table.columns), [0] * len(table))
        for at, stamp, sensor in zip(table.place.tolist(), stamps.tolist(), which, strict=True):
            whole = content[at : at + size]
            if name == "PARM" and not any(whole[11:27].startswith(p) for p in _PARAMETERS):
                continue
            inside = chosen.start <= stamp <= chosen.stop or (told and stamp < chosen.start)
            if not inside or (name in ("VIBE", "XKF1", "XKF4") and sensor):
                continue
            if not told and stamp - last.get(sensor, -ALL) < 0.9 / rate:
                continue
            last[sensor] = stamp
            taken.append((at, whole))
    head = []
    for kind in kinds:
        if kind.name in used and kind.at.size:
            head += [content[at : at + 89] for at in _described(content, kind.number)]
            head += _units(content, kinds, kind.number)
    return b"".join(head) + b"".join(whole for _, whole in sorted(taken))


def _described(content: bytes, number: int) -> list[int]:
    """Where the first FMT message of a type stands."""
    at = content.find(dataflash_index.HEAD + bytes([dataflash_index.FMT, number]))
    return [at] if at >= 0 else []


def _units(content: bytes, kinds: Sequence[dataflash_index.MessageKind], number: int) -> list[bytes]:
    """The FMTU message that gives a type its units."""
    kind = next((k for k in kinds if k.name == "FMTU"), None)
    if kind is None:
        return []
    size = kind.dtype.itemsize + 3
    return [content[at : at + size] for at in kind.at.tolist() if content[at + 11] == number][:1]


# ---- the flight without a sweep --------------------------------------------------------------------------------------
LOUD = 5.2  # the gain of the pitch loop there, against its own
SECONDS, STEP, EVERY, BEGIN = 70.0, 1.0 / 400.0, 4, 60.0
OSCILLATES, SHAKES = (40.0, 47.0), (58.0, 64.0)
"""s from the beginning: the pitch loop's gain is too high, and a blade is out of track."""
_C = {"Q": "Q", "B": "B", "M": "B", "f": "f", "h": "h", "H": "H", "n": "4s", "N": "16s", "Z": "64s", "c": "h", "C": "H"}
_C |= {"L": "i"}
_FORMATS = {
    "PARM": (32, "QNff", "TimeUS,Name,Value,Default"),
    "MSG": (33, "QZ", "TimeUS,Message"),
    "MODE": (34, "QMBB", "TimeUS,Mode,ModeNum,Rsn"),
    "RATE": (75, "Qffffffffffff", "TimeUS,RDes,R,ROut,PDes,P,POut,YDes,Y,YOut,ADes,A,AOut"),
    "ATT": (72, "QccccCC", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw"),
    "VIBE": (73, "QBffff", "TimeUS,IMU,VibeX,VibeY,VibeZ,Clip"),
    "BAT": (74, "QBff", "TimeUS,Inst,Volt,Curr"),
    "GPS": (76, "QBBBfLLff", "TimeUS,I,Status,NSats,HDop,Lat,Lng,Alt,Spd"),
    "RPM": (77, "QBf", "TimeUS,I,RPM"),
}
_GAINS = {
    "RLL": {"P": 0.20, "I": 0.30, "D": 0.002, "FF": 0.09},
    "PIT": {"P": 0.20, "I": 0.30, "D": 0.002, "FF": 0.09},
    "YAW": {"P": 0.30, "I": 0.30, "D": 0.003, "FF": 0.08},
}
_PLANT = {"RLL": (80.0, 8.0, 0.02, 8), "PIT": (60.0, 6.0, 0.02, 8), "YAW": (35.0, 3.0, 0.03, 8)}
"""Effect [1/s^2], damping [1/s], lag [s] and delay [steps] of each axis."""


def flown(rng: np.random.Generator) -> tuple[Array, dict[str, Array]]:
    """Times [s], and by axis demanded rate, rate [rad/s], command, angle and demanded angle [rad], shape (n, 5)."""
    time = np.arange(round(SECONDS / STEP)) * STEP
    table = {}
    for axis, (effect, damping, lag, late) in _PLANT.items():
        k, rows = _GAINS[axis], np.zeros((time.size, 5))
        p = angle = gust = command = integral = before = smooth = wanted = slope = 0.0
        waiting, stick = [0.0] * late, 0.0
        moves = np.repeat(rng.uniform(-0.28, 0.28, 80) * (rng.random(80) < 0.40), round(1.0 / STEP))
        for i, t in enumerate(time.tolist()):
            stick += STEP * (moves[i] - stick) / 0.15
            gust += -STEP * gust / 0.8 + np.sqrt(STEP) * 1.2 * rng.standard_normal()
            loud = LOUD if axis == "PIT" and OSCILLATES[0] <= t < OSCILLATES[1] else 1.0
            shaken = 0.06 * np.sin(2.0 * np.pi * 25.3 * t) if SHAKES[0] <= t < SHAKES[1] else 0.0
            measured = p + shaken + 0.004 * rng.standard_normal()
            smooth += (1.0 - np.exp(-2.0 * np.pi * 40.0 * STEP)) * (measured - smooth)
            wanted += (1.0 - np.exp(-2.0 * np.pi * 20.0 * STEP)) * (5.0 * (stick - angle) - wanted)
            error = wanted - smooth
            integral = float(np.clip(integral + k["I"] * error * STEP, -0.3, 0.3))
            slope += (1.0 - np.exp(-2.0 * np.pi * 20.0 * STEP)) * ((error - before) / STEP - slope)
            before = error
            asked = loud * (k["P"] * error + k["D"] * slope) + integral + k["FF"] * wanted
            asked = float(np.clip(asked, -1.0, 1.0))
            waiting.append(asked)
            command += STEP * (waiting.pop(0) - command) / lag
            p += STEP * (effect * command - damping * p + gust)
            angle += STEP * p
            rows[i] = wanted, smooth, asked, angle, stick
        table[axis] = rows
    return time, table


def simulated(seed: int = 7) -> bytes:
    """An ordinary flight as a DataFlash log: RATE at 100 Hz, the rest as slowly as autopilots log it."""
    rng = np.random.default_rng(seed)
    time, table = flown(rng)
    out = [_fmt(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")]
    for name, (kind, letters, columns) in _FORMATS.items():
        out.append(_fmt(kind, 3 + struct.calcsize(_c(letters)), name, letters, columns))
    first = round(1e6 * BEGIN)
    out += [_row("MSG", first, "ArduCopter V4.6.0 (simulated)"), _row("MSG", first, "Frame: HELI")]
    for axis, gains in _GAINS.items():
        for name, value in {**gains, "FLTT": 20.0, "FLTE": 0.0, "FLTD": 20.0}.items():
            out.append(_row("PARM", first, f"ATC_RAT_{axis}_{name}", value, value))
    for name, value in {"INS_GYRO_FILTER": 40.0, "SCHED_LOOP_RATE": 400.0, "H_RSC_MODE": 3.0}.items():
        out.append(_row("PARM", first, name, value, value))
    out.append(_row("MODE", first, 0, 0, 2))
    place, degrees = np.zeros(2), {axis: np.degrees(rows) for axis, rows in table.items()}
    for i in range(0, time.size, EVERY):
        t, stamp = float(time[i]), round(1e6 * (BEGIN + time[i]))
        if i == round(30.0 / STEP):
            out.append(_row("MODE", stamp, 5, 5, 1))
        rates = [v for a in _PLANT for v in (*degrees[a][i, :2], table[a][i, 2])]
        out.append(_row("RATE", stamp, *rates, 0.0, 0.0, 0.42 + 0.03 * np.sin(0.4 * t)))
        place += EVERY * STEP * 9.81 * np.array([-table["PIT"][i, 3], table["RLL"][i, 3]]) * 2.0
        if i % 40 == 0:
            angles = [v for a in _PLANT for v in (degrees[a][i, 4], degrees[a][i, 3])]
            centi = [round(100.0 * ((v + 60.0) % 360.0 if k > 3 else v)) for k, v in enumerate(angles)]
            out.append(_row("ATT", stamp, *centi))
        if i % 80 == 0:
            shaken = 42.0 if SHAKES[0] <= t < SHAKES[1] else 6.0
            vibration = shaken * (1.0 + 0.1 * rng.standard_normal(3))
            out.append(_row("VIBE", stamp, 0, *vibration, 0.0))
            lat, lng = 47.3764 + place[0] / 111_195.0, 8.5476 + place[1] / 75_300.0
            degrees7 = (round(1e7 * lat), round(1e7 * lng))
            out.append(_row("GPS", stamp, 0, 3, 14, 0.8, *degrees7, 452.0, float(np.hypot(*place) / 20.0)))
            out.append(_row("RPM", stamp, 0, 1520.0 + 3.0 * rng.standard_normal()))
        if i % 200 == 0:
            out.append(_row("BAT", stamp, 0, 24.6 - 0.02 * t - 0.1 * rng.random(), 28.0 + 2.0 * rng.standard_normal()))
    return b"".join(out)


def _c(letters: str) -> str:
    return "<" + "".join(_C[letter] for letter in letters)


def _fmt(kind: int, length: int, name: str, letters: str, columns: str) -> bytes:
    packed = struct.pack("<BB4s16s64s", kind, length, name.encode(), letters.encode(), columns.encode())
    return dataflash_index.HEAD + bytes([dataflash_index.FMT]) + packed


def _row(name: str, *values: float | str) -> bytes:
    kind, letters, _ = _FORMATS[name]
    packed: Sequence[object] = [v.encode() if isinstance(v, str) else v for v in values]
    return dataflash_index.HEAD + bytes([kind]) + struct.pack(_c(letters), *packed)


def main() -> None:
    folder, total = Path(sys.argv[1]), 0
    OUT.mkdir(exist_ok=True)
    logs = {name: cut((folder / chosen.source).read_bytes(), chosen) for name, chosen in CUTS.items()}
    for name, made in {**logs, "ordinary_flight.bin": simulated()}.items():
        (OUT / name).write_bytes(made)
        total += len(made)
        print(f"{name}: {len(made):,} bytes")
    print(f"together {total:,} bytes")


if __name__ == "__main__":
    main()
