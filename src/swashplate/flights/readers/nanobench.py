"""The NanoBench flights of a Crazyflie 2.1 under motion capture (2026; syediu/nanobench-iros2026).

A CSV file at 100 Hz, joined from several streams by the host's clock: `t` [s, Unix time]; `px py pz` [m] and `vx vy vz`
[m/s] in the room, z up; `qx qy qz qw`; `w*_vicon` [rad/s] in the room; `imu_acc_*` [g] and `imu_gyro_*` [rad/s] in the
body, x forward, y left, z up; `motor_motor_m1..4` 0 to 65535; `pwr_pm_vbat` [V].

Read into NED and FRD. `roll pitch yaw` and what the autopilot estimated, demanded and computed are left out: the
attitude is the quaternion's. What is in the file stays as logged: the delay between motors and motion differs from
flight to flight (0 to 100 ms), the voltage has ten values a second, joined by straight lines.
"""

from __future__ import annotations

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError, UnitError
from swashplate.flights import units
from swashplate.flights.flight import Flight, stream
from swashplate.flights.readers import checks, clocked, frames, tables
from swashplate.flights.readers.checks import Faults
from swashplate.flights.readers.options import Options
from swashplate.flights.readers.source import Source
from swashplate.flights.readers.table_layout import even_rows
from swashplate.flights.schema import POSITION, QUATERNION, RATES

NAME = "nanobench"
VERSION = "1"
VEHICLE = "crazyflie"

_POSITION, _VELOCITY = ("px", "py", "pz"), ("vx", "vy", "vz")
_TURNING = ("wx_vicon", "wy_vicon", "wz_vicon")
_ATTITUDE = ("qw", "qx", "qy", "qz")
_FORCE = ("imu_acc_x", "imu_acc_y", "imu_acc_z")
_GYRO = ("imu_gyro_x", "imu_gyro_y", "imu_gyro_z")
_MOTORS = tuple(f"motor_motor_m{i}" for i in (1, 2, 3, 4))
_VOLTAGE = "pwr_pm_vbat"
_COLUMNS = ("t", *_POSITION, *_ATTITUDE, *_VELOCITY, *_TURNING, *_FORCE, *_GYRO, *_MOTORS, _VOLTAGE)
_MARKS = ("t", "px", "qw", "motor_motor_m1")
"""Columns by which such a file is known; what else is missing is said by name."""
_FULL = 65535.0  # the motors' command is a 16-bit share of the battery's voltage
_LARGEST = {"room": 100.0, "cell": 25.0}  # m; V
_NOTES = (
    "streams were joined by the host's clock: motors lead the motion by a delay that is each flight's own (0-100 ms)",
    "the voltage has ten values a second, joined by straight lines",
    "motor_1..4 are shares of the battery's voltage (65535 = 1); they saturate at 1",
    "logged_vx.. and logged_wx.. are the file's smoothed velocities and turning in the room's axes",
    "x y z is the tracked point, not the centre of gravity",
    "flown by a feedback controller; the heading hardly moves",
)


def recognises(source: Source) -> bool:
    """A table with the columns that only these files have."""
    head = source.content[:4096].split(b"\n", 1)[0]
    return all(mark.encode() in (cell.strip() for cell in head.split(b",")) for mark in _MARKS)


def read(source: Source, options: Options) -> Flight:
    """A NanoBench flight with the streams "motion", "imu", "inputs" and "battery".

    Args:
        source: the CSV file.
        options: `bad_stamps`.

    Returns:
        "motion": x y z [m], qw qx qy qz, logged_vx.. [m/s, NED], logged_wx.. [rad/s, NED]; "imu": p q r [rad/s], ax ay
        az [m/s^2]; "inputs": motor_1 to motor_4 (0 to 1); "battery": voltage [V].

    Raises:
        FlightError, UnitError: naming the file, the column, what was found and what to do.
    """
    if options.units:
        raise UnitError("units are known for this file and cannot be given.", where=source.name, channel="units")
    remarks = clocked.Remarks()
    columns = _columns(source, remarks)
    time, keep = clocked.usable(
        columns["t"], columns.values(), where=source.name, bad_stamps=options.bad_stamps, remarks=remarks, channel="t"
    )
    columns = {name: values[keep] for name, values in columns.items()}
    _plausible(columns, source)
    down = frames.axes("north-west-up")

    def turned(names: tuple[str, ...]) -> Array:
        return frames.to_local(np.stack([columns[name] for name in names], axis=1), down).T

    logged = np.stack([columns[name] for name in _ATTITUDE], axis=1)
    notes = (*_NOTES, *checks.quaternion_notes(logged, channel="qw", where=source.name))
    motion = dict(zip(POSITION, turned(_POSITION), strict=True))
    motion |= zip(QUATERNION, frames.attitude(logged, world=down, body=down).T, strict=True)
    twist = dict(zip(("logged_vx", "logged_vy", "logged_vz"), turned(_VELOCITY), strict=True))
    twist |= zip(("logged_wx", "logged_wy", "logged_wz"), turned(_TURNING), strict=True)
    twist_units = {name: "m/s" if name.startswith("logged_v") else "rad/s" for name in twist}
    imu = dict(zip(RATES, turned(_GYRO), strict=True))
    force = units.to_inside(turned(_FORCE), "g", expected="m/s^2", channel=_FORCE[0], where=source.name)
    imu |= zip(("ax", "ay", "az"), force, strict=True)
    motors = {f"motor_{i}": columns[name] / _FULL for i, name in enumerate(_MOTORS, start=1)}
    return Flight(
        streams={
            "motion": stream(time, motion | twist, twist_units),
            "imu": stream(time, imu),
            "inputs": stream(time, motors, dict.fromkeys(motors, "1")),
            "battery": stream(time, {"voltage": columns[_VOLTAGE]}),
        },
        provenance=source.provenance(
            NAME,
            VERSION,
            vehicle=VEHICLE,
            notes=(*notes, *remarks.notes, *checks.constant_notes(motors)),
            damage=tuple(remarks.damage),
        ),
    )


def _columns(source: Source, remarks: clocked.Remarks) -> dict[str, Array]:
    """The columns that are used, as numbers, every one finite."""
    rows = [row for row in tables.rows_of(source.text or "", where=source.name, delimiter=",") if any(row)]
    head = rows[0] if rows else []
    missing = [name for name in _COLUMNS if name not in head]
    if missing:
        raise FlightError(
            f"lacks the column(s) {', '.join(missing)} of a NanoBench flight.",
            where=source.name,
            channel=missing[0],
            hint="Download it again; for your own tables say which columns are which with a mapping.",
        )
    wide = len(head)
    data, lines = even_rows(
        rows[1:], range(2, len(rows) + 1), low=wide, high=wide, where=source.name, remarks=remarks, again=[head]
    )
    columns, faults = dict[str, Array](), Faults(source.name)
    for name in _COLUMNS:
        with faults.gathered():
            values = tables.column(data, head.index(name), name=name, where=source.name, lines=lines)
            checks.finite(values, channel=name, where=source.name)
            columns[name] = values
    faults.refuse()
    return columns


def _plausible(columns: dict[str, Array], source: Source) -> None:
    """Refuses magnitudes that show other units than the file's page says."""
    for name, largest, unit in (
        *((name, _LARGEST["room"], "m") for name in _POSITION),
        *((name, _FULL, "of 65535") for name in _MOTORS),
        (_VOLTAGE, _LARGEST["cell"], "V"),
    ):
        top = float(np.max(np.abs(columns[name])))
        if top > largest:
            raise UnitError(
                f"reaches {top:.6g}, expected at most {largest:g} {unit}: wrong units.",
                where=source.name,
                channel=name,
                hint="Is it converted already? Read it as a table with a mapping.",
            )
