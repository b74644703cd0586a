"""Bench records in other people's forms: the CoaX-56's MATLAB tables and the propeller rig's text files.

`coax56/bench_*.mat` hold one struct each: averaged points, rotor speeds in rpm (mfaessle/coax-control).
`coax56/stabilizer_bar_orientation.mat` is a row of directions without a time base. `coax_rig/*.csv` are runs of single
and coaxial propeller pairs (Aeronavics/coax-testrig): a line with the time, a line of heads, and five samples for each
step of the pulse width; thrust is in kilograms, and the file's name says what turns.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.bench.record import BenchRecord
from swashplate.errors import BenchError
from swashplate.flights.readers import mat, tables
from swashplate.flights.readers.source import open_source

_RPM = 2.0 * math.pi / 60.0
_IDLE = 1.0
"""Ampere that a motor which stands never draws."""
_GRAVITY = 9.80665
"""m/s^2, exact: what a scale in kilograms is calibrated by."""

_SPEEDS = {"rpmUp": "omega_upper", "rpmLo": "omega_lower"}
_NOT_RECORDED = "not recorded"


def form_of(variables: Mapping[str, Any]) -> str:
    """Which form a MATLAB file's variables have: "table" (a struct with `rpmUp`), "normals" (one row), or ""."""
    if len(variables) != 1:
        return ""
    (value,) = variables.values()
    if isinstance(value, dict):
        return "table" if _SPEEDS.keys() <= value.keys() else ""
    numbers = mat.numbers(value)
    if numbers is None or numbers.size < 3 or numbers.size % 3 or numbers.size != max(numbers.shape):
        return ""
    # Any other row of numbers is no bench record; single bad directions are refused when it is read.
    return "normals" if abs(np.median(_lengths(numbers)) - 1.0) < 0.1 else ""


def _lengths(numbers: Array) -> Array:
    """Lengths of the directions in a row of x, y, z, x, y, z, ..."""
    return np.asarray(np.linalg.norm(np.ravel(numbers).reshape(-1, 3), axis=1))


def read_table(path: str | Path) -> BenchRecord:
    """A CoaX-56 bench table as averaged points: a speed map, speeds against the supply, or the same compensated.

    The speed map is of both motors at the same input, at a supply that was not recorded. Where a table has the
    measured voltage and the helicopter's own reading, the voltage is the measured one.

    Raises:
        BenchError: where the file holds no struct of such columns.
        FlightError: where it cannot be read.
    """
    source = open_source(path)
    variables = mat.load(source)
    where = source.path.name
    if form_of(variables) != "table":
        raise BenchError(
            f"holds {', '.join(variables) or 'nothing'}; expected one struct of columns with rpmUp and rpmLo.",
            where=where,
            hint="Is it one of the files coax56/bench_*.mat?",
        )
    columns: dict[str, Array] = {}
    for name, value in next(iter(variables.values())).items():
        numbers = mat.numbers(value)
        if numbers is None or not np.isfinite(numbers).all():
            raise BenchError("is not a column of numbers.", where=where, channel=name)
        columns[name] = np.ravel(numbers)
    n = columns["rpmUp"].size
    for name, numbers in columns.items():
        if numbers.size not in (1, n):
            raise BenchError(f"has {numbers.size} values, rpmUp has {n}.", where=where, channel=name)
        columns[name] = np.broadcast_to(numbers, (n,)).copy()
    channels = {ours: _RPM * columns[theirs] for theirs, ours in _SPEEDS.items()}
    channels["point"] = np.arange(1.0, n + 1)
    header = {"averaged": "yes"}
    if "input" in columns:
        channels |= {"motor_lower": columns["input"], "motor_upper": columns["input"]}
        return BenchRecord(where, ("speed_map",), channels, {**header, "voltage": _NOT_RECORDED})
    volts = next((name for name in ("measVoltage", "battState") if name in columns), None)
    if volts is None:
        raise BenchError(
            f"has the columns {', '.join(columns)}; expected input, measVoltage or battState.", where=where
        )
    channels["voltage"] = columns[volts]
    if {"inputUp", "inputLo"} <= columns.keys():
        channels |= {"motor_lower": columns["inputLo"], "motor_upper": columns["inputUp"]}
        return BenchRecord(where, ("supply",), channels, header)
    return BenchRecord(where, ("supply_compensated",), channels, header)


def read_normals(path: str | Path) -> BenchRecord:
    """Unit normals of the bar from `stabilizer_bar_orientation.mat`, which has no time base.

    Raises:
        BenchError: where the file holds anything but one row of unit vectors.
        FlightError: where it cannot be read.
    """
    source = open_source(path)
    variables = mat.load(source)
    where = source.path.name
    if form_of(variables) != "normals":
        raise BenchError("does not hold one row of directions.", where=where)
    numbers = mat.numbers(next(iter(variables.values())))
    assert numbers is not None
    normals, length = np.ravel(numbers).reshape(-1, 3), _lengths(numbers)
    if not np.abs(length - 1.0).max() <= 1e-3:
        raise BenchError(
            f"has directions of length {length.min():.3g} to {length.max():.3g}, expected unit vectors.",
            where=where,
            hint="Leave out the samples in which the bar was not tracked.",
        )
    channels = {f"normal_{axis}": normals[:, i].copy() for i, axis in enumerate("xyz")}
    return BenchRecord(where, ("bar_orientation",), channels)


_WHAT_TURNS = re.compile(
    r"(?:.*_)?(?P<maker>[^-_]+)-(?P<upper>[^-]+-[^-]+-[^-]+)-(?P<lower>[^-]+-[^-]+-[^-]+)-#\d+", re.IGNORECASE
)


def is_rig(text: str) -> bool:
    """Whether a text is a run of the propeller rig: the line of heads is its second."""
    return any("Motor PWM" in line for line in text[:2000].splitlines()[:3])


def read_rig(path: str | Path) -> BenchRecord:
    """A run of the propeller rig: pulse width, thrust and electrical power of everything that turns.

    Raises:
        BenchError: where a head is missing or a line is cut off.
        FlightError: where a cell is no number, or the file cannot be read.
    """
    source = open_source(path)
    where = source.path.name
    rows = [row for row in tables.rows_of(source.text or "", where=where, delimiter=",") if any(row)]
    at = next((i for i, row in enumerate(rows) if "Motor PWM" in row), None)
    if at is None or at + 1 >= len(rows):
        raise BenchError("has no line of heads with 'Motor PWM'.", where=where, hint="Is it a run of the coaxial rig?")
    heads, body = rows[at], rows[at + 1 :]
    for i, row in enumerate(body):
        if any(row[len(heads) :]):
            raise BenchError(
                f"line {at + 2 + i} has {len(row)} cells, expected {len(heads)}: its columns may be others.",
                where=where,
                hint="Correct the line, or the line of heads.",
            )
    lines = range(at + 2, at + 2 + len(body))
    columns = {
        head: tables.column(body, i, name=head, where=where, lines=lines) for i, head in enumerate(heads) if head
    }
    for head, values in columns.items():
        if not np.isfinite(values).all():
            line = at + 2 + int(np.argmin(np.isfinite(values)))
            raise BenchError(f"line {line} is blank.", where=where, channel=head, hint="Complete or remove it.")
    thrust = next((name for name in columns if name.startswith("Thrust") and "kg" in name), None)
    pairs = [(n, n.replace("Voltage (V)", "Current (A)")) for n in columns if "Voltage (V)" in n]
    pairs = [(volts, amps) for volts, amps in pairs if amps in columns]
    if thrust is None or not pairs:
        raise BenchError(
            f"has the columns {', '.join(columns)}; expected thrust in kg, and voltages with currents.", where=where
        )
    turning = [(volts, amps) for volts, amps in pairs if columns[amps].max() > _IDLE]
    # A motor that stands draws 10 W for its electronics, which a pair does not have beside its two: left out.
    power = np.sum([columns[volts] * columns[amps] for volts, amps in turning or pairs], axis=0)
    channels = {"pwm": 1e-6 * columns["Motor PWM"], "thrust": columns[thrust] * _GRAVITY, "power": power}
    return BenchRecord(
        where, ("thrust_loss",), channels, {"propellers": str(len(turning)), **_what_turns(source.path.stem)}
    )


def _what_turns(stem: str) -> dict[str, str]:
    """The propellers by the file's name, `[FOLDER_]MAKER-D-KV-PITCH-D-KV-PITCH-#RUN`: zeros for none below."""
    match = _WHAT_TURNS.fullmatch(stem)
    if match is None:
        return {"propeller": re.sub(r"[-_ ]*#?\d+$", "", stem).lower()}
    maker = match["maker"].lower()
    told = {"propeller": f"{maker} {match['upper']}"}
    if match["lower"] != "0-0-0":
        told["propeller_lower"] = f"{maker} {match['lower']}"
    return told
