"""Bytes with something wrong in them: cut, doubled, overwritten by numbers that break sizes and clocks."""

from __future__ import annotations

import random
import re
import struct
from collections.abc import Sequence

ODD_NUMBERS = (0, 1, 2, 7, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x10000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
ODD_NUMBERS += (1 << 40, (1 << 63) - 1, 1 << 63, (1 << 64) - 1)
ODD_FLOATS = (0.0, -0.0, 1.0, -1.0, 1e-320, 1e-30, 1e9, 1e30, 1e155, -1e155, 1e300, 1.7e308, -1.7e308)
ODD_FLOATS += (float("nan"), float("inf"), -float("inf"))
ODD_WORDS = (
    *[
        "nan",
        "inf",
        "-inf",
        "1e999",
        "1e308",
        "-1e308",
        "1e155",
        "0",
        "-0",
        "-1",
        "1e-320",
        "9999999999999999999999",
        "0x10",
        "1_0",
        "١٢",
        "true",
        "null",
    ],
    *("", " ", '"', "'", "\x00", "\x1b[31m", "é\u202e漢", "a" * 3000, "9" * 500, ",", ";", "\t", "#", "[", "{", "\n\n"),
)
_NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
_HEAD = 2048  # bytes at a file's begin, where formats say what follows


def damaged(content: bytes, chance: random.Random, *, others: Sequence[bytes] = ()) -> bytes:
    """A file's bytes with one to five things wrong.

    Args:
        content: a file that works.
        chance: decides; the same one gives the same bytes.
        others: files of which pieces may be put in.
    """
    found = bytearray(content)
    for _ in range(chance.choice((1, 1, 1, 2, 2, 3, 5))):
        if not found:
            break
        _damage(found, chance, others)
    return bytes(found)


def _damage(found: bytearray, chance: random.Random, others: Sequence[bytes]) -> None:
    at = chance.randrange(min(len(found), _HEAD) if chance.random() < 0.5 else len(found))
    kind = chance.randrange(12)
    if kind == 0:
        found[at] ^= 1 << chance.randrange(8)
    elif kind == 1:
        found[at : at + chance.choice((1, 2, 4, 8))] = chance.randbytes(chance.choice((1, 2, 4, 8)))
    elif kind == 2:
        size = chance.choice((1, 2, 4, 8))
        number = chance.choice(ODD_NUMBERS) & ((1 << 8 * size) - 1)
        at -= at % size if chance.random() < 0.5 else 0
        found[at : at + size] = number.to_bytes(size, chance.choice(("little", "big")))
    elif kind == 3:
        form = chance.choice(("<f", "<d", ">d"))
        at -= at % struct.calcsize(form)
        value = chance.choice(ODD_FLOATS)
        found[at : at + struct.calcsize(form)] = struct.pack(form, value if abs(value) < 3e38 or "d" in form else 3e38)
    elif kind == 4:
        del found[at:]
    elif kind == 5:
        del found[at : at + chance.choice((1, 3, 16, 200))]
    elif kind == 6:
        found[at:at] = found[at : at + chance.choice((1, 16, 200, 2000))]
    elif kind == 7:
        _word(found, chance, at)
    elif kind == 8:
        _lines(found, chance)
    elif kind == 9 and others:
        other = chance.choice(others)
        begin = chance.randrange(len(other))
        found[at : at + chance.choice((0, 50, 500))] = other[begin : begin + chance.choice((8, 100, 1000))]
    elif kind == 10:  # what a disk holds after a power cut
        found[at:] = bytes(chance.choice((len(found) - at, 512, 4096)))
    else:
        found[at:at] = chance.choice(ODD_WORDS).encode()


def _word(found: bytearray, chance: random.Random, at: int) -> None:
    """Puts something odd in the place of a number that is written out."""
    number = _NUMBER.search(found, at)
    if number is not None:
        found[number.start() : number.end()] = chance.choice(ODD_WORDS).encode()


def _lines(found: bytearray, chance: random.Random) -> None:
    """Leaves a line out, doubles it, or exchanges it with another one."""
    lines = bytes(found).split(b"\n")
    first, second = chance.randrange(len(lines)), chance.randrange(len(lines))
    match chance.randrange(3):
        case 0:
            del lines[first]
        case 1:
            lines.insert(second, lines[first])
        case _:
            lines[first], lines[second] = lines[second], lines[first]
    found[:] = b"\n".join(lines)
