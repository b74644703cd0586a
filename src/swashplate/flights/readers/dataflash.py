"""DataFlash containers (ArduPilot's `.bin`, the `.px4log` of early PX4): messages that describe themselves.

The file is a row of messages: two head bytes, a type, a payload of that type's fixed length. Messages of type 128 (FMT)
say name, length and fields of a type. Source: ArduPilot's documentation of its binary log format.

This is not left to pymavlink's DFReader. It reads whole logs correctly (ours gives the same numbers in 3.5 million
fields) at 100,000 messages a second (ours: 1.4 million), but a few damaged bytes in one FMT message make it give up the
whole log (36 of 150 trials with five bytes changed), it writes a line for each damaged byte, and its source is under
the GPL, on which swashplate does not depend.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

HEAD = b"\xa3\x95"
FMT = 128
_FMT_LENGTH = 89
_CHUNK = 1 << 24  # bytes that are looked through for heads at a time
_FMT_FIELDS = np.dtype([("type", "u1"), ("length", "u1"), ("name", "S4"), ("format", "S16"), ("columns", "S64")])

# Format letter -> (NumPy type, factor): C types, and integers that stand for hundredths or 1e-7 degrees.
_LETTERS: Mapping[str, tuple[str, float]] = {
    "b": ("i1", 1.0), "B": ("u1", 1.0), "M": ("u1", 1.0), "h": ("<i2", 1.0), "H": ("<u2", 1.0),
    "i": ("<i4", 1.0), "I": ("<u4", 1.0), "q": ("<i8", 1.0), "Q": ("<u8", 1.0),
    "g": ("<f2", 1.0), "f": ("<f4", 1.0), "d": ("<f8", 1.0),
    "n": ("S4", 1.0), "N": ("S16", 1.0), "Z": ("S64", 1.0), "a": ("(32,)<i2", 1.0),
    "c": ("<i2", 1e-2), "C": ("<u2", 1e-2), "e": ("<i4", 1e-2), "E": ("<u4", 1e-2), "L": ("<i4", 1e-7),
}  # fmt: skip


@dataclass(frozen=True)
class MessageTable:
    """All messages of one name.

    Attributes:
        columns: numbers, shape (n,), or texts, by field name.
        place: where each message stands in the file: increasing numbers, comparable between tables, shape (n,).
    """

    columns: Mapping[str, NDArray[np.generic]]
    place: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.place)

    def number(self, name: str) -> NDArray[np.float64]:
        """A column as numbers, NaN where the field is missing or holds text."""
        values = self.columns.get(name)
        if values is None or values.dtype.kind not in "fiub" or values.ndim != 1:
            return np.full(len(self), np.nan)
        with np.errstate(invalid="ignore"):  # damaged bytes may be a signalling NaN
            return np.asarray(values, dtype=np.float64)

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


@dataclass
class MessageKind:
    """A described message type and where its messages stand.

    Attributes:
        number, name: of the type. dtype: of its payload. factors: what stored numbers are multiplied by, by field.
        letters: the log's own word for each field's type.
        at: bytes from the file's begin to each message.
    """

    number: int
    name: str
    dtype: np.dtype[np.void]
    factors: Mapping[str, float]
    letters: Mapping[str, str]
    at: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))


def is_dataflash(content: bytes) -> bool:
    """Whether the bytes begin with a whole FMT message, or have one after a few lost blocks."""
    start = 0 if content.startswith(HEAD + bytes([FMT])) else content.find(HEAD + bytes([FMT, FMT, _FMT_LENGTH]))
    return start >= 0 and len(content) >= start + _FMT_LENGTH and content[start + 4] >= 3


def _described(content: bytes, at: int) -> tuple[int, int, MessageKind | None]:
    """Type, length and description in the FMT message at `at`; None where letters and length do not fit together."""
    fields = np.frombuffer(content, _FMT_FIELDS, count=1, offset=at + 3)[0]
    name = bytes(fields["name"]).decode("ascii", "replace")
    letters = bytes(fields["format"]).decode("ascii", "replace")
    columns = bytes(fields["columns"]).decode("ascii", "replace").split(",") if fields["columns"] else []
    kind, length = int(fields["type"]), int(fields["length"])
    whole = name.isalnum() and len(columns) == len(letters) == len(set(columns)) and all(columns)
    if not whole or any(letter not in _LETTERS for letter in letters):
        return kind, length, None
    dtype = np.dtype([(column, _LETTERS[letter][0]) for column, letter in zip(columns, letters, strict=True)])
    if dtype.itemsize + 3 != length:
        return kind, length, None
    factors = {column: _LETTERS[letter][1] for column, letter in zip(columns, letters, strict=True)}
    return kind, length, MessageKind(kind, name, dtype, factors, dict(zip(columns, letters, strict=True)))


class _Chain:
    """Heads all at once, each joined to the one at which its message ends.

    Attributes:
        kinds, lengths: types as they are described, where every one is described before it is used; else neither, and
            the chain joins nothing.
    """

    def __init__(self, content: bytes) -> None:
        self.kinds: dict[int, MessageKind] = {}
        self.lengths = [0] * 256
        self.lengths[FMT] = _FMT_LENGTH
        self.heads = _heads(content)
        self.numbers = np.frombuffer(content, np.uint8)[self.heads + 2]
        begins: dict[int, int] = {}
        told_twice = False
        for at in self.heads[self.numbers == FMT].tolist():
            if not content.startswith(HEAD, at + _FMT_LENGTH):
                continue  # torn
            kind, length, described = _described(content, at)
            if kind == FMT or length < 3 or (kind in self.kinds and described is None):
                continue
            told_twice |= kind in begins and self.lengths[kind] != length
            begins.setdefault(kind, at)
            self.lengths[kind] = length
            if described is not None:
                self.kinds.setdefault(kind, described)
        self._join()
        used = {kind: self.heads[(self.numbers == kind) & self._joined][:1] for kind in begins}
        if told_twice or any(used[kind].size and used[kind][0] < begin for kind, begin in begins.items()):
            self.kinds, self.lengths = {}, [0 if kind != FMT else _FMT_LENGTH for kind in range(256)]
            self._joined[:] = False

    def _join(self) -> None:
        after = self.heads + np.array(self.lengths)[self.numbers]
        self._following = np.searchsorted(self.heads, after)
        inside = (self._following < self.heads.size) & (after > self.heads)
        self._joined = np.zeros(self.heads.size, dtype=np.bool_)
        self._joined[inside] = self.heads[self._following[inside]] == after[inside]
        self._breaks = np.flatnonzero(~self._joined | (self._following != np.arange(1, self.heads.size + 1)))

    def run(self, at: int) -> tuple[list[tuple[int, int]], int]:
        """Rows of heads (from, to) that follow each other from a byte on, and the byte behind them."""
        index = int(np.searchsorted(self.heads, at))
        if index >= self.heads.size or self.heads[index] != at or not self._joined[index]:
            return [], at
        rows = []
        while True:  # from one break to the next, over what only looks like a head
            stop = int(self._breaks[np.searchsorted(self._breaks, index)])
            if not self._joined[stop]:
                rows.append((index, stop))
                return rows, int(self.heads[stop])
            rows.append((index, stop + 1))
            index = int(self._following[stop])


class _Scan:
    """One pass over the bytes: where each message stands, and the bytes that belong to none.

    As far as each message ends where another one begins they are followed all at once, elsewhere one at a time.
    """

    def __init__(self, content: bytes) -> None:
        chain = _Chain(content)
        self.kinds, self.lengths = chain.kinds, chain.lengths
        self.lost: list[tuple[int, int]] = []
        self.unfinished = 0
        places, rows = self._walk(content, chain)
        chosen = np.concatenate([np.arange(a, b) for a, b in rows]) if rows else np.zeros(0, dtype=np.int64)
        heads, numbers = chain.heads[chosen], chain.numbers[chosen]
        order = np.argsort(numbers, kind="stable")
        edges = np.searchsorted(numbers[order], np.arange(257))
        for number, described in self.kinds.items():
            joined = heads[order[edges[number] : edges[number + 1]]]
            single = np.array(places[number], dtype=np.int64)
            described.at = np.sort(np.concatenate([joined, single])) if single.size else joined

    def _walk(self, content: bytes, chain: _Chain) -> tuple[list[list[int]], list[tuple[int, int]]]:
        """Places of single messages by type, and rows of the chain."""
        size, at, lengths = len(content), 0, self.lengths
        erased = min(len(content.rstrip(b"\xff")), len(content.rstrip(b"\0")))  # flash memory comes in blocks
        places: list[list[int]] = [[] for _ in range(256)]
        rows: list[tuple[int, int]] = []
        headed = content.startswith(HEAD)
        while at < size:
            if headed and chain.kinds:
                more, at = chain.run(at)
                rows += more
            kind = content[at + 2] if headed and at + 2 < size else -1
            length = lengths[kind] if kind >= 0 else 0
            after = at + length
            # A message counts where another one, or the end, follows it: a torn one would swallow its neighbour.
            following_head = content[after : after + 2]
            if length and after <= size and (following_head == HEAD or len(following_head) < 2 or after >= erased):
                if kind == FMT:
                    self._learn(content, at)
                places[kind].append(at)
                at, headed = after, following_head == HEAD
                continue
            if length and after > size and content.find(HEAD, at + 3) < 0:
                self.unfinished = size - at
                break
            following = content.find(HEAD, at + 1)
            following = size if following < 0 else following
            self._skip(content, at, following)
            at, headed = following, True
        return places, rows

    def _learn(self, content: bytes, at: int) -> None:
        kind, length, described = _described(content, at)
        if kind == FMT or length < 3 or (kind in self.kinds and described is None):
            return
        self.lengths[kind] = length
        if described is not None:
            self.kinds.setdefault(kind, described)

    def _skip(self, content: bytes, start: int, stop: int) -> None:
        rest = content[start:stop]
        if self.lost and self.lost[-1][1] == start:
            self.lost[-1] = (self.lost[-1][0], stop)
        elif stop == len(content) and (HEAD.startswith(rest) or set(rest) in ({0x00}, {0xFF})):
            self.unfinished = stop - start
        else:
            self.lost.append((start, stop))


def _heads(content: bytes) -> NDArray[np.int64]:
    """Where the two bytes of a head stand, with a byte behind them."""
    cells, found = np.frombuffer(content, np.uint8), []
    for begin in range(0, len(content), _CHUNK):
        part = cells[begin : begin + _CHUNK + 1]
        found.append(np.flatnonzero((part[:-1] == HEAD[0]) & (part[1:] == HEAD[1])) + begin)
    heads = np.concatenate(found) if found else np.zeros(0, dtype=np.int64)
    return np.asarray(heads[heads + 2 < len(content)], dtype=np.int64)


def kinds(content: bytes) -> list[MessageKind]:
    """Every message type that the bytes describe, with the places of its messages."""
    return list(_Scan(content).kinds.values())


class _Columns(Mapping[str, NDArray[np.generic]]):
    """The fields of messages: the first that is asked for is taken alone out of the bytes, then all at once.

    Of most kinds only the stamps are ever looked at.
    """

    def __init__(self, content: bytes, kind: MessageKind, at: NDArray[np.int64]) -> None:
        self._content, self._kind, self._at = content, kind, at
        self._taken: dict[str, NDArray[np.generic]] = {}
        self._records: NDArray[np.void] | None = None

    def __iter__(self) -> Iterator[str]:
        return iter(self._kind.factors)

    def __len__(self) -> int:
        return len(self._kind.factors)

    def __getitem__(self, name: str) -> NDArray[np.generic]:
        if name not in self._taken:
            dtype, offset, *_ = dict(self._kind.dtype.fields or {})[name]
            if self._taken and self._records is None:
                self._records = self._bytes(0, self._kind.dtype.itemsize).view(self._kind.dtype)[:, 0]
            if self._records is None:
                cells = self._bytes(offset, dtype.itemsize).view(dtype.base)
                values = cells.reshape(len(self._at), *dtype.shape)
            else:
                values = self._records[name]
            factor = self._kind.factors[name]
            self._taken[name] = values if factor == 1.0 else values * factor
        return self._taken[name]

    def _bytes(self, offset: int, size: int) -> NDArray[np.uint8]:
        """So many bytes of each payload, shape (n, size)."""
        cells = np.frombuffer(self._content, np.uint8)
        return np.ascontiguousarray(np.lib.stride_tricks.sliding_window_view(cells, size)[self._at + 3 + offset])

    def rows(self, chosen: NDArray[np.bool_] | NDArray[np.int64]) -> _Columns:
        """Of some of the messages."""
        return _Columns(self._content, self._kind, self._at[chosen])


def gathered(content: bytes, kind: MessageKind) -> MessageTable:
    """The messages of a type as columns."""
    return MessageTable(_Columns(content, kind, kind.at), kind.at)


def messages(content: bytes) -> Messages:
    """Every message in the bytes that is whole, whatever stands between them."""
    scan = _Scan(content)
    tables: dict[str, MessageTable] = {}
    for kind in scan.kinds.values():
        if kind.at.size and kind.name not in tables:
            tables[kind.name] = gathered(content, kind)
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
    return Messages(tables, tuple(notes), tuple(damage))
