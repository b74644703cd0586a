"""Which files are bench records, whatever their form, and reading them: one file, a folder, or a data set by name.

A file's content decides, not its name: this project's CSV records, and the CoaX-56's MATLAB tables.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.bench.record import BenchRecord, head_of, read_record
from swashplate.errors import BenchError
from swashplate.flights.datasets import REGISTRY, find, locate
from swashplate.flights.readers import mat
from swashplate.flights.readers.source import Source, open_source

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


def is_bench(path: str | Path) -> bool:
    """Whether a file is a bench record of a form that `read_bench` reads."""
    place = Path(path)
    return place.is_file() and place.stat().st_size > 0 and _form(open_source(place)) != ""


def _form(source: Source) -> str:
    """ "record" or "table"; "" for anything else."""
    if mat.is_level_5(source.content):
        return "table" if is_table(mat.load(source)) else ""
    text = source.text
    return "record" if text is not None and "procedure" in head_of(text[:4096])[0] else ""


def read_bench(path: str | Path) -> BenchRecord:
    """A bench record in any of the forms.

    Raises:
        BenchError: where the file is none, or contradicts its form.
        UnitError, FlightError: as the forms' readers.
    """
    source = open_source(path)
    if _form(source) == "table":
        return replace(read_table(path), sha256=source.sha256)
    if source.text is None:
        raise BenchError(
            "is no bench record.",
            where=source.path.name,
            hint="Known are swashplate's CSV records and the CoaX-56's bench tables (.mat). "
            "Flights are for `swash inspect` and `swash identify`.",
        )
    return replace(read_record(path), sha256=source.sha256)  # which says what a record needs


def read_records(*places: str | Path) -> tuple[BenchRecord, ...]:
    """Records of files, of all CSV and MATLAB files in folders, and of data sets by name, each file once.

    Args:
        places: files, folders, "coax56/bench_input_to_rpm" or the name of a data set ("coax56": its bench files).

    Raises:
        BenchError: where a folder is missing or holds none, or as `read_bench`.
        DatasetError: for a data set's file that is not on this machine.
    """
    files = dict.fromkeys(path.resolve() for place in places for path in _files(place))
    return tuple(read_bench(path) for path in files)


def _files(place: str | Path) -> Sequence[Path]:
    path = Path(place)
    if not path.exists() and path.as_posix() in REGISTRY:
        return list(_of_data_set(path.as_posix()))
    path = locate(place)
    if path.is_file():
        return [path]
    if not path.is_dir():
        raise BenchError("is not a folder and not a file.", where=path, hint="Give the folder with the bench records.")
    paths = sorted(file for file in path.iterdir() if file.suffix.lower() in (".csv", ".mat"))
    if not paths:
        raise BenchError(
            "holds no .csv or .mat file.", where=path, hint="`swash bench simulate DIR` makes records to look at."
        )
    return paths


def _of_data_set(name: str) -> Iterator[Path]:
    files = [file for file, entry in REGISTRY[name].files.items() if entry.kind == "bench"]
    for file in files:
        record = find(name, file)
        if record is None:
            raise BenchError(
                "is not on this machine.", where=f"{name}/{file}", hint=f"Get it with `swash data fetch {name}`."
            )
        yield record
