"""MATLAB files of any layout as tables: variables, fields of structs and columns of matrices are columns.

A field is called `log.p`, that of an array of structs `signals(2).values`, a cell's part `data{1}`, a matrix's column
`u(:,1)`, its row `y(1,:)`, as in MATLAB. Variables called as the schema's
channels are those channels; others are named in a mapping. A CoaX-56 record has a reader of its own (`coax56`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.flights.readers import coax56, mat, mat_objects, table_time
from swashplate.flights.readers.clocked import Remarks
from swashplate.flights.readers.options import Options
from swashplate.flights.readers.source import Source
from swashplate.flights.readers.table_flight import flight_of
from swashplate.flights.schema import is_known

NAME = "mat"
VERSION = "1"

_MOST = 2000  # columns: a matrix with more is a picture


@dataclass(frozen=True)
class MatTable:
    """Arrays of one length as a table's columns.

    Attributes:
        where, header, lines, remarks, aliases: as in `ColumnTable`.
        columns: numbers by column, shape (n,) each.
    """

    where: str
    header: Sequence[str]
    columns: Sequence[Array]
    aliases: Mapping[str, int]
    units: Sequence[str] = ()
    remarks: Remarks = field(default_factory=Remarks)

    def __len__(self) -> int:
        return len(self.columns[0]) if self.columns else 0

    @property
    def width(self) -> int:
        return len(self.columns)

    @property
    def lines(self) -> Sequence[int]:
        return range(1, len(self) + 1)

    def numbers(self, index: int, *, name: str) -> Array:
        """A column's numbers."""
        return self.columns[index].copy()

    def texts(self, index: int) -> list[str]:
        """A column's numbers as text, with every digit."""
        return [repr(value) if value == value else "" for value in self.columns[index].tolist()]

    def first(self, index: int) -> str:
        """The column's first number as text."""
        return next((repr(value) for value in self.columns[index].tolist() if value == value), "")


def recognises(source: Source) -> bool:
    """A MATLAB file, or one that says it is: then what is wrong with it is explained."""
    content = source.content
    return mat.is_level_5(content) or mat.is_version_7_3(content) or source.path.suffix.lower() == ".mat"


def read(source: Source, options: Options) -> Flight:
    """A MATLAB file as a flight: a CoaX-56 record as such, any other by the names of its variables or by a mapping.

    Args:
        source: the `.mat` file.
        options: `units` by channel (of a CoaX-56 record by field), `mapping`, `bad_stamps`.

    Raises:
        FlightError, UnitError: naming the file, every variable that is wrong, what was found and what to do.
    """
    variables = mat.load(source)
    if not options.mapping and coax56.is_record(variables):
        return coax56.read(variables, source, options)
    return flight_of(_table(variables, source, options), source, options, reader=NAME, version=VERSION)


def table_of(source: Source, options: Options) -> MatTable:
    """A MATLAB file's arrays as a table.

    Raises:
        FlightError: where it cannot be read, or holds no numbers.
    """
    return _table(mat.load(source), source, options)


def _table(variables: Mapping[str, Any], source: Source, options: Options) -> MatTable:
    remarks = Remarks()
    arrays: dict[str, Array] = {}
    strange: list[str] = []
    objects: dict[str, str] = {}
    for path, value in _flat(variables):
        numbers = mat.numbers(value)
        if numbers is not None and numbers.size and numbers.ndim <= 3:
            arrays[path] = np.atleast_1d(numbers)
        else:
            strange.append(f"{path} ({value.what})" if isinstance(value, mat.Unread) else path)
            objects |= {path: value.kind} if isinstance(value, mat.Unread) else {}
    line = mat_objects.to_type(objects, source.name)
    if not arrays:
        raise FlightError(
            f"holds {', '.join(strange) or 'nothing'}; expected arrays of numbers: time, and one for each channel.",
            where=source.name,
            hint=f"Type in MATLAB: {line}" if line else "Save the numbers themselves: texts and the like are not read.",
        )
    names = _names(list(arrays))
    n = _length(arrays, names, options)
    columns: dict[str, Array] = {}
    for path, numbers in arrays.items():
        columns |= _columns(path, numbers, n)
    lost = [path for path in arrays if not any(c == path or c.startswith(f"{path}(") for c in columns)]
    for what, why in ((lost, f"not {n} numbers long"), (strange, "no array of numbers")):
        if what:
            remarks.notes.append(f"{', '.join(what)}: {why}: not read")
    if line:
        remarks.notes.append(f"to have them read, type in MATLAB: {line}")
    header = [names.get(path, path) for path in columns]
    aliases = {path: index for index, path in enumerate(columns)}
    return MatTable(source.name, header, list(columns.values()), aliases, remarks=remarks)


def _flat(value: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """What is no struct, by its path of fields."""
    for name, part in value.items():
        path = f"{above}{name}" or "(unnamed)"
        if isinstance(part, dict):
            yield from _flat(part, f"{path}.")
        elif isinstance(part, list) and 0 < len(part) <= _MOST:  # a cell, or an array of structs
            struct = isinstance(part[0], dict)
            yield from _flat({f"{path}({k})" if struct else f"{path}{{{k}}}": one for k, one in enumerate(part, 1)})
        else:
            yield path, part


def _names(paths: Sequence[str]) -> dict[str, str]:
    """The names that stand for paths: a field called as a channel or as time is that, where no other one is."""
    last = {path: path.rpartition(".")[2] for path in paths}
    times = Counter(last.values())
    return {
        path: name
        for path, name in last.items()
        if times[name] == 1 and (is_known(name) or table_time.time_name([name]) is not None)
    }


def _length(arrays: Mapping[str, Array], names: Mapping[str, str], options: Options) -> int:
    """How many samples there are: as many as there are times, or as most arrays have numbers."""
    asked = options.mapping.get("channels", {}).get("time", {})
    wanted = asked.get("column") if isinstance(asked, Mapping) else None
    if wanted is None:
        wanted = table_time.time_name([names.get(path, path) for path in arrays])
    for path, numbers in arrays.items():
        if wanted in (path, names.get(path)):
            return max(numbers.shape)
    return Counter(max(numbers.shape) for numbers in arrays.values()).most_common(1)[0][0]


def _columns(path: str, numbers: Array, n: int) -> dict[str, Array]:
    """An array's columns of n numbers by name; none where it has no such."""
    if numbers.shape == (n,):
        return {path: numbers}
    if numbers.ndim == 2 and numbers.shape[0] == n and numbers.shape[1] <= _MOST:
        return {f"{path}(:,{k})": column for k, column in enumerate(numbers.T, 1)}
    if numbers.ndim == 2 and numbers.shape[1] == n and numbers.shape[0] <= _MOST:
        return {f"{path}({k},:)": row for k, row in enumerate(numbers, 1)}
    if numbers.ndim == 3 and numbers.shape[2] == n and numbers.size <= _MOST * n:  # as Simulink saves matrices
        return {f"{path}({i + 1},{j + 1},:)": numbers[i, j] for i, j in np.ndindex(*numbers.shape[:2])}
    return {}
