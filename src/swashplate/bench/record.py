"""Bench records: one CSV file a record, which says in its header which procedures it is for.

    # swashplate bench record
    # procedure: speed_map, thrust
    # air_density: 1.18
    time [s],point [1],motor_lower [1],motor_upper [1],servo_roll [1],servo_pitch [1],voltage [V],...
    0.000,0,0.000,...

Lines before the column heads are `# key: value`: `procedure` is needed; `air_density` [kg/m^3], `rotor_removed` (upper
or lower) and anything else may follow. `point` numbers the measuring points: samples of one number are one steady
measurement, zero is "on the way". With `# averaged: yes` every line is one measuring point, averaged already; it then
needs neither `point` nor `time`. Forces and moments act on the vehicle at its CG in body axes (forward-right-down),
tared so that the weight is not in them: a rotor's thrust is a negative Fz.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from swashplate.arrays import Array
from swashplate.atomic import write_text
from swashplate.errors import BenchError
from swashplate.flights import units
from swashplate.flights.readers.source import open_source

TITLE = "swashplate bench record"

COLUMNS: dict[str, tuple[str, str]] = {
    "time": ("s", "time since the start, on a uniform grid"),
    "point": ("1", "number of the measuring point, 0 while a new one is being reached"),
    "motor_lower": ("1", "lower motor command, 0 to 1"),
    "motor_upper": ("1", "upper motor command, 0 to 1"),
    "servo_roll": ("1", "roll servo command, -1 to 1, positive rolls right"),
    "servo_pitch": ("1", "pitch servo command, -1 to 1, positive pitches nose down"),
    "voltage": ("V", "supply voltage, measured"),
    "omega_lower": ("rad/s", "lower rotor speed (tachometer)"),
    "omega_upper": ("rad/s", "upper rotor speed (tachometer)"),
    "Fx": ("N", "force forward"),
    "Fy": ("N", "force to the right"),
    "Fz": ("N", "force down (thrust is negative)"),
    "Mx": ("N m", "moment that rolls right"),
    "My": ("N m", "moment that pitches nose up"),
    "Mz": ("N m", "moment that yaws nose right"),
    "airspeed_x": ("m/s", "anemometer: speed of the air from the front"),
    "airspeed_y": ("m/s", "anemometer: speed of the air from the right"),
    "bar_alpha": ("rad", "deflection of the stabilizer bar held by a magnet, about body x"),
    "bar_beta": ("rad", "deflection of the stabilizer bar held by a magnet, about body y"),
    "phi": ("rad", "roll angle of the fuselage (motion capture)"),
    "theta": ("rad", "pitch angle of the fuselage (motion capture)"),
    "eta_bar": ("rad", "roll angle of the bar against the local level (motion capture)"),
    "zeta_bar": ("rad", "pitch angle of the bar against the local level (motion capture)"),
}
"""Every column that a record may have, with the unit inside; others are ignored."""

LOADS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")

_FEWEST = 10  # samples
_JITTER = 0.02  # of a sample interval that a stamp may be off the uniform grid


@dataclass(frozen=True)
class BenchRecord:
    """What one run of the bench left.

    Attributes:
        name: the file's name.
        procedures: which procedures it is for.
        channels: columns by name, shape (n,), in the units of `COLUMNS`.
        header: the other lines of the header.
        sha256: of the file's bytes; "" where it has no file.
    """

    name: str
    procedures: tuple[str, ...]
    channels: Mapping[str, Array]
    header: Mapping[str, str] = field(default_factory=dict)
    sha256: str = ""

    def __getitem__(self, name: str) -> Array:
        """A column.

        Raises:
            BenchError: where the record does not have it.
        """
        if name not in self.channels:
            raise BenchError(
                f"the column is missing; the record has {', '.join(self.channels)}.",
                where=self.name,
                channel=name,
                hint=f"{', '.join(self.procedures)} needs '{name} [{COLUMNS[name][0]}]': {COLUMNS[name][1]}.",
            )
        return self.channels[name]

    @property
    def averaged(self) -> bool:
        """Whether every row is one measuring point instead of a sample."""
        return self.header.get("averaged", "no").lower() in ("yes", "true", "1")

    @property
    def dt(self) -> float:
        """Sample interval [s].

        Raises:
            BenchError: where the record has no time base.
        """
        if self.averaged or "time" not in self.channels:
            raise BenchError(
                "has no time base: it is a table of points.",
                where=self.name,
                hint=f"{', '.join(self.procedures)} needs samples at a fixed rate.",
            )
        time = self["time"]
        return float((time[-1] - time[0]) / (time.size - 1))

    def number(self, key: str, default: float) -> float:
        """A number of the header, `default` where it is not there.

        Raises:
            BenchError: where it is no positive number.
        """
        text = self.header.get(key)
        if text is None:
            return default
        try:
            value = float(text.split()[0])
        except (ValueError, IndexError):
            value = float("nan")
        if not 0.0 < value < float("inf"):
            raise BenchError(f"is '{text}', expected a positive number.", where=self.name, channel=key)
        return value


def head_of(text: str) -> tuple[dict[str, str], int]:
    """The `# key: value` lines that a record starts with, and the number of the line after them."""
    header: dict[str, str] = {}
    lines = text.splitlines()
    at = 0
    while at < len(lines) and lines[at].startswith("#"):
        key, colon, value = lines[at].lstrip("# ").partition(":")
        if colon:
            header[key.strip()] = value.strip()
        at += 1
    return header, at


def read_record(path: str | Path) -> BenchRecord:
    """A bench record from its CSV file.

    Raises:
        BenchError: where it is no bench record, names no procedure, or has a gap or a cell that is no number.
        UnitError: where a column's unit is missing or measures something else.
        FlightError: where the file is missing or cannot be read.
    """
    source = open_source(path)
    where = source.path.name
    lines = (source.text or "").splitlines()
    header, at = head_of(source.text or "")
    procedures = tuple(name.strip() for name in header.pop("procedure", "").split(",") if name.strip())
    if not procedures:
        raise BenchError(
            "the header names no procedure.",
            where=where,
            hint=f"A record starts with the lines '# {TITLE}' and '# procedure: NAME'; see `swash bench plan`.",
        )
    if at >= len(lines):
        raise BenchError("there is nothing after the header.", where=where, hint="Record it again.")
    channels = _columns(lines[at], lines[at + 1 :], where=where, first=at + 2)
    record = BenchRecord(where, procedures, channels, header)
    if not record.averaged:
        _check_time(channels, where)
    elif channels:
        channels["point"] = np.arange(1.0, next(iter(channels.values())).size + 1)
    return record


def _columns(heads: str, lines: Sequence[str], *, where: str, first: int) -> dict[str, Array]:
    cells = [cell.strip() for cell in heads.split(",")]
    named = {}
    for place, cell in enumerate(cells):
        name, bracket, unit = cell.partition("[")
        if name.strip() in COLUMNS:
            named[name.strip()] = (place, unit.rstrip("] ") if bracket else "")
    rows = [line for line in lines if line.strip()]
    if len(rows) < _FEWEST:
        raise BenchError(f"has {len(rows)} samples, expected at least {_FEWEST}.", where=where, hint="Record longer.")
    try:
        table = np.loadtxt(io.StringIO("\n".join(rows)), delimiter=",", ndmin=2, dtype=np.float64)
    except ValueError as error:
        message = " ".join(str(error).split())[:160]
        raise BenchError(
            f"does not read as a table of numbers from line {first} on: {message}.",
            where=where,
            hint="Correct the cell; decimals are written with a point, cells are separated by commas.",
        ) from None
    if table.shape[1] != len(cells):
        raise BenchError(f"has {table.shape[1]} numbers a line under {len(cells)} heads.", where=where)
    channels = {}
    for name, (place, unit) in named.items():
        values = table[:, place]
        if not np.isfinite(values).all():
            line = first + int(np.argmin(np.isfinite(values)))
            raise BenchError(f"line {line} is not a finite number.", where=where, channel=name, hint="Record it again.")
        channels[name] = units.to_inside(values, unit, expected=COLUMNS[name][0], channel=name, where=where)
    return channels


def _check_time(channels: Mapping[str, Array], where: str) -> None:
    if "time" not in channels:
        raise BenchError("the column is missing.", where=where, channel="time", hint="Head it 'time [s]'.")
    steps = np.diff(channels["time"])
    dt = float(np.median(steps))
    wrong = np.flatnonzero(np.abs(steps - dt) > max(_JITTER * abs(dt), 2e-9)) if dt > 0.0 else np.array([0])
    if wrong.size:
        raise BenchError(
            f"is not uniform: {steps[wrong[0]]:.4g} s after {channels['time'][wrong[0]]:.4g} s, elsewhere {dt:.4g} s.",
            where=where,
            channel="time",
            hint="Record at a fixed rate, without gaps.",
        )


_DIGITS = {"s": 6, "1": 5, "V": 4, "rad/s": 3, "N": 5, "N m": 6, "m/s": 4, "rad": 6, "W": 3}


def write_record(record: BenchRecord, path: str | Path) -> Path:
    """Write a record as its CSV file, which appears when it is complete; returns the path."""
    head = [f"# {TITLE}", f"# procedure: {', '.join(record.procedures)}"]
    head += [f"# {key}: {value}" for key, value in record.header.items()]
    names = [name for name in COLUMNS if name in record.channels]
    body = io.StringIO()
    np.savetxt(
        body,
        np.column_stack([record.channels[name] for name in names]),
        fmt=[f"%.{_DIGITS[COLUMNS[name][0]]}f" if name != "point" else "%d" for name in names],
        delimiter=",",
    )
    columns = ",".join(f"{name} [{COLUMNS[name][0]}]" for name in names)
    return write_text(path, "\n".join([*head, columns, ""]) + body.getvalue())
