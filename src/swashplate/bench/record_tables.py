"""The CoaX-56's MATLAB tables as bench records.

`coax56/bench_*.mat` hold one struct each: averaged points, rotor speeds in rpm (mfaessle/coax-control).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.bench.record import BenchRecord
from swashplate.errors import BenchError
from swashplate.flights.readers import mat
from swashplate.flights.readers.source import open_source

_RPM = 2.0 * math.pi / 60.0
_SPEEDS = {"rpmUp": "omega_upper", "rpmLo": "omega_lower"}
_NOT_RECORDED = "not recorded"


def is_table(variables: Mapping[str, Any]) -> bool:
    """Whether a MATLAB file's variables are one struct with `rpmUp` and `rpmLo`."""
    return len(variables) == 1 and all(isinstance(v, dict) and _SPEEDS.keys() <= v.keys() for v in variables.values())


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
    if not is_table(variables):
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
