"""Every field of every message of a log, listed at once and read when somebody looks at it.

A flight holds what the schema knows. A log holds more: vibration, estimates, the battery's cells, a scheduler's load.
Fields keep the log's own names ("VIBE.VibeX", "XKF4[1].SV") and units, unconverted; their times are the flight's.
"""

from __future__ import annotations

import contextlib
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import FlightError, SwashError
from swashplate.flights.readers import clocked, dataflash, dataflash_text, rosbag, tlog, ulog
from swashplate.flights.readers.ardupilot_events import seconds
from swashplate.flights.readers.dataflash import MessageTable, Wanted
from swashplate.flights.readers.dataflash_index import MessageKind, is_dataflash
from swashplate.flights.readers.source import Places, Source, Stored, open_source
from swashplate.flights.readers.ulog_topics import Topics
from swashplate.flights.stored_column import StoredColumn

_INSTANCES = ("I", "C", "Inst", "Instance", "IMU")
_MOST_INSTANCES, _INSTANCE = 16, "instance"
_FOR_RATE = 1 << 16
"""Messages of which a rate is the median."""
_STAMPS = {"TimeUS": 1e-6, "TimeMS": 1e-3}
_TICKS = {**_STAMPS, "timestamp": 1e-6}
_DESCRIBE = frozenset(("FMT", "FMTU", "UNIT", "MULT", "PARM", "MSG", "FILE"))
_FACTORED = frozenset("cCeEL")


@dataclass(frozen=True)
class LogField:
    """A field: its message with the instance where there are several, its name, unit, and number of samples."""

    message: str
    field: str
    unit: str
    samples: int
    rate: float

    @property
    def name(self) -> str:
        return f"{self.message}.{self.field}"


class LogFields(ABC):
    """The fields of a log.

    Attributes:
        listed: by name.
    """

    listed: Mapping[str, LogField]

    @abstractmethod
    def _samples(self, field: LogField) -> tuple[Places, Array, StoredColumn]:
        """Places in the file, times [s] and values."""

    def read(self, name: str) -> tuple[Array, Array]:
        """As `column`, its values in 64 bits."""
        time, column = self.column(name)
        return time, column.numbers

    def column(self, name: str) -> tuple[Array, StoredColumn]:
        """Strictly increasing times [s] on the log's clock, and values in the log's unit; two runs are never joined.

        Raises:
            FlightError: where there is no such field, or the file has changed.
        """
        if name not in self.listed:
            raise FlightError("is no field of this log.", channel=name)
        place, time, column = self._samples(self.listed[name])
        good = np.isfinite(time)
        (first, last), _ = clocked.longest_run([(place[good], time[good])])
        good &= (place >= first) & (place < last)
        good[good] = clocked.longest_increasing(time[good])
        return (time, column) if good.all() else (time[good], StoredColumn(column.stored[good], *column.factors))


def log_fields(path: Path) -> LogFields | None:
    """The fields of a log; None for a kind of file whose every column is a channel already, or that cannot be read."""
    with contextlib.suppress(SwashError):
        source = open_source(path)
        if ulog.recognises(source):
            return _topics(path, source)
        if is_dataflash(source.stored):
            return _messages(path, source.stored)
        if rosbag.recognises(source):
            return _Decoded(rosbag.fields_of(source))
        if tlog.recognises(source):
            tables = tlog.tables_of(source)
            numbers = {n: (t.place, t.time, tlog.number_columns(t)) for n, t in tables.items()}
            return _Decoded(numbers, {n: t.units for n, t in tables.items()})
        if dataflash_text.is_dataflash_text(source.text):
            texts = dataflash_text.messages(source.text or "").tables
            return _Decoded({name: _columns(table) for name, table in texts.items() if name not in _DESCRIBE})
    return None


def _rate(time: Array) -> float:
    steps = np.diff(time[np.isfinite(time)])
    return round(1.0 / float(np.median(steps)), 1) if steps.size and np.median(steps) > 0.0 else 0.0


# ---- DataFlash: what stands where is kept, the numbers stay in the file ----------------------------------------------
@dataclass(frozen=True)
class _Part:
    """The messages of one kind, or of one instance of it: places in the file, stamp and factor of it, units, factors.

    A message without a stamp has that of the last message TIME before it (PX4 of old).
    """

    kind: MessageKind
    at: Places
    stamp: str
    units: Mapping[str, tuple[str, float]]


class _Binary(LogFields):
    def __init__(self, path: Path, content: Stored, parts: Mapping[str, _Part], clock: MessageKind | None) -> None:
        self._path, self._state = path, _state(path)
        self._parts, self._clock = parts, clock
        rates = self._rates(content)
        fields = [
            LogField(name, field, part.units.get(field, ("", 1.0))[0], part.at.size, rates[name])
            for name, part in self._parts.items()
            for field in part.kind.factors
            if part.kind.place(field)[0].kind in "fiu"
            and field != part.stamp
            and field not in _STAMPS
            and part.units.get(field, ("",))[0] != _INSTANCE
        ]
        self.listed = {field.name: field for field in fields}

    def _rates(self, content: Stored) -> dict[str, float]:
        """Rate of each part [Hz], from messages in the middle of it."""
        middle = {}
        for name, part in self._parts.items():
            begin = max(0, part.at.size - _FOR_RATE) // 2
            middle[name] = replace(part, at=part.at[begin : begin + _FOR_RATE])
        return {name: _rate(time) for name, time in zip(middle, self._times(content, [*middle.values()]), strict=True)}

    def _times(self, content: Stored, parts: Sequence[_Part]) -> list[Array]:
        """Times of the messages of parts [s]."""
        wanted = [Wanted(part.kind, part.at, [part.stamp] if part.stamp else []) for part in parts]
        clock = self._clock
        if clock is not None:
            wanted.append(Wanted(clock, clock.at, ["StartTime"]))
        stamps = dataflash.decoded(content, wanted)
        times = []
        for part, stored in zip(parts, stamps, strict=False):
            if part.stamp:
                times.append(np.asarray(stored[part.stamp], dtype=np.float64) * _TICKS[part.stamp])
                continue
            assert clock is not None
            before = np.searchsorted(clock.at, part.at) - 1
            start = np.asarray(stamps[-1]["StartTime"], dtype=np.float64) * 1e-6
            # Messages between two of TIME share a stamp: each but the first of its kind is left out by `read`.
            times.append(np.where(before >= 0, start[np.maximum(before, 0)], np.nan))
        return times

    def _samples(self, field: LogField) -> tuple[Places, Array, StoredColumn]:
        if _state(self._path) != self._state:
            raise FlightError("has changed since it was opened.", where=self._path, hint="Open it again.")
        part = self._parts[field.message]
        content = open_source(self._path).stored
        (time,) = self._times(content, [part])
        (values,) = dataflash.decoded(content, [Wanted(part.kind, part.at, [field.field])])
        factors = (part.kind.factors[field.field], part.units.get(field.field, ("", 1.0))[1])
        return part.at, time, StoredColumn(values[field.field], *factors)


def _messages(path: Path, content: Stored) -> _Binary:
    """The fields of a DataFlash log."""
    kinds = {kind.name: kind for kind in reversed(dataflash.kinds(content)) if kind.at.size}
    units = _units(content, kinds)
    shown = {name: kind for name, kind in kinds.items() if name not in _DESCRIBE}
    sensors = _sensors(content, shown, units)
    clock = kinds.get("TIME")
    clock = clock if clock is not None and "StartTime" in clock.factors else None
    parts = dict[str, _Part]()
    for name, kind in shown.items():
        stamp = next((stamp for stamp in _STAMPS if stamp in kind.factors), "")
        if not stamp and clock is None:
            continue
        for which, at in sensors[name]:
            called = name if which is None else f"{name}[{which}]"
            parts[called] = _Part(replace(kind, at=at), at, stamp, units.get(name, {}))
    return _Binary(path, content, parts, clock)


def _topics(path: Path, source: Source) -> LogFields:
    """Every topic of a ULog file."""
    topics = [one for one in Topics(source.stored, source.name).topics if "timestamp" in one.kind.factors]
    several = {one.name for one in topics if one.instance}
    named = {f"{one.name}[{one.instance}]" if one.name in several else one.name: one for one in topics}
    if all(one.content is source.stored for one in topics):
        parts = {name: _Part(one.kind, one.kind.at, "timestamp", {}) for name, one in named.items()}
        return _Binary(path, source.stored, parts, None)
    columns = dict[str, Columns]()
    for name, one in named.items():
        table = dataflash.gathered(one.content, one.kind)
        values = {field: table.columns[field] for field in one.kind.factors if field != "timestamp"}
        columns[name] = (table.place, table.number("timestamp") * 1e-6, values)
    return _Decoded(columns)


def _state(path: Path) -> tuple[int, int]:
    try:
        state = path.stat()
    except OSError:
        return (0, 0)
    return state.st_size, state.st_mtime_ns


def _sensors(
    content: Stored, kinds: Mapping[str, MessageKind], units: Mapping[str, Mapping[str, tuple[str, float]]]
) -> dict[str, list[tuple[int | None, Places]]]:
    """The messages of each sensor or core by kind, where the log tells several apart; else all of them."""
    telling = {}
    for name, kind in kinds.items():
        instances = [field for field, (unit, _) in units.get(name, {}).items() if unit == _INSTANCE]
        telling[name] = (instances or [field for field in _INSTANCES if field in kind.factors])[:1]
    numbers = dataflash.decoded(content, [Wanted(kind, kind.at, telling[name]) for name, kind in kinds.items()])
    sensors_of: dict[str, list[tuple[int | None, Places]]] = {}
    for (name, kind), fields in zip(kinds.items(), numbers, strict=True):
        sensors_of[name] = [(None, kind.at)]
        for stored in fields.values():
            sensors = np.unique(stored)
            if 1 < sensors.size <= _MOST_INSTANCES:
                sensors_of[name] = [(int(which), kind.at[stored == which]) for which in sensors.tolist()]
    return sensors_of


def _units(content: Stored, kinds: Mapping[str, MessageKind]) -> dict[str, dict[str, tuple[str, float]]]:
    """Unit and factor by message and field, as the log's own messages FMTU, UNIT and MULT give them."""
    if not {"FMT", "FMTU", "UNIT", "MULT"} <= kinds.keys() | {"FMT"} or "FMTU" not in kinds:
        return {}
    tables = {name: dataflash.gathered(content, kinds[name]) for name in ("FMTU", "UNIT", "MULT") if name in kinds}
    label = _letters(tables.get("UNIT"), "Label")
    factor = _letters(tables.get("MULT"), "Mult")
    by_message: dict[str, dict[str, tuple[str, float]]] = {}
    numbered = {kind.number: kind for kind in kinds.values()}
    table = tables["FMTU"]
    for number, units, factors in zip(
        table.number("FmtType").tolist(), table.text("UnitIds"), table.text("MultIds"), strict=True
    ):
        kind = numbered.get(int(number))
        if kind is None:
            continue
        row = {}
        for field, unit, scale in zip(kind.factors, units, factors, strict=False):
            times = 1.0 if kind.letters.get(field, "") in _FACTORED else _number(factor.get(scale, "1"))
            row[field] = (label.get(unit, "") if unit != "#" else _INSTANCE, times)
        by_message[kind.name] = row
    return by_message


def _letters(table: MessageTable | None, column: str) -> dict[str, str]:
    if table is None:
        return {}
    texts = table.text(column) if column == "Label" else [repr(value) for value in table.number(column).tolist()]
    return {chr(int(code)): text for code, text in zip(table.number("Id").tolist(), texts, strict=True) if code > 0}


def _number(text: str) -> float:
    value = float(text)
    return value if np.isfinite(value) and value > 0.0 else 1.0


# ---- logs that are decoded as a whole --------------------------------------------------------------------------------
Columns = tuple[Places, Array, Mapping[str, NDArray[Any]]]


class _Decoded(LogFields):
    def __init__(self, messages: Mapping[str, Columns], units: Mapping[str, Mapping[str, str]] | None = None) -> None:
        self._messages = messages
        fields = [
            LogField(name, field, (units or {}).get(name, {}).get(field, ""), time.size, _rate(time))
            for name, (_, time, columns) in messages.items()
            for field in columns
        ]
        self.listed = {field.name: field for field in fields}

    def _samples(self, field: LogField) -> tuple[Places, Array, StoredColumn]:
        place, time, columns = self._messages[field.message]
        return place, time, StoredColumn(np.asarray(columns[field.field]))


def _columns(table: MessageTable) -> Columns:
    numbers = {n: v for n, v in table.columns.items() if v.dtype.kind in "fiu" and v.ndim == 1 and n not in _STAMPS}
    return table.place, seconds(table), {name: np.asarray(v, dtype=np.float64) for name, v in numbers.items()}
