"""Which column of a table is which channel, and in which unit: from the header, or from a mapping.

A cell of the header is a name, with a unit or without: `phi [deg]`, `phi (deg)`, `Querruder %`, `gyroADC[0]`. Digits in
square brackets directly behind a name count the parts of a vector; `mixer_roll [1]` has the unit 1.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

from swashplate.arrays import Array
from swashplate.errors import FlightError, UnitError
from swashplate.flights import units
from swashplate.flights.readers.checks import Faults
from swashplate.flights.readers.options import Options
from swashplate.flights.readers.table_layout import ColumnTable
from swashplate.flights.schema import CHANNELS, channel, is_known

_CELL = re.compile(
    r"(?P<name>.*?)\s*(?:\[(?P<square>[^\]]*)\]|\((?P<round>[^):]*)\)|\s(?P<bare>%|°(?:/s)?))", re.DOTALL
)
_PART = re.compile(r"(?P<stem>.*\S)\[(?P<number>\d+)\]", re.DOTALL)
_COLUMN_KEYS = {"column", "unit", "factor", "offset"}
MAPPING_KEYS = {"delimiter", "header", "channels", "mocap", "rate"}


@dataclass(frozen=True)
class Column:
    """Where a channel comes from: column index, unit in the file (None: not said), factor and offset before it.

    Of time, `date` is the column of its date where that stands beside a time of day.
    """

    index: int
    unit: str | None
    factor: float = 1.0
    offset: float = 0.0
    date: int | None = None


def named_columns(table: ColumnTable) -> list[tuple[str, str | None]]:
    """Name and unit (None: not said) of each column of the header."""
    parts = [match for cell in table.header if (match := _PART.fullmatch(cell))]
    stems = {stem for stem in {m["stem"] for m in parts} if {m["number"] for m in parts if m["stem"] == stem} != {"1"}}
    named = []
    for index, cell in enumerate(table.header):
        part, match = _PART.fullmatch(cell), _CELL.fullmatch(cell)
        name, unit = cell, None
        if match is not None and not (part is not None and part["stem"] in stems):
            name, unit = (
                match["name"],
                next(u for u in (match["square"], match["round"], match["bare"]) if u is not None),
            )
        below = table.units[index].strip("[]()") if index < len(table.units) else ""
        named.append((name, (unit or below or None)))
    return named


def from_header(table: ColumnTable, faults: Faults) -> dict[str, Column]:
    """A column for each name of the header; one without a name is passed over, and said."""
    columns: dict[str, Column] = {}
    for index, (name, unit) in enumerate(named_columns(table)):
        if not name:
            if any(table.texts(index)):
                table.remarks.notes.append(f"column {index + 1} has no name: not read")
        elif name in columns:
            faults.add(
                FlightError(
                    "the name stands twice in the header.", where=table.where, channel=name, hint="Rename one of them."
                )
            )
        else:
            columns[name] = Column(index, unit)
    return columns


def from_mapping(options: Options, table: ColumnTable, faults: Faults) -> dict[str, Column]:
    """The columns that a mapping names, by channel.

    Raises:
        FlightError: where the mapping has no table of channels; what is wrong with single channels goes to `faults`.
    """
    mapping, where = options.mapping, options.mapping_file or table.where
    wanted = mapping.get("channels")
    if not isinstance(wanted, Mapping) or not wanted or set(mapping) - MAPPING_KEYS:
        raise FlightError(
            f"the mapping must have a table [channels], and beside it only {', '.join(sorted(MAPPING_KEYS))}; "
            f"found {', '.join(mapping) or 'nothing'}.",
            where=where,
            hint="For example: [channels] time = {column = 't', unit = 'ms'}.",
        )
    named = named_columns(table)
    places = dict(table.aliases)
    for index, (cell, (name, _)) in enumerate(zip(table.header, named, strict=True)):
        places.setdefault(cell, index)
        places.setdefault(name, index)
    columns: dict[str, Column] = {}
    for name, entry in wanted.items():
        with faults.gathered():
            columns[name] = _mapped(name, entry, places, named, table, where)
    return columns


def _mapped(
    name: str,
    entry: object,
    places: Mapping[str, int],
    named: Sequence[tuple[str, str | None]],
    table: ColumnTable,
    where: str,
) -> Column:
    if not isinstance(entry, Mapping) or set(entry) - _COLUMN_KEYS or "column" not in entry:
        raise FlightError(
            f"the mapping says {entry!r}, expected column, unit and if needed factor and offset.",
            where=where,
            channel=name,
            hint=f"For example: {name} = {{column = 'Roll', unit = 'deg'}}.",
        )
    asked = entry["column"]
    pair = isinstance(asked, list) and len(asked) == 2 and name == "time"
    indices = [_index(each, places, table) for each in (asked if pair else [asked])]
    if None in indices:
        listed = ", ".join(table.header) or f"no header and {table.width} columns"
        raise FlightError(
            f"there is no column {asked!r}; the file has {listed}.",
            where=table.where,
            channel=name,
            hint="Correct the mapping; columns may also be numbers from 1, and time a pair: ['Date', 'Time'].",
        )
    index = [i for i in indices if i is not None]
    unit = entry.get("unit", named[index[-1]][1] if index[-1] < len(named) else None)
    if unit is not None and not isinstance(unit, str):
        raise UnitError(f"unit = {unit!r} in the mapping is not text.", where=where, channel=name)
    factor, offset = (_number_of(entry, k, d, name=name, where=where) for k, d in (("factor", 1.0), ("offset", 0.0)))
    return Column(index[-1], unit, factor, offset, date=index[0] if pair else None)


def _index(asked: object, places: Mapping[str, int], table: ColumnTable) -> int | None:
    """The column's index; None where there is none."""
    if isinstance(asked, int) and not isinstance(asked, bool):
        return asked - 1 if 1 <= asked <= table.width else None
    return places.get(asked) if isinstance(asked, str) else None


def _number_of(entry: Mapping[str, Any], key: str, default: float, *, name: str, where: str) -> float:
    value = entry.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FlightError(f"{key} = {value!r} in the mapping is not a number.", where=where, channel=name)
    return float(value)


def near_misses(names: Sequence[str]) -> tuple[str, ...]:
    """Notes on columns that are no channel of the schema and differ from one by case or by a letter or two."""
    absent = [known for known in CHANNELS if known not in names]
    notes = []
    for name in names:
        near = get_close_matches(name.lower(), absent, n=1, cutoff=0.85) if not is_known(name) else []
        if near:
            notes.append(f"column '{name}' is not in the schema and keeps its name; did you mean '{near[0]}'?")
    return tuple(notes)


# ---- units -----------------------------------------------------------------------------------------------------------
def check_units(given: Mapping[str, str | None], where: str, faults: Faults) -> None:
    """That every channel of the schema has a unit (None: not said): what is missing is said in one go."""
    lacking = {
        name: channel(name).unit for name, unit in given.items() if unit is None and channel(name).unit not in ("", "1")
    }
    if lacking:
        name, unit = next(iter(lacking.items()))
        every = " ".join(f"--unit {each}={inside}" for each, inside in lacking.items())
        faults.add(
            UnitError(
                f"{'has' if len(lacking) == 1 else 'have'} no unit, expected [{'], ['.join(lacking.values())}] "
                "or what can be converted to it.",
                where=where,
                channel=", ".join(lacking),
                hint=f"Write it behind the name, as '{name} [{unit}]', or give what it is, as {every} "
                f"(in Python units={{'{name}': '{unit}'}}).",
            )
        )


def inside(values: Array, name: str, unit: str | None, *, where: str) -> tuple[Array, str]:
    """Values and their unit inside; the schema's channels need a unit that fits, others keep a unit nobody knows."""
    expected = channel(name).unit
    if unit is None:
        return values, expected
    if not expected and not units.is_known(unit):
        return values, unit
    return units.to_inside(values, unit, expected=expected, channel=name, where=where), units.inside_unit(unit)
