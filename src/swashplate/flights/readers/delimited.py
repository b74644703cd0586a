"""CSV logs: one time column, one column a channel, units in the header (`phi [deg]`) or in a small mapping file.

A mapping file is TOML; with one, only the channels it names are read:

    rate = 50                # optional: Hz, where the table has no time column
    delimiter = ","          # optional: comma, semicolon, tab and (in tables of bare numbers) spaces are told apart
    header = true            # false where the first line is data already; then columns are numbers from 1

    [channels]
    time = {column = "TimeUS", unit = "us"}
    phi = {column = "Roll", unit = "deg"}
    servo_pitch = {column = 7, unit = "1", factor = -0.002, offset = 3.0}

A value inside is (cell * factor + offset), then converted from `unit`. Axes are not turned: a CSV log is expected in
the schema's own axes (NED, FRD), or brought there with factors of -1.

A header's time column is `time` in any case, or `t` where there is none; a column that is nearly a channel's name gets
a note. Time is read digit by digit, so that Unix time in seconds, milliseconds or nanoseconds loses nothing, or as
ISO 8601 (2026-03-05T14:20:01.25Z). `time [s since 2026-03-05T14:20:00Z]` says where zero lies.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from difflib import get_close_matches
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError, UnitError
from swashplate.flights import epoch, units
from swashplate.flights.flight import Flight, stream
from swashplate.flights.readers import checks, clocked, tables
from swashplate.flights.readers.options import Options
from swashplate.flights.readers.source import Source
from swashplate.flights.schema import CHANNELS, LOGGED_UNIT, channel, is_known
from swashplate.registry import nearest

NAME = "csv"
VERSION = "1"

_HEADER_CELL = re.compile(r"^(?P<name>.*?)\s*(?:\[(?P<square>[^\]]*)\]|\((?P<round>[^)]*)\))?$", re.DOTALL)
_TIME_NAMES = ("time", "t")  # in the order in which a header is asked for them; "T" is a temperature
_COLUMN_KEYS = {"column", "unit", "factor", "offset"}
_MAPPING_KEYS = {"delimiter", "header", "channels", "mocap", "rate"}


@dataclass(frozen=True)
class _Column:
    """Where a channel comes from: column index, unit in the file (None: not said), factor and offset before it."""

    index: int
    unit: str | None
    factor: float = 1.0
    offset: float = 0.0


def recognises(source: Source) -> bool:
    """Any text with more than one column; the motion capture exports are asked first."""
    text = source.text
    if text is None or any(mark in text[:65536] for mark in ",;\t"):
        return text is not None
    rows = [line.split() for line in text[:4096].splitlines()[:-1] if line.strip() and not line.startswith("#")]
    return bool(rows) and all(len(row) > 1 and all(map(_is_number, row)) for row in rows)


def _split(cell: str) -> tuple[str, str | None]:
    """Name and unit of a header cell `name [unit]` or `name (unit)`; unit None where there is none."""
    match = _HEADER_CELL.match(cell)
    if match is None:
        return cell, None
    unit = match["square"] if match["square"] is not None else match["round"]
    return match["name"], unit


def _from_header(header: Sequence[str], source: Source) -> dict[str, _Column]:
    columns: dict[str, _Column] = {}
    for index, cell in enumerate(header):
        name, unit = _split(cell)
        if not name:
            raise FlightError(
                f"column {index + 1} has no name.", where=source.name, hint="Name it, or use a mapping file."
            )
        if name in columns:
            raise FlightError(
                "the name stands twice in the header.", where=source.name, channel=name, hint="Rename one of them."
            )
        columns[name] = _Column(index, unit)
    stamped = _time_name(columns)
    return {"time" if name == stamped else name: column for name, column in columns.items()}


def _time_name(names: Iterable[str]) -> str | None:
    """The column of a header that holds time: `time`, in other case only where no column is `time`, else `t`."""
    every = list(names)
    others = [name for name in every if name.lower() == "time"]
    asked = [*_TIME_NAMES[:1], *(others if len(others) == 1 else ()), *_TIME_NAMES[1:]]
    return next((name for name in asked if name in every), None)


def _time_hint(names: Iterable[str]) -> str:
    """What to do where no column holds time."""
    like = [
        name for name in names if name.lower() == "t" or get_close_matches(name.lower(), ("time", "timestamp"), n=1)
    ]
    asked = f"Did you mean {' or '.join(map(repr, like))}? " if like else ""
    return f"{asked}Name it 'time [s]' in the header, or in a mapping file."


def _units_of(options: Options, columns: Mapping[str, _Column], header: Sequence[str] | None) -> dict[str, str]:
    """Units by channel; a unit that is given for the time column's own name in the header is the time's."""
    given = dict(options.units)
    own = _time_name(_split(cell)[0] for cell in header or ()) if not options.mapping else None
    if own in given and own not in columns:
        given.setdefault("time", given[own])
        del given[own]
    return given


def _near_misses(names: Iterable[str]) -> tuple[str, ...]:
    """Notes on columns that are no channel of the schema and differ from one by case or by a letter or two."""
    every = list(names)
    absent = [known for known in CHANNELS if known not in every]
    notes = []
    for name in every:
        near = get_close_matches(name.lower(), absent, n=1, cutoff=0.85) if not is_known(name) else []
        if near:
            notes.append(f"column '{name}' is not in the schema and keeps its name; did you mean '{near[0]}'?")
    return tuple(notes)


def _number_of(entry: Mapping[str, Any], key: str, default: float, *, name: str, where: str) -> float:
    value = entry.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FlightError(f"{key} = {value!r} in the mapping is not a number.", where=where, channel=name)
    return float(value)


def _from_mapping(options: Options, header: Sequence[str] | None, source: Source) -> dict[str, _Column]:
    mapping, where = options.mapping, options.mapping_file or source.name
    wanted = mapping.get("channels")
    if not isinstance(wanted, Mapping) or not wanted or set(mapping) - _MAPPING_KEYS:
        raise FlightError(
            f"the mapping must have a table [channels], and beside it only {', '.join(sorted(_MAPPING_KEYS))}; "
            f"found {', '.join(mapping) or 'nothing'}.",
            where=where,
            hint="For example: [channels] time = {column = 't', unit = 'ms'}.",
        )
    places: dict[str, int] = {}
    for index, cell in enumerate(header or ()):
        places.setdefault(cell, index)
        places.setdefault(_split(cell)[0], index)
    columns: dict[str, _Column] = {}
    for name, entry in wanted.items():
        if not isinstance(entry, Mapping) or set(entry) - _COLUMN_KEYS or "column" not in entry:
            raise FlightError(
                f"the mapping says {entry!r}, expected column, unit and if needed factor and offset.",
                where=where,
                channel=name,
                hint=f"For example: {name} = {{column = 'Roll', unit = 'deg'}}.",
            )
        place = entry["column"]
        index = place - 1 if isinstance(place, int) else places.get(place, -1) if isinstance(place, str) else -1
        if index < 0:
            raise FlightError(
                f"there is no column {place!r}; the file has {', '.join(header or ()) or 'no header'}.",
                where=source.name,
                channel=name,
                hint="Correct the mapping; columns may also be numbers from 1.",
            )
        unit = entry.get("unit")
        if unit is None and header is not None and index < len(header):
            unit = _split(header[index])[1]
        if unit is not None and not isinstance(unit, str):
            raise UnitError(f"unit = {unit!r} in the mapping is not text.", where=where, channel=name)
        columns[name] = _Column(
            index,
            unit,
            _number_of(entry, "factor", 1.0, name=name, where=where),
            _number_of(entry, "offset", 0.0, name=name, where=where),
        )
    return columns


def _expected(name: str) -> str:
    """The unit inside; "" where anything goes."""
    return "s" if name == "time" else channel(name).unit


def _check_units(columns: Mapping[str, _Column], options: Options, source: Source) -> None:
    """That every channel of the schema has a unit: what is missing is said in one go."""
    lacking = [
        name
        for name, place in columns.items()
        if options.units.get(name, place.unit) is None and _expected(name) not in ("", "1")
    ]
    if lacking:
        name, unit = lacking[0], _expected(lacking[0])
        every = " ".join(f"--unit {each}={_expected(each)}" for each in lacking)
        raise UnitError(
            f"{'has' if len(lacking) == 1 else 'have'} no unit, expected [{'], ['.join(map(_expected, lacking))}] "
            "or what can be converted to it.",
            where=source.name,
            channel=", ".join(lacking),
            hint=f"Write it in the header, as '{name} [{unit}]', or give what it is, as {every} "
            f"(in Python units={{'{name}': '{unit}'}}).",
        )


def _inside(values: Array, name: str, unit: str | None, source: Source) -> tuple[Array, str]:
    """Values and their unit inside; the schema's channels need a unit that fits, others keep a unit nobody knows."""
    expected = _expected(name)
    if unit is None:
        return values, expected
    if not expected and not units.is_known(unit):
        return values, unit
    converted = units.to_inside(values, unit, expected=expected, channel=name, where=source.name)
    return converted, units.inside_unit(unit)


def _table(source: Source, mapping: Mapping[str, Any]) -> tuple[list[str] | None, Sequence[Sequence[str]], int]:
    """Header cells (None without one), rows of data, and the line number of the first row."""
    delimiter = mapping.get("delimiter")
    if delimiter is not None and not (isinstance(delimiter, str) and len(delimiter) == 1):
        raise FlightError(f"delimiter = {delimiter!r} in the mapping is not one character.", where=source.name)
    text, headed = source.text or "", mapping.get("header", True) is not False
    numbers = tables.NumberRows.of(text, delimiter=delimiter)
    if numbers is not None:
        head = tables.rows_of("\n".join(numbers.head), where=source.name, delimiter=numbers.mark)
        if _first(head) + headed == len(head):
            return _names(head[-1]) if headed else None, numbers, len(head) + 1
    rows = tables.rows_of(text, where=source.name, delimiter=delimiter)
    start = _first(rows)
    while len(rows) > start and not any(rows[-1]):
        rows.pop()
    if start == len(rows):
        raise FlightError("holds no table.", where=source.name, hint="Export it again.")
    return (_names(rows[start]) if headed else None), rows[start + headed :], start + headed + 1


def _first(rows: Sequence[Sequence[str]]) -> int:
    """The first row that is neither blank nor a comment."""
    return next((i for i, row in enumerate(rows) if any(row) and not row[0].startswith("#")), len(rows))


def _names(header: list[str]) -> list[str]:
    while header and not header[-1]:
        header = header[:-1]  # a separator at the end of each line
    return header


def read(source: Source, options: Options) -> Flight:
    """A CSV log as a flight with one stream, "log".

    Args:
        source: the file.
        options: `units` by channel where the header has none; `mapping`; `bad_stamps`.

    Raises:
        FlightError, UnitError: naming the file, the channel or line, what was found and what to do.
    """
    header, rows, first_line = _table(source, options.mapping)
    if header is not None and all(_is_number(cell) for cell in header):
        raise FlightError(
            "the first line holds numbers, expected names.",
            where=source.name,
            hint="Add a header such as 'time [s],phi [deg]', or use a mapping file with header = false.",
        )
    columns = _from_mapping(options, header, source) if options.mapping else _from_header(header or [], source)
    options = replace(options, units=_units_of(options, columns, header))
    rate = options.mapping.get("rate")
    if rate is not None and (isinstance(rate, bool) or not isinstance(rate, int | float) or not 0.0 < rate < np.inf):
        raise FlightError(f"rate = {rate!r} in the mapping is not a positive number.", where=source.name)
    if "time" not in columns and rate is None:
        raise FlightError(
            f"there is no time column; found {', '.join(columns) or 'nothing'}.",
            where=source.name,
            channel="time",
            hint=_time_hint(columns),
        )
    unknown = set(options.units) - set(columns)
    if unknown:
        raise UnitError(
            f"units are given for a column that the file lacks; it has {', '.join(columns)}.",
            where=source.name,
            channel=", ".join(sorted(unknown)),
            hint=nearest(min(unknown), columns) or "Correct the name that the unit is given for.",
        )
    iso = "time" in columns and bool(rows) and _is_date(rows[0], columns["time"].index)
    _check_units({name: c for name, c in columns.items() if not (iso and name == "time")}, options, source)
    width = max(column.index for column in columns.values()) + 1
    short = tables.first_shorter(rows, width)
    if short is not None:
        cells = len(rows[short])
        raise FlightError(
            f"line {first_line + short} has {cells} cell{'s' * (cells != 1)}, expected {width}.",
            where=source.name,
            hint="The line is cut off: remove or complete it.",
        )
    channels: dict[str, Array] = {}
    labels: dict[str, str] = {}
    time, zero = np.arange(len(rows)) / float(rate or 1.0), 0.0
    for name, place in columns.items():
        if name == "time":
            unit = options.units.get(name, place.unit)
            time, zero = _time(rows, place, unit=unit, source=source, first_line=first_line)
            continue
        raw = tables.column(rows, place.index, name=name, where=source.name, first_line=first_line)
        checks.finite(raw, channel=name, where=source.name)
        with np.errstate(over="ignore"):  # what overflows is refused below, by name
            scaled = raw if (place.factor, place.offset) == (1.0, 0.0) else raw * place.factor + place.offset
        channels[name], labels[name] = _inside(scaled, name, options.units.get(name, place.unit), source)
        checks.finite(channels[name], channel=name, where=source.name)  # a factor can overflow
    if not channels:
        raise FlightError("there is no channel beside time.", where=source.name, hint="Export the channels too.")
    told = clocked.Told()
    time, keep = clocked.usable(time, channels.values(), where=source.name, bad_stamps=options.bad_stamps, told=told)
    channels = {name: values[keep] for name, values in channels.items()}
    foreign = {name: labels[name] for name in channels if not is_known(name)}
    notes = (*told.notes, *_near_misses(channels), *checks.constant_notes(channels))
    log = stream(time, channels, foreign)
    for name in channels:
        unit = options.units.get(name, columns[name].unit)
        if unit and unit != log[name].attrs.get("units"):
            log[name].attrs[LOGGED_UNIT] = unit
    return Flight(
        streams={"log": log},
        provenance=source.provenance(NAME, VERSION, notes=notes, damage=tuple(told.damage), epoch=zero),
    )


_SINCE = re.compile(r"(?P<unit>\S+)\s+since\s+(?P<zero>.+)")


def _is_date(row: Sequence[str], index: int) -> bool:
    return index < len(row) and epoch.from_iso(row[index]) is not None


def _time(
    rows: Sequence[Sequence[str]], place: _Column, *, unit: str | None, source: Source, first_line: int
) -> tuple[Array, float]:
    """Stamps [s] without a lost digit, shape (n,), and time zero on the file's clock [s]."""
    if rows and _is_date(rows[0], place.index):
        dates = [epoch.from_iso(cell) for cell in tables.texts(rows, place.index)]
        if None in dates:
            bad = dates.index(None)
            raise FlightError(
                f"'{rows[bad][place.index][:40]}' in line {first_line + bad} is no date and time in ISO 8601, as the "
                "first stamp is.",
                where=source.name,
                channel="time",
                hint="Write all stamps in one way, as 2026-03-05T14:20:01.25Z.",
            )
        return epoch.small([date for date in dates if date is not None])
    raw = tables.column(rows, place.index, name="time", where=source.name, first_line=first_line)
    checks.finite(raw, channel="time", where=source.name)
    since = _SINCE.fullmatch(unit or "")
    zero = epoch.from_iso(since["zero"]) if since else Decimal(0)
    if zero is None:
        raise UnitError(
            f"unit is '{unit}', expected 'UNIT since' and a date and time in ISO 8601.",
            where=source.name,
            channel="time",
            hint="For example: time [s since 2026-03-05T14:20:00Z].",
        )
    with np.errstate(over="ignore"):  # what overflows is refused below, by name
        rough, _ = _inside(raw * place.factor + place.offset, "time", since["unit"] if since else unit, source)
    checks.finite(rough, channel="time", where=source.name)
    if not rows or not epoch.zero_of(float(rough[0])):
        return rough, float(zero)
    scale = Decimal(repr(float(units.to_inside(1.0, (since["unit"] if since else unit) or "s"))))
    factor, offset = Decimal(repr(place.factor)), Decimal(repr(place.offset))
    stamps = map(Decimal, tables.texts(rows, place.index))
    as_written = factor == scale == 1 and offset == 0  # the products of a million stamps are not free
    times, first = epoch.small([*stamps] if as_written else [(stamp * factor + offset) * scale for stamp in stamps])
    return times, float(first + zero)


def _is_number(cell: str) -> bool:
    try:
        tables.number(cell)
    except ValueError:
        return False
    return True
