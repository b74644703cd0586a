"""The messages of a ULog file, whole ones only, before pyulog sees them.

pyulog (1.3) steps back over what it cannot read; where that is more than the file has left, it never comes to an end.
Given whole messages it has nothing to step back over. Source: PX4's description of the ULog format.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

MAGIC = b"\x55\x4c\x6f\x67\x01\x12\x35"
HEADER = 16
"""Bytes of the file's head: magic, version, time."""

# Kind -> fewest bytes of its payload.
_LEAST = {
    **dict.fromkeys(b"FIMPQ", 3), **dict.fromkeys(b"AR", 2), **dict.fromkeys(b"LC", 9),
    ord("B"): 40, ord("D"): 10, ord("S"): 8, ord("O"): 2,
}  # fmt: skip
_CHAIN = 4  # messages in a row that prove that a place is the beginning of one


@dataclass(frozen=True)
class Whole:
    """A file without its broken parts.

    Attributes:
        content: head and whole messages.
        lost: bytes in the middle that belong to none.
        unfinished: bytes of a last message that is not whole.
    """

    content: bytes
    lost: int
    unfinished: int


def _next(content: bytes, at: int) -> int:
    """Where the message at `at` ends; 0 where there is none, or not a whole one."""
    if at + 3 > len(content):
        return 0
    size, kind = struct.unpack_from("<HB", content, at)
    end = at + 3 + size
    return end if kind in _LEAST and size >= _LEAST[kind] and end <= len(content) else 0


def _chained(content: bytes, at: int, links: int) -> bool:
    """Whether so many messages follow each other from `at`, or fewer that end with the file."""
    for _ in range(links):
        if at == len(content):
            return True
        at = _next(content, at)
        if not at:
            return False
    return True


def _chained_from(content: bytes, start: int) -> int:
    """The first place from `start` on at which messages follow each other; the file's end where there is none."""
    return next((at for at in range(start, len(content) - 2) if _chained(content, at, _CHAIN)), len(content))


def whole_messages(content: bytes) -> Whole:
    """The file with its whole messages only: the same bytes where it is whole."""
    pieces: list[bytes] = []
    begin = at = HEADER
    lost = unfinished = 0
    head, least, length = struct.Struct("<HB").unpack_from, _LEAST.get, len(content)
    while at < length:
        if at + 3 <= length:
            size, kind = head(content, at)
            end = at + 3 + size
            if size >= least(kind, length) and end <= length:  # as `_next`, for millions of them
                at = end
                continue
        pieces.append(content[begin:at])
        begin = _chained_from(content, at + 1)
        if begin == len(content):
            unfinished = begin - at
        else:
            lost += begin - at
        at = begin
    pieces.append(content[begin:at])
    if not lost:
        return Whole(content[: len(content) - unfinished], 0, unfinished)
    body = b"".join(pieces)
    # Flag bits point at data by the file's own offsets, which no longer hold.
    flags = struct.pack("<HB", 40, ord("B"))
    body = flags + bytes(40) + body[43:] if body.startswith(flags) else body
    return Whole(content[:HEADER] + body, lost, unfinished)
