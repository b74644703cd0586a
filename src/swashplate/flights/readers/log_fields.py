"""Every field of every message of a log, listed at once and read when somebody looks at it.

A flight holds what the schema knows. A log holds more: vibration, estimates, the battery's cells, a scheduler's load.
Fields keep the log's own names ("VIBE.VibeX", "XKF4[1].SV") and units, unconverted; their times are the flight's.
"""

from __future__ import annotations

import contextlib
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.errors import FlightError, SwashError
from swashplate.flights.readers import clocked, dataflash, dataflash_text, rosbag, tlog, ulog
from swashplate.flights.readers.ardupilot_events import seconds
from swashplate.flights.readers.dataflash import MessageKind, MessageTable
from swashplate.flights.readers.source import open_source

_INSTANCES = ("I", "C", "Inst", "Instance", "IMU")
_MOST_INSTANCES, _INSTANCE = 16, "instance"
_STAMPS = {"TimeUS": 1e-6, "TimeMS": 1e-3}
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
    def _samples(self, field: LogField) -> tuple[NDArray[np.int64], Array, Array]:
        """Places in the file, times [s] and values."""

    def read(self, name: str) -> tuple[Array, Array]:
        """Strictly increasing times [s] on the log's clock, and values in the log's unit; two runs are never joined.

        Raises:
            FlightError: where there is no such field, or the file has changed.
        """
        if name not in self.listed:
            raise FlightError("is no field of this log.", channel=name)
        place, time, values = self._samples(self.listed[name])
        good = np.isfinite(time)
        place, time, values = place[good], time[good], values[good]
        (first, last), _ = clocked.longest_run([(place, time)])
        inside = (place >= first) & (place < last)
        time, values = time[inside], values[inside]
        keep = clocked.longest_increasing(time)
        return time[keep], values[keep]


def log_fields(path: Path) -> LogFields | None:
    """The fields of a log; None for a kind of file whose every column is a channel already, or that cannot be read."""
    with contextlib.suppress(SwashError):
        source = open_source(path)
        if dataflash.is_dataflash(source.content):
            return _Binary(path, source.content)
        if source.content.startswith(ulog.MAGIC):
            return _Decoded(_topics(source.content, source.name))
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
    """The messages of one kind, or of one instance of it: places in the file, times [s], units and factors."""

    kind: MessageKind
    at: NDArray[np.int64]
    time: Array
    units: Mapping[str, tuple[str, float]]


class _Binary(LogFields):
    def __init__(self, path: Path, content: bytes) -> None:
        kinds = {kind.name: kind for kind in reversed(dataflash.kinds(content)) if kind.at.size}
        self._path, self._state = path, _state(path)
        self._parts: dict[str, _Part] = {}
        bytes_ = np.frombuffer(content, np.uint8)
        units = _units(content, kinds)
        clock = _clock(bytes_, kinds)
        for name, kind in kinds.items():
            if name in _DESCRIBE:
                continue
            at = kind.at
            time = _stamped(bytes_, kind, at, clock)
            if time is None:
                continue
            for which, chosen in _instances(bytes_, kind, at, units.get(name, {})):
                called = name if which is None else f"{name}[{which}]"
                self._parts[called] = _Part(kind, at[chosen], time[chosen], units.get(name, {}))
        fields = [
            LogField(name, field, part.units.get(field, ("", 1.0))[0], part.at.size, _rate(part.time))
            for name, part in self._parts.items()
            for field in part.kind.factors
            if _place(part.kind, field)[0].kind in "fiu"
            and field not in _STAMPS
            and part.units.get(field, ("",))[0] != _INSTANCE
        ]
        self.listed = {field.name: field for field in fields}

    def _samples(self, field: LogField) -> tuple[NDArray[np.int64], Array, Array]:
        if _state(self._path) != self._state:
            raise FlightError("has changed since it was opened.", where=self._path, hint="Open it again.")
        part = self._parts[field.message]
        content = np.memmap(self._path, np.uint8, mode="r")
        values = _column(content, part.kind, part.at, field.field)
        return part.at, part.time, values * part.units.get(field.field, ("", 1.0))[1]


def _state(path: Path) -> tuple[int, int]:
    try:
        state = path.stat()
    except OSError:
        return (0, 0)
    return state.st_size, state.st_mtime_ns


def _column(content: NDArray[np.uint8], kind: MessageKind, at: NDArray[np.int64], field: str) -> Array:
    """One field of many messages, without the others."""
    dtype, offset = _place(kind, field)
    cells = content[(at + 3 + offset)[:, None] + np.arange(dtype.itemsize)]
    with np.errstate(invalid="ignore"):  # damaged bytes may be a signalling NaN
        return np.ascontiguousarray(cells).view(dtype)[:, 0].astype(np.float64) * kind.factors[field]


def _place(kind: MessageKind, field: str) -> tuple[np.dtype[np.generic], int]:
    """A field's type, and the bytes before it in the payload."""
    dtype, offset, *_ = dict(kind.dtype.fields or {})[field]
    return dtype, int(offset)


def _stamped(
    content: NDArray[np.uint8], kind: MessageKind, at: NDArray[np.int64], clock: tuple[NDArray[np.int64], Array]
) -> Array | None:
    """Times [s]: the messages' own, or of the last message TIME before each (PX4 of old)."""
    stamp = next((name for name in _STAMPS if name in kind.factors), None)
    if stamp is not None:
        return _column(content, kind, at, stamp) * _STAMPS[stamp]
    place, time = clock
    if not place.size:
        return None
    before = np.searchsorted(place, at) - 1
    # Messages between two of TIME share a stamp: each but the first of its kind is left out by `read`.
    return np.where(before >= 0, time[np.maximum(before, 0)], np.nan)


def _clock(content: NDArray[np.uint8], kinds: Mapping[str, MessageKind]) -> tuple[NDArray[np.int64], Array]:
    kind = kinds.get("TIME")
    if kind is None or "StartTime" not in kind.factors:
        return np.zeros(0, np.int64), np.zeros(0)
    at = kind.at
    return at, _column(content, kind, at, "StartTime") * 1e-6


def _instances(
    content: NDArray[np.uint8], kind: MessageKind, at: NDArray[np.int64], units: Mapping[str, tuple[str, float]]
) -> Sequence[tuple[int | None, NDArray[np.int64]]]:
    """Which messages are of which sensor or core, where the log tells several apart."""
    every = np.arange(at.size)
    instances = [field for field, (unit, _) in units.items() if unit == _INSTANCE]
    names = instances or [field for field in _INSTANCES if field in kind.factors][:1]
    if not names:
        return [(None, every)]
    number = _column(content, kind, at, names[0])
    sensors = np.unique(number)
    if not 1 < sensors.size <= _MOST_INSTANCES:
        return [(None, every)]
    return [(int(which), np.flatnonzero(number == which)) for which in sensors.tolist()]


def _units(content: bytes, kinds: Mapping[str, MessageKind]) -> dict[str, dict[str, tuple[str, float]]]:
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
Columns = tuple[NDArray[np.int64], Array, Mapping[str, Array]]


class _Decoded(LogFields):
    def __init__(self, messages: Mapping[str, Columns], units: Mapping[str, Mapping[str, str]] | None = None) -> None:
        self._messages = messages
        fields = [
            LogField(name, field, (units or {}).get(name, {}).get(field, ""), time.size, _rate(time))
            for name, (_, time, columns) in messages.items()
            for field in columns
        ]
        self.listed = {field.name: field for field in fields}

    def _samples(self, field: LogField) -> tuple[NDArray[np.int64], Array, Array]:
        place, time, columns = self._messages[field.message]
        return place, time, np.asarray(columns[field.field], dtype=np.float64)


def _columns(table: MessageTable) -> Columns:
    numbers = {n: v for n, v in table.columns.items() if v.dtype.kind in "fiu" and v.ndim == 1 and n not in _STAMPS}
    return table.place, seconds(table), {name: np.asarray(v, dtype=np.float64) for name, v in numbers.items()}


def _topics(content: bytes, where: str) -> dict[str, Columns]:
    """Every topic of a ULog file."""
    log = ulog.decoded(content, where)
    several = {data.name for data in log.data_list if data.multi_id}
    topics: dict[str, Columns] = {}
    for data in log.data_list:
        if "timestamp" not in data.data:
            continue
        time = np.asarray(data.data["timestamp"], dtype=np.float64) * 1e-6
        name = f"{data.name}[{data.multi_id}]" if data.name in several else data.name
        topics[name] = (
            np.arange(time.size, dtype=np.int64),
            time,
            {n: v for n, v in data.data.items() if n != "timestamp"},
        )
    return topics
