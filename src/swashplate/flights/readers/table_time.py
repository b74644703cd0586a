"""The time of a table's rows: which column holds it, in which form, and stamps without a lost digit.

Numbers in a unit (`time [ms]`, `Zeit (Unix)`, `time [s since 2026-03-05T14:20:00Z]`), dates and times, times of day, or
a date and a time of day in two columns. Where nobody says the unit of numbers it is the one in which the samples come
at a rate at which flights are logged, if there is just one, and a note says so.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from difflib import get_close_matches

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError, UnitError
from swashplate.flights import epoch, units
from swashplate.flights.readers import checks
from swashplate.flights.readers.clocked import DAY
from swashplate.flights.readers.table_columns import Column
from swashplate.flights.readers.table_layout import ColumnTable

# In the order in which a header is asked for them; "T" is a temperature.
_PLAIN = ("time", "t")
_OTHERS = {
    "timestamp": None, "__time": None, "zeit": None, "temps": None, "tiempo": None, "tempo": None,
    **{f"{stem}{end}": unit for stem in ("time", "time_", "timestamp_")
       for end, unit in (("us", "us"), ("usec", "us"), ("ms", "ms"), ("ns", "ns"))},
}  # fmt: skip
"""Other names of a time column, in small letters, with the unit that is in the name."""
_UNIX = frozenset(("unix", "unix time", "unix timestamp", "unixtime", "epoch", "posix"))
_SINCE = re.compile(r"(?P<unit>\S+)\s+since\s+(?P<zero>.+)")
_TICKS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_RATES = (1.0, 32e3)  # Hz: slower shows no motion of a helicopter, and no autopilot logs faster
_CENTURY = 1e11  # s since 1970 are the year 5138: what is larger counts in smaller units


@dataclass(frozen=True)
class Stamps:
    """Times of a table's rows.

    Attributes:
        time: [s], shape (n,); NaN where the cell is blank.
        zero: time zero on the file's clock [s].
        tick: of the file's counter [s].
        turns: times [s] at which the clock begins anew by itself.
    """

    time: Array
    zero: float = 0.0
    tick: float = 1e-6
    turns: tuple[float, ...] = ()


def time_name(names: Iterable[str]) -> str | None:
    """The column of a header that holds time: `time`, in other case only where no column is `time`, else `t`, else
    one of the names that programs use; None where there is none, or two are as likely."""
    every = list(names)
    others = [name for name in every if name.lower() == "time"]
    asked = [*_PLAIN[:1], *(others if len(others) == 1 else ()), *_PLAIN[1:]]
    if (exact := next((name for name in asked if name in every), None)) is not None:
        return exact
    like = [name for name in every if name.lower() in _OTHERS]
    return like[0] if len(like) == 1 and not others else None


def time_hint(names: Iterable[str]) -> str:
    """What to do where no column holds time."""
    like = [
        name
        for name in names
        if name.lower() == "t"
        or name.lower().startswith("time_")
        or get_close_matches(name.lower(), ("time", "timestamp", "zeit"), n=1)
    ]
    asked = f"Did you mean {' or '.join(map(repr, like))}? " if like else ""
    return (
        f"{asked}Call it 'time', with its unit ('time [s]'), or say in a mapping file which it is: swash inspect FILE "
        "--map guesses it for every column."
    )


def named_unit(name: str) -> str | None:
    """The unit that a time column's name holds, as `TimeUS` does."""
    return _OTHERS.get(name.lower())


def date_beside(name: str, columns: Mapping[str, Column]) -> int | None:
    """The column of dates that stands beside one of times of day, as `Date` beside `Time`."""
    return next((column.index for each, column in columns.items() if each.lower() == "date" and each != name), None)


def stamps(table: ColumnTable, place: Column, unit: str | None) -> Stamps:
    """The stamps of a table.

    Args:
        place: of the time column.
        unit: of its numbers; None where nobody says it.

    Raises:
        FlightError, UnitError: cells that are neither times nor numbers, or a unit that is missing or no unit of time.
    """
    first = table.first(place.index)
    if epoch.of_day(first) is not None and place.date is None:
        times, _ = _parsed(table, table.texts(place.index), epoch.of_day, "time of day", "14:23:00.1")
        return Stamps(times, turns=(DAY,))
    if epoch.is_time(first):
        cells = table.texts(place.index)
        if place.date is not None and epoch.of_day(first) is not None:
            days = table.texts(place.date)
            cells = [f"{day} {cell}" if day and cell else "" for day, cell in zip(days, cells, strict=True)]
        return Stamps(*_parsed(table, cells, epoch.from_text, "date and time", "2026-03-05T14:20:01.25Z"))
    return _counted(table, place, unit)


def _parsed(
    table: ColumnTable, cells: Sequence[str], parse: Callable[[str], Decimal | None], what: str, example: str
) -> tuple[Array, float]:
    """Times [s], NaN where a cell is blank, and time zero [s], of cells of one form."""
    values = [parse(cell) if cell else None for cell in cells]
    wrong = [i for i, (cell, value) in enumerate(zip(cells, values, strict=True)) if cell and value is None]
    if wrong:
        raise FlightError(
            f"'{cells[wrong[0]][:40]}' in line {table.lines[wrong[0]]} is no {what}, as the first stamp is.",
            where=table.where,
            channel="time",
            hint=f"Write all stamps in one way, as {example}.",
        )
    times, zero = epoch.small([value for value in values if value is not None])
    return _spread(times, [value is not None for value in values]), float(zero)


def _spread(times: Array, there: Sequence[bool]) -> Array:
    """Times at the rows that have one, NaN at the others."""
    out = np.full(len(there), np.nan)
    out[np.asarray(there, dtype=np.bool_)] = times
    return out


def _counted(table: ColumnTable, place: Column, unit: str | None) -> Stamps:
    """Stamps that are numbers in a unit."""
    raw = table.numbers(place.index, name="time")
    blank = np.isnan(raw)
    checks.finite(raw[~blank], channel="time", where=table.where)
    since = _SINCE.fullmatch(unit or "")
    zero = epoch.from_iso(since["zero"]) if since else Decimal(0)
    if zero is None:
        raise UnitError(
            f"unit is '{unit}', expected 'UNIT since' and a date and time in ISO 8601.",
            where=table.where,
            channel="time",
            hint="For example: time [s since 2026-03-05T14:20:00Z].",
        )
    counted_in = since["unit"] if since else _unit_of(raw[~blank], unit, table)
    tick = float(units.to_inside(1.0, counted_in, expected="s", channel="time", where=table.where))
    with np.errstate(over="ignore"):  # what overflows is refused below, by name
        rough = (raw * place.factor + place.offset) * tick
    checks.finite(rough[~blank], channel="time", where=table.where)
    if not rough[~blank].size or not epoch.zero_of(float(rough[~blank][0])):
        return Stamps(rough, float(zero), tick)
    scale, factor, offset = (Decimal(repr(value)) for value in (tick, place.factor, place.offset))
    exact = [Decimal(cell) for cell, none in zip(table.texts(place.index), blank.tolist(), strict=True) if not none]
    as_written = factor == scale == 1 and offset == 0  # the products of a million stamps are not free
    times, first = epoch.small(exact if as_written else [(stamp * factor + offset) * scale for stamp in exact])
    return Stamps(_spread(times, (~blank).tolist()), float(first + zero), tick)


def _unit_of(raw: Array, unit: str | None, table: ColumnTable) -> str:
    """The unit of a time column's numbers: as given, by the calendar for Unix time, or by the rate of the samples."""
    if unit is not None and unit.strip().lower() in _UNIX:
        size = float(np.median(np.abs(raw))) if raw.size else 0.0
        return next((name for name, tick in _TICKS.items() if size * tick < _CENTURY), "ns")
    if unit is not None:
        return unit
    steps = np.diff(raw)
    step = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 0.0
    # a step may be so small that its product with a tick is none: its rate is beyond every log's
    rates = {name: 1.0 / max(step * tick, 1e-300) for name, tick in _TICKS.items()} if step else {}
    likely = [name for name, rate in rates.items() if _RATES[0] <= rate <= _RATES[1]]
    if len(likely) != 1:
        may = " or ".join(f"{name} ({rates[name]:.4g} Hz)" for name in likely)
        raise UnitError(
            f"has no unit, expected [s] or what can be converted to it{f'; its steps may be {may}' * bool(may)}.",
            where=table.where,
            channel="time",
            hint="Write it behind the name, as 'time [s]', or give what it is, as --unit time=s (in Python "
            "units={'time': 's'}).",
        )
    table.remarks.notes.append(
        f"time has no unit: taken in {likely[0]}, in which the samples come at {rates[likely[0]]:.4g} Hz; in any other "
        f"it were below {_RATES[0]:g} Hz or above {_RATES[1] / 1e3:g} kHz. If that is wrong, give --unit time=UNIT"
    )
    return likely[0]
