"""Bench records in other people's forms: the CoaX-56's MATLAB tables and the propeller rig's text files.

`coax56/bench_*.mat` hold one struct each, with rotor speeds in rpm (mfaessle/coax-control). `coax_rig/*.csv` are runs
of single and coaxial propeller pairs (Aeronavics/coax-testrig): a line with the time, a line of heads, and five samples
for each step of the pulse width; thrust is in kilograms.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from swashplate.errors import BenchError
from swashplate.flights.flight import Array
from swashplate.flights.readers import mat, tables
from swashplate.flights.readers.source import open_source

_RPM = 2.0 * math.pi / 60.0
_IDLE = 1.0
"""Ampere that a motor which stands never draws."""
_GRAVITY = 9.80665
"""m/s^2, exact: what a scale in kilograms is calibrated by."""


def read_table(path: str | Path) -> dict[str, Array]:
    """The columns of a CoaX-56 bench table; speeds `rpm*` become `omega_upper`, `omega_lower` in rad/s.

    Raises:
        BenchError: where the file holds no single struct of numbers.
        FlightError: where it cannot be read.
    """
    source = open_source(path)
    variables = mat.load(source)
    structs = [value for value in variables.values() if isinstance(value, dict)]
    if len(structs) != 1:
        raise BenchError(
            f"holds {', '.join(variables) or 'nothing'}; expected one struct of columns.",
            where=source.path.name,
            hint="Is it one of the files coax56/bench_*.mat?",
        )
    table = {}
    for name, value in structs[0].items():
        numbers = mat.numbers(value)
        if numbers is None:
            raise BenchError("is not a column of numbers.", where=source.path.name, channel=name)
        turned = {"rpmUp": "omega_upper", "rpmLo": "omega_lower"}.get(name)
        table[turned or name] = np.atleast_1d(numbers * _RPM if turned else numbers)
    return table


def read_normals(path: str | Path) -> Array:
    """Unit normals of the bar, shape (n, 3), from `stabilizer_bar_orientation.mat`, which has no time base."""
    source = open_source(path)
    flat = [numbers for value in mat.load(source).values() if (numbers := mat.numbers(value)) is not None]
    if len(flat) != 1 or flat[0].size % 3:
        raise BenchError("does not hold one row of directions.", where=source.path.name)
    normals = flat[0].reshape(-1, 3)
    length = np.linalg.norm(normals, axis=1)
    if np.abs(length - 1.0).max() > 1e-3:
        raise BenchError(f"has directions of length {length.min():.3g} to {length.max():.3g}.", where=source.path.name)
    return np.asarray(normals)


@dataclass(frozen=True)
class RigRun:
    """One run of the propeller rig.

    Attributes:
        name: the file's name.
        pwm: pulse width [us], shape (n,).
        thrust: of everything that turns [N].
        power: electrical, of everything that turns [W].
        coaxial: True for a pair.
    """

    name: str
    pwm: Array
    thrust: Array
    power: Array
    coaxial: bool


def read_rig(path: str | Path) -> RigRun:
    """A run of the propeller rig.

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
    columns = {
        head: tables.column(body, i, name=head, where=where, first_line=at + 2) for i, head in enumerate(heads) if head
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
    power = np.sum([columns[volts] * columns[amps] for volts, amps in pairs], axis=0)
    turning = [amps for _, amps in pairs if columns[amps].max() > _IDLE]
    return RigRun(where, columns["Motor PWM"], columns[thrust] * _GRAVITY, power, len(turning) > 1)
