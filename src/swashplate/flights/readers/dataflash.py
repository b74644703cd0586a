"""DataFlash containers (ArduPilot's `.bin`, the `.px4log` of early PX4): messages that describe themselves.

The index says where each message stands (`dataflash_index.py`); a field is decoded when somebody asks for it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.flights.readers.dataflash_index import MessageKind, Scan
from swashplate.flights.readers.source import Places, Stored, part
from swashplate.flights.stored_column import StoredColumn

_BLOCKS = (1 << 20, 1 << 23)  # bytes that are decoded at a time: at least, at most; else the log's sixteenth part


@dataclass(frozen=True)
class MessageTable:
    """All messages of one name.

    Attributes:
        columns: numbers, shape (n,), or texts, by field name.
        place: where each message stands in the file: increasing numbers, comparable between tables, shape (n,).
    """

    columns: Mapping[str, NDArray[np.generic]]
    place: Places

    def __len__(self) -> int:
        return len(self.place)

    def number(self, name: str) -> NDArray[np.float64]:
        """A column as numbers, NaN where the field is missing or holds text."""
        values = self.columns.get(name)
        if values is None or values.dtype.kind not in "fiub" or values.ndim != 1:
            return np.full(len(self), np.nan)
        with np.errstate(invalid="ignore"):  # damaged bytes may be a signalling NaN
            return np.asarray(values, dtype=np.float64)

    def stored(self, name: str) -> Array | StoredColumn:
        """A column as numbers, in as few bits as the log has them where it has few."""
        if isinstance(self.columns, _Columns) and name in self.columns:
            values, factor = self.columns.stored(name)
            if values.dtype.kind in "fiu" and values.ndim == 1 and values.dtype.itemsize < 8:
                return StoredColumn(values, factor)
        return self.number(name)

    def text(self, name: str) -> list[str]:
        """A column as texts, empty where the field is missing."""
        values = self.columns.get(name)
        if values is None:
            return [""] * len(self)
        return [v.decode("utf-8", "replace").rstrip("\0") if isinstance(v, bytes) else str(v) for v in values.tolist()]

    def rows(self, chosen: NDArray[np.bool_] | NDArray[np.int64]) -> MessageTable:
        """The messages that are chosen, by mask or index."""
        if isinstance(self.columns, _Columns):
            return MessageTable(self.columns.rows(chosen), self.place[chosen])
        return MessageTable({name: values[chosen] for name, values in self.columns.items()}, self.place[chosen])


@dataclass(frozen=True)
class Messages:
    """What a container holds.

    Attributes:
        tables: by message name.
        notes: what was skipped as every log has it (an unfinished last message, types that are never described).
        damage: what is broken in the file.
    """

    tables: Mapping[str, MessageTable]
    notes: tuple[str, ...] = ()
    damage: tuple[str, ...] = ()

    def get(self, name: str) -> MessageTable | None:
        return self.tables.get(name)


class Wanted(NamedTuple):
    """Fields that are decoded of some messages of a kind."""

    kind: MessageKind
    at: Places
    names: Sequence[str]


def decoded(content: Stored, wanted: Sequence[Wanted]) -> list[dict[str, NDArray[np.generic]]]:
    """Fields as they are stored, by name, of each that is wanted: shape (n,), or (n, k) of a row of numbers.

    The file is gone through once for all of them.
    """
    columns = [
        {name: np.empty((at.size, *dtype.shape), dtype.base) for name in names for dtype in kind.place(name)[:1]}
        for kind, at, names in wanted
    ]
    for which, chosen, records in _blocks(content, wanted):
        for name, array in columns[which].items():
            array[chosen] = records[name]
    return columns


def latest(content: Stored, wanted: Sequence[Wanted], edges: Places) -> NDArray[np.uint64]:
    """The largest number of the one field that is wanted of each, before each of some places in the file; 0 if none."""
    largest = np.zeros(edges.size + 1, np.uint64)
    for which, chosen, records in _blocks(content, wanted):
        _, at, (name,) = wanted[which]
        before = np.searchsorted(edges, at[chosen])
        begins = np.flatnonzero(np.diff(before, prepend=-1))
        segments = before[begins]
        largest[segments] = np.maximum(largest[segments], np.maximum.reduceat(records[name], begins))
    return np.maximum.accumulate(largest)[:-1]


def _blocks(content: Stored, wanted: Sequence[Wanted]) -> Iterator[tuple[int, slice, NDArray[np.void]]]:
    """Which of the wanted, which of its messages, and their fields, block of the file by block."""
    block_size = int(np.clip(len(content) >> 4, *_BLOCKS))
    tasks, longest = list[tuple[int, Places, int, np.dtype[np.void], list[int]]](), 0
    for which, (kind, at, names) in enumerate(wanted):
        places = [kind.place(name) for name in names]
        if not at.size or not names:
            continue
        begin = min(offset for _, offset in places)
        size = max(offset + dtype.itemsize for dtype, offset in places) - begin
        record = np.dtype(
            {
                "names": list(names),
                "formats": [dtype for dtype, _ in places],
                "offsets": [offset - begin for _, offset in places],
                "itemsize": size,
            }
        )
        edges = np.searchsorted(at, np.arange(0, len(content) + block_size, block_size, dtype=at.dtype)).tolist()
        tasks.append((which, at, kind.head + begin, record, edges))
        longest = max(longest, kind.head + begin + size)
    for span in range(-(-len(content) // block_size)):
        here = [task for task in tasks if task[-1][span] < task[-1][span + 1]]
        if not here:
            continue
        first = span * block_size
        block = part(content, first, first + block_size + longest)  # the last message may reach over
        for which, at, offset, record, edges in here:
            chosen = slice(edges[span], edges[span + 1])
            size = record.itemsize
            rows = np.ndarray((len(block) - size + 1,), f"V{size}", block, strides=(1,))
            yield which, chosen, rows[at[chosen].astype(np.intp) + (offset - first)].view(record)


def tables(content: Stored, wanted: Sequence[Wanted]) -> list[MessageTable]:
    """The messages of each that is wanted, with what is wanted of them at hand and the rest decoded when asked for."""
    return [
        MessageTable(_Columns(content, one.kind, one.at, fields), one.at)
        for one, fields in zip(wanted, decoded(content, wanted), strict=True)
    ]


def kinds(content: Stored) -> list[MessageKind]:
    """Every message type that the bytes describe, with the places of its messages."""
    return list(Scan(content).kinds.values())


class _Columns(Mapping[str, NDArray[np.generic]]):
    """The fields of messages, each decoded when it is asked for, unless it is among those `at_hand`."""

    def __init__(
        self, content: Stored, kind: MessageKind, at: Places, at_hand: Mapping[str, NDArray[np.generic]]
    ) -> None:
        self._content, self._kind, self._at, self._at_hand = content, kind, at, at_hand

    def __iter__(self) -> Iterator[str]:
        return iter(self._kind.factors)

    def __len__(self) -> int:
        return len(self._kind.factors)

    def __contains__(self, name: object) -> bool:
        return name in self._kind.factors

    def __getitem__(self, name: str) -> NDArray[np.generic]:
        values, factor = self.stored(name)
        return values if factor == 1.0 else np.multiply(values, factor)

    def stored(self, name: str) -> tuple[NDArray[np.generic], float]:
        """A field as it is stored, and what it is multiplied by."""
        factor = self._kind.factors[name]
        if name in self._at_hand:
            return self._at_hand[name], factor
        (fields,) = decoded(self._content, [Wanted(self._kind, self._at, [name])])
        return fields[name], factor

    def rows(self, chosen: NDArray[np.bool_] | NDArray[np.int64]) -> _Columns:
        """Of some of the messages."""
        at_hand = {name: values[chosen] for name, values in self._at_hand.items()}
        return _Columns(self._content, self._kind, self._at[chosen], at_hand)


def gathered(content: Stored, kind: MessageKind) -> MessageTable:
    """The messages of a type as columns."""
    return MessageTable(_Columns(content, kind, kind.at, {}), kind.at)


def messages(content: Stored, at_hand: Mapping[str, Iterable[str]] | None = None) -> Messages:
    """Every message in the bytes that is whole, whatever stands between them.

    Args:
        at_hand: fields that are decoded at once, by message; "" names those of every message.
    """
    scan = Scan(content)
    there: dict[str, MessageKind] = {}
    for kind in scan.kinds.values():
        if kind.at.size:
            there.setdefault(kind.name, kind)
    asked = {name: frozenset(fields) for name, fields in (at_hand or {}).items()}
    every = asked.get("", frozenset())
    wanted = [
        Wanted(kind, kind.at, [field for field in kind.factors if field in every | asked.get(name, frozenset())])
        for name, kind in there.items()
    ]
    by_name = {one.kind.name: table for one, table in zip(wanted, tables(content, wanted), strict=True)}
    notes, damage = [], []
    if scan.unfinished:
        notes.append(f"the last {scan.unfinished} bytes are an unfinished message or an unused block: not read")
    if scan.lost:
        count = sum(stop - start for start, stop in scan.lost)
        places = "place" if len(scan.lost) == 1 else "places"
        damage.append(
            f"{count} bytes at {len(scan.lost)} {places} belong to no message (the first at byte {scan.lost[0][0]}): "
            "they were skipped"
        )
    return Messages(by_name, tuple(notes), tuple(damage))
