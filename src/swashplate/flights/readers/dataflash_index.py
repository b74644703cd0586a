"""Where the messages of a DataFlash container stand, by type: one pass over its bytes, and nothing is decoded.

The file is a row of messages: two head bytes, a type, a payload of that type's fixed length. Messages of type 128 (FMT)
say name, length and fields of a type. Source: ArduPilot's documentation of its binary log format.

This is not left to pymavlink's DFReader. It reads whole logs correctly (ours gives the same numbers in 3.5 million
fields) at 100,000 messages a second (ours: 1.4 million), but a few damaged bytes in one FMT message make it give up the
whole log (36 of 150 trials with five bytes changed), it writes a line for each damaged byte, and its source is under
the GPL, on which swashplate does not depend.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from swashplate.flights.readers.joined_heads import SOME, JoinedHeads
from swashplate.flights.readers.source import Places, Stored, part

HEAD = b"\xa3\x95"
FMT = 128
_FMT_LENGTH = 89
_CHUNK = 1 << 18  # bytes that are looked through for heads at a time: they stay in the processor's cache
_USUAL = 40  # bytes of a message: where they are shorter, the room for heads grows
_FMT_FIELDS = np.dtype([("type", "u1"), ("length", "u1"), ("name", "S4"), ("format", "S16"), ("columns", "S64")])

# Format letter -> (NumPy type, factor): C types, and integers that stand for hundredths or 1e-7 degrees.
_LETTERS: Mapping[str, tuple[str, float]] = {
    "b": ("i1", 1.0), "B": ("u1", 1.0), "M": ("u1", 1.0), "h": ("<i2", 1.0), "H": ("<u2", 1.0),
    "i": ("<i4", 1.0), "I": ("<u4", 1.0), "q": ("<i8", 1.0), "Q": ("<u8", 1.0),
    "g": ("<f2", 1.0), "f": ("<f4", 1.0), "d": ("<f8", 1.0),
    "n": ("S4", 1.0), "N": ("S16", 1.0), "Z": ("S64", 1.0), "a": ("(32,)<i2", 1.0),
    "c": ("<i2", 1e-2), "C": ("<u2", 1e-2), "e": ("<i4", 1e-2), "E": ("<u4", 1e-2), "L": ("<i4", 1e-7),
}  # fmt: skip


@dataclass
class MessageKind:
    """A described message type and where its messages stand.

    Attributes:
        number, name: of the type. dtype: of its payload. factors: what stored numbers are multiplied by, by field.
        letters: the log's own word for each field's type.
        at: bytes from the file's begin to each message. head: bytes in front of its payload.
    """

    number: int
    name: str
    dtype: np.dtype[np.void]
    factors: Mapping[str, float]
    letters: Mapping[str, str]
    at: Places = field(default_factory=lambda: np.zeros(0, dtype=np.uint32))
    head: int = 3

    def place(self, name: str) -> tuple[np.dtype[np.generic], int]:
        """A field's type, and the bytes before it in the payload."""
        dtype, offset, *_ = dict(self.dtype.fields or {})[name]
        return dtype, int(offset)


def is_dataflash(content: Stored) -> bool:
    """Whether the bytes begin with a whole FMT message, or have one after a few lost blocks."""
    start = 0 if content[:3] == HEAD + bytes([FMT]) else content.find(HEAD + bytes([FMT, FMT, _FMT_LENGTH]))
    return start >= 0 and len(content) >= start + _FMT_LENGTH and content[start + 4 : start + 5] >= b"\x03"


def _described(content: Stored, at: int) -> tuple[int, int, MessageKind | None]:
    """Type, length and description in the FMT message at `at`; None where letters and length do not fit together."""
    fields = np.frombuffer(content[at + 3 : at + _FMT_LENGTH], _FMT_FIELDS)[0]
    name = bytes(fields["name"]).decode("ascii", "replace")
    letters = bytes(fields["format"]).decode("ascii", "replace")
    columns = bytes(fields["columns"]).decode("ascii", "replace").split(",") if fields["columns"] else []
    kind, length = int(fields["type"]), int(fields["length"])
    complete = name.isalnum() and len(columns) == len(letters) == len(set(columns)) and all(columns)
    if not complete or any(letter not in _LETTERS for letter in letters):
        return kind, length, None
    dtype = np.dtype([(column, _LETTERS[letter][0]) for column, letter in zip(columns, letters, strict=True)])
    if dtype.itemsize + 3 != length:
        return kind, length, None
    factors = {column: _LETTERS[letter][1] for column, letter in zip(columns, letters, strict=True)}
    return kind, length, MessageKind(kind, name, dtype, factors, dict(zip(columns, letters, strict=True)))


class _Chain(JoinedHeads):
    """Heads all at once, each joined to the one at which its message ends.

    Attributes:
        kinds, lengths: types as they are described, where every one is described before it is used; else neither, and
            the chain joins nothing.
    """

    def __init__(self, content: Stored) -> None:
        self.kinds: dict[int, MessageKind] = {}
        self.lengths = [0] * 256
        self.lengths[FMT] = _FMT_LENGTH
        heads, numbers = _heads(content)
        begins: dict[int, int] = {}
        described_twice = False
        for at in heads[numbers == FMT].tolist():
            if content[at + _FMT_LENGTH : at + _FMT_LENGTH + 2] != HEAD:
                continue  # torn
            kind, length, described = _described(content, at)
            if kind == FMT or length < 3 or (kind in self.kinds and described is None):
                continue
            described_twice |= kind in begins and self.lengths[kind] != length
            begins.setdefault(kind, at)
            self.lengths[kind] = length
            if described is not None:
                self.kinds.setdefault(kind, described)
        super().__init__(heads, numbers, np.array(self.lengths, dtype=np.uint32))
        if described_twice or any(self._used_before(kind, begin) for kind, begin in begins.items()):
            self.kinds, self.lengths = {}, [0 if kind != FMT else _FMT_LENGTH for kind in range(256)]
            self._joined[:] = False

    def _used_before(self, kind: int, begin: int) -> bool:
        """Whether a joined message of a type stands before the type's description."""
        before = int(np.searchsorted(self.heads, np.uint32(begin)))
        return bool(np.any((self.numbers[:before] == kind) & self._joined[:before]))


class Scan:
    """One pass over the bytes: where each message stands, and the bytes that belong to none.

    As far as each message ends where another one begins they are followed all at once, elsewhere one at a time.

    Attributes:
        kinds: the types that are described, by number. lost: from and to of bytes that belong to no message.
        unfinished: bytes of a last message, or of an unused block, at the end.
    """

    def __init__(self, content: Stored) -> None:
        chain = _Chain(content)
        self.kinds, self.lengths = chain.kinds, chain.lengths
        self.lost: list[tuple[int, int]] = []
        self.unfinished = 0
        places, rows = self._walk(content, chain)
        joined = _by_type(chain, rows)
        for number, described in self.kinds.items():
            single = np.array(places[number], dtype=np.uint32)
            together = joined.pop(number, single[:0])
            described.at = np.sort(np.concatenate([together, single])) if single.size else together

    def _walk(self, content: Stored, chain: _Chain) -> tuple[list[list[int]], list[tuple[int, int]]]:
        """Places of single messages by type, and rows of the chain."""
        size, at, lengths = len(content), 0, self.lengths
        erased = min(_filled(content, b"\xff"), _filled(content, b"\0"))  # flash memory comes in blocks
        places: list[list[int]] = [[] for _ in range(256)]
        rows: list[tuple[int, int]] = []
        headed = content[:2] == HEAD
        while at < size:
            if headed and chain.kinds:
                more, at = chain.run(at)
                rows += more
            kind = content[at + 2 : at + 3][0] if headed and at + 2 < size else -1
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

    def _learn(self, content: Stored, at: int) -> None:
        kind, length, described = _described(content, at)
        if kind == FMT or length < 3 or (kind in self.kinds and described is None):
            return
        self.lengths[kind] = length
        if described is not None:
            self.kinds.setdefault(kind, described)

    def _skip(self, content: Stored, start: int, stop: int) -> None:
        rest = content[start:stop]
        if self.lost and self.lost[-1][1] == start:
            self.lost[-1] = (self.lost[-1][0], stop)
        elif stop == len(content) and (HEAD.startswith(rest) or set(rest) in ({0x00}, {0xFF})):
            self.unfinished = stop - start
        else:
            self.lost.append((start, stop))


def _filled(content: Stored, filler: bytes) -> int:
    """Bytes before those at the end that are all the same."""
    end = len(content)
    while end:
        begin = max(0, end - _CHUNK)
        if kept := len(content[begin:end].rstrip(filler)):
            return begin + kept
        end = begin
    return 0


def _heads(content: Stored) -> tuple[NDArray[np.uint32], NDArray[np.uint8]]:
    """Where the two bytes of a head stand with a byte behind them, and that byte: the type."""
    # Room that is not filled is not taken from the system, and pieces that are joined later would be there twice.
    room = SOME + len(content) // _USUAL
    heads, numbers = np.empty(room, np.uint32), np.empty(room, np.uint8)
    count = 0
    for begin in range(0, len(content) - 2, _CHUNK):
        cells = np.frombuffer(part(content, begin, begin + _CHUNK + 2), np.uint8)
        head = cells[:-2] == HEAD[0]
        head &= cells[1:-1] == HEAD[1]
        inside = np.flatnonzero(head)
        if count + inside.size > heads.size:
            room = 2 * room + inside.size
            for row in (heads, numbers):
                row.resize(room, refcheck=False)
        here = slice(count, count + inside.size)
        numbers[here] = cells[2:].take(inside)
        np.add(inside, begin, out=heads[here], casting="unsafe")
        count = here.stop
    for row in (heads, numbers):
        row.resize(count, refcheck=False)
    return heads, numbers


def _by_type(chain: _Chain, rows: list[tuple[int, int]]) -> dict[int, NDArray[np.uint32]]:
    """Places of the heads in rows of the chain, in order, by type."""
    chosen = np.zeros(chain.heads.size, dtype=np.bool_)
    for start, stop in rows:
        chosen[start:stop] = True
    parts = [slice(start, start + SOME) for start in range(0, chosen.size, SOME)]
    counts = [np.bincount(chain.numbers[here][chosen[here]], minlength=256) for here in parts]
    total = np.sum(np.array(counts, np.int64).reshape(-1, 256), axis=0)
    by_type = {number: np.empty(size, np.uint32) for number, size in enumerate(total.tolist()) if size}
    filled = np.zeros(256, np.int64)
    for here, count in zip(parts, counts, strict=True):
        numbers, heads = chain.numbers[here][chosen[here]], chain.heads[here][chosen[here]]
        heads = heads[np.argsort(numbers, kind="stable")]
        ends, before = np.cumsum(count), filled.copy()
        filled += count
        for number in np.flatnonzero(count).tolist():
            by_type[number][before[number] : filled[number]] = heads[ends[number] - count[number] : ends[number]]
    return by_type
