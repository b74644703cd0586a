"""Where the messages of a ULog file stand: one pass over its bytes, whole messages only, and nothing is decoded.

pyulog (1.3) steps back over what it cannot read; where that is more than the file has left, it never comes to an end.
Given whole messages it has nothing to step back over. Source: PX4's description of the ULog format.
"""

from __future__ import annotations

import struct
from collections import defaultdict
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from swashplate.flights.readers.joined_heads import JoinedHeads
from swashplate.flights.readers.source import Stored, part

MAGIC = b"\x55\x4c\x6f\x67\x01\x12\x35"
HEADER = 16
"""Bytes of the file's head: magic, version, time."""

# Kind -> fewest bytes of its payload.
_LEAST = {
    **dict.fromkeys(b"FIMPQ", 3), **dict.fromkeys(b"AR", 2), **dict.fromkeys(b"LC", 9),
    ord("B"): 40, ord("D"): 10, ord("S"): 8, ord("O"): 2,
}  # fmt: skip
_DATA = ord("D")
_CHAIN = 4  # messages in a row that prove that a place is the beginning of one
_CHUNK = 1 << 18  # bytes that are looked through for heads at a time: they stay in the processor's cache

Key = tuple[int, int]
"""Messages of data that are alike: the number of their topic, and their size with their head."""


def _next(content: Stored, at: int) -> int:
    """Where the message at `at` ends; 0 where there is none, or not a whole one."""
    head = content[at : at + 3]
    if len(head) < 3:
        return 0
    size, kind = struct.unpack("<HB", head)
    end: int = at + 3 + size
    return end if kind in _LEAST and size >= _LEAST[kind] and end <= len(content) else 0


def _chained(content: Stored, at: int, links: int) -> bool:
    """Whether so many messages follow each other from `at`, or fewer that end with the file."""
    for _ in range(links):
        if at == len(content):
            return True
        at = _next(content, at)
        if not at:
            return False
    return True


def _chained_from(content: Stored, start: int) -> int:
    """The first place from `start` on at which messages follow each other; the file's end where there is none."""
    return next((at for at in range(start, len(content) - 2) if _chained(content, at, _CHAIN)), len(content))


class WholeMessages:
    """Where the whole messages of a file stand.

    A message of data is as long as the one before it with its topic's number: all that look so are followed at once.

    Attributes:
        data: places of the messages of data, increasing, by number and size.
        others: kind, begin and end of all other messages, in order.
        lost: bytes in the middle that belong to none.
        unfinished: bytes of a last message that is not whole.
    """

    def __init__(self, content: Stored) -> None:
        self.others: list[tuple[str, int, int]] = []
        self.lost = self.unfinished = 0
        self._lengths = np.zeros(1 << 16, np.uint32)  # of messages of data that were met, by number
        rows = defaultdict[Key, list[NDArray[np.uint32]]](list)
        single = defaultdict[Key, list[int]](list)
        at, end = HEADER, len(content)
        chunk_end, chain = at, None
        while at < end:
            if at >= chunk_end:
                chunk_end = at + _CHUNK
                chain = self._chain(content, at, chunk_end)
            if chain is not None:
                more, at = chain.run(at)
                self._keep(chain, more, rows)
            after = _next(content, at)
            if not after:
                after = _chained_from(content, at + 1)
                if after == end:
                    self.unfinished = after - at
                else:
                    self.lost += after - at
            elif (kind := content[at + 2 : at + 3]) == b"D":
                (number,) = struct.unpack("<H", content[at + 3 : at + 5])
                single[number, after - at].append(at)
                self._lengths[number] = self._lengths[number] or after - at
            else:
                self.others.append((kind.decode(), at, after))
            at = after
        self.data = {}
        for key in {**single, **rows}:
            places = np.concatenate([*rows.pop(key, ()), np.array(single.get(key, ()), np.uint32)])
            places.sort(kind="stable")
            self.data[key] = places

    def _chain(self, content: Stored, begin: int, end: int) -> JoinedHeads | None:
        """What looks like messages of data of the numbers and sizes that were met."""
        cells = np.frombuffer(part(content, begin, end + 5), np.uint8)
        if cells.size < 5:
            return None
        heads = np.flatnonzero(cells[2:-2] == _DATA)
        numbers = cells[3:].take(heads) | cells[4:].take(heads).astype(np.uint16) << np.uint16(8)
        sizes = cells.take(heads) | cells[1:].take(heads).astype(np.uint16) << np.uint16(8)
        good = self._lengths.take(numbers) == sizes + np.uint32(3)
        places = heads[good].astype(np.uint32)
        places += np.uint32(begin)
        return JoinedHeads(places, numbers[good], self._lengths) if places.size else None

    def _keep(
        self, chain: JoinedHeads, joined: list[tuple[int, int]], rows: dict[Key, list[NDArray[np.uint32]]]
    ) -> None:
        for start, stop in joined:
            numbers, heads = chain.numbers[start:stop], chain.heads[start:stop]
            order = np.argsort(numbers, kind="stable")
            numbers, heads = numbers[order], heads[order]
            edges = np.flatnonzero(np.diff(numbers, prepend=-1, append=-1)).tolist()
            for first, last in pairwise(edges):
                number = int(numbers[first])
                rows[number, int(self._lengths[number])].append(heads[first:last])
