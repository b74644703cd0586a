"""Containers forged by rule: their records are changed, and what says how long they are is put right again.

Bytes that are changed anywhere mostly break a length, and the reader stops there. These files are well-formed outside
and wrong inside: records left out, doubled, exchanged, and odd numbers in them.
"""

from __future__ import annotations

import contextlib
import json
import random
import sqlite3
import struct
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega
from pymavlink.generator.mavcrc import x25crc

from mutations import mutated

from .damage import ODD_FLOATS, ODD_NUMBERS, ODD_WORDS, damaged

Mutate = Callable[[tuple[bytes, ...], random.Random], bytes]


@dataclass
class Record:
    """A part of a file: what stands before its content, and the content."""

    head: bytes
    body: bytes


Split = Callable[[bytes], tuple[bytes, list[Record]]]
Join = Callable[[bytes, Sequence[Record]], bytes]


def by_records(split: Split, join: Join) -> Mutate:
    """Records changed as whole ones, or inside."""

    def mutate(whole: tuple[bytes, ...], chance: random.Random) -> bytes:
        start, records = split(chance.choice(whole))
        for _ in range(chance.choice((1, 1, 2, 3, 8))):
            _change(records, chance)
        return join(start, records)

    return mutate


def _change(records: list[Record], chance: random.Random) -> None:
    if not records:
        return
    first, second = chance.randrange(len(records)), chance.randrange(len(records))
    match chance.randrange(6):
        case 0:
            del records[first]
        case 1:
            records.insert(second, records[first])
        case 2:
            records[first], records[second] = records[second], records[first]
        case 3:
            records[first] = Record(records[first].head, records[second].body)
        case _:
            inside = damaged(records[first].body, chance, others=(records[second].body or b"x",))
            records[first] = Record(records[first].head, inside)


# ---- formats -----------------------------------------------------------------------------------------------------
def split_ulog(content: bytes) -> tuple[bytes, list[Record]]:
    records, at = [], 16
    while at + 3 <= len(content):
        (size,) = struct.unpack_from("<H", content, at)
        records.append(Record(content[at + 2 : at + 3], content[at + 3 : at + 3 + size]))
        at += 3 + size
    return content[:16], records


def join_ulog(start: bytes, records: Sequence[Record]) -> bytes:
    return start + b"".join(struct.pack("<H", len(r.body) & 0xFFFF) + r.head + r.body[:0xFFFF] for r in records)


def split_dataflash(content: bytes) -> tuple[bytes, list[Record]]:
    sizes, records, at = {128: 89}, [], 0
    while at + 3 <= len(content) and sizes.get(content[at + 2], 0) >= 3:
        kind = content[at + 2]
        body = content[at + 3 : at + sizes[kind]]
        if kind == 128:
            sizes[body[0]] = body[1]
        records.append(Record(content[at : at + 3], body))
        at += sizes[kind]
    return b"", records


def join_dataflash(start: bytes, records: Sequence[Record]) -> bytes:
    """A record has the length that its format has said: a longer content is cut, a shorter one filled with zeros."""
    sizes, out = {128: 89}, [start]
    for record in records:
        size = sizes.get(record.head[2], 3 + len(record.body)) - 3
        body = record.body[: max(size, 0)].ljust(max(size, 0), b"\0")
        if record.head[2] == 128 and len(body) > 1:
            sizes[body[0]] = body[1]
        out += [record.head, body]
    return b"".join(out)


def split_matlab(content: bytes) -> tuple[bytes, list[Record]]:
    """The numbers, names and flags of a file without compression, in the order in which they lie there."""
    records: list[Record] = []

    def walk(data: bytes, above: str) -> None:
        at, k = 0, 0
        while at + 8 <= len(data):
            kind, size = struct.unpack_from("<II", data, at)
            place = f"{above}/{k}"
            if kind >> 16:  # a small element
                records.append(Record(f"{place} s {kind & 0xFFFF}".encode(), data[at + 4 : at + 4 + (kind >> 16)]))
                at += 8
            elif kind == 14:
                walk(data[at + 8 : at + 8 + size], place)
                at += 8 + size
            else:
                records.append(Record(f"{place} l {kind}".encode(), data[at + 8 : at + 8 + size]))
                at += 8 + -(-size // 8) * 8
            k += 1

    walk(content[128:], "")
    return content[:128], records


def join_matlab(start: bytes, records: Sequence[Record]) -> bytes:
    tree: dict[str, list[bytes]] = {}

    def element(record: Record) -> tuple[str, bytes]:
        place, form, kind = record.head.decode().split()
        body = record.body
        if form == "s":
            body = body[:4]
            return place, struct.pack("<I", (len(body) << 16) | int(kind)) + body.ljust(4, b"\0")
        return place, struct.pack("<II", int(kind), len(body)) + body + bytes(-len(body) % 8)

    deepest = 0
    for record in records:
        place, made = element(record)
        above = place.rpartition("/")[0]
        tree.setdefault(above, []).append(made)
        deepest = max(deepest, above.count("/"))
    for depth in range(deepest, 0, -1):
        for above in [name for name in tree if name.count("/") == depth]:
            inside = b"".join(tree.pop(above))
            made = struct.pack("<II", 14, len(inside)) + inside
            tree.setdefault(above.rpartition("/")[0], []).append(made)
    return start + b"".join(tree.get("", []))


def split_bag1(content: bytes) -> tuple[bytes, list[Record]]:
    start = content.index(b"\n") + 1
    records, at = [], start
    while at + 8 <= len(content):
        (size,) = struct.unpack_from("<I", content, at)
        head = content[at : at + 4 + size]
        (inside,) = struct.unpack_from("<I", content, at + 4 + size)
        records.append(Record(head, content[at + 8 + size : at + 8 + size + inside]))
        at += 8 + size + inside
    return content[:start], records


def join_bag1(start: bytes, records: Sequence[Record]) -> bytes:
    return start + b"".join(r.head + struct.pack("<I", len(r.body)) + r.body for r in records)


def split_tlog(content: bytes) -> tuple[bytes, list[Record]]:
    """Frames of MAVLink: time, head without the length, payload."""
    records, at = [], 0
    while at + 18 <= len(content):
        head = {0xFE: 6, 0xFD: 10}[content[at + 8]]
        size = content[at + 9]
        records.append(Record(content[at : at + 9] + content[at + 10 : at + 8 + head], content[at + 8 + head :][:size]))
        at += 8 + head + size + 2
    return b"", records


def join_tlog(start: bytes, records: Sequence[Record]) -> bytes:
    out = [start]
    for record in records:
        body = record.body[:255]
        frame = record.head[8:9] + bytes([len(body)]) + record.head[9:] + body
        kind = int.from_bytes(frame[7:10], "little") if frame[0] == 0xFD else frame[5]
        known = ardupilotmega.mavlink_map.get(kind)
        extra = bytes([known.crc_extra]) if known is not None else b"\0"
        out += [record.head[:8], frame, struct.pack("<H", x25crc(frame[1:] + extra).crc)]
    return b"".join(out)


_MCAP = b"\x89MCAP0\r\n"


def split_mcap(content: bytes) -> tuple[bytes, list[Record]]:
    records, at = [], len(_MCAP)
    while at + 9 <= len(content) - len(_MCAP):
        (size,) = struct.unpack_from("<Q", content, at + 1)
        records.append(Record(content[at : at + 1], content[at + 9 : at + 9 + size]))
        at += 9 + size
    return _MCAP, records


def join_mcap(start: bytes, records: Sequence[Record]) -> bytes:
    return start + b"".join(r.head + struct.pack("<Q", len(r.body)) + r.body for r in records) + _MCAP


def split_growing(content: bytes) -> tuple[bytes, list[Record]]:
    end = content.index(b"\n", content.index(b"\n") + 1) + 1
    width = 1 + len(json.loads(content[:end].split(b"\n")[1])["columns"])
    size = 8 + 8 * width
    rows = [content[at + 8 : at + size] for at in range(end, len(content) - size + 1, size)]
    return content[:end], [Record(b"", row) for row in rows]


def join_growing(start: bytes, records: Sequence[Record]) -> bytes:
    return start + b"".join(
        struct.pack("<II", zlib.crc32(r.body), k) + r.body[: len(r.body) // 8 * 8] for k, r in enumerate(records)
    )


def by_growing_head(whole: tuple[bytes, ...], chance: random.Random) -> bytes:
    """Mostly rows; now and then the words at the head."""
    if chance.random() < 0.5:
        return by_records(split_growing, join_growing)(whole, chance)
    first, head, rows = chance.choice(whole).split(b"\n", 2)
    text = mutated(json.loads(head), chance, form="json").encode("utf-8", "surrogatepass").replace(b"\n", b" ")
    return b"\n".join([first, text + b" " * (-(len(first) + len(text) + 2) % 8), rows])


def by_metadata(mark: bytes) -> Mutate:
    """A bag's folder whose metadata has a wrong entry: JSON is YAML."""

    def mutate(whole: tuple[bytes, ...], chance: random.Random) -> bytes:
        from ruamel.yaml import YAML

        head, _, tail = chance.choice(whole).partition(mark)
        document = json.loads(json.dumps(YAML(typ="safe").load(head)))
        return mutated(document, chance, form="json").encode("utf-8", "surrogatepass") + mark + tail

    return mutate


_SQL_WORDS = (
    "NULL",
    "x'00ff'",
    "''",
    "'a'",
    "-1",
    "9223372036854775807",
    "1e308",
    "zeroblob(5000000)",
    "randomblob(40)",
)


def by_sqlite(whole: tuple[bytes, ...], chance: random.Random) -> bytes:
    """Tables with odd values, rows and columns, and views in their place, written by SQLite itself."""
    with contextlib.closing(sqlite3.connect(":memory:")) as opened:
        opened.deserialize(chance.choice(whole))
        for _ in range(chance.choice((1, 1, 2, 4))):
            _change_tables(opened, chance)
        opened.commit()
        return opened.serialize()


def _change_tables(opened: sqlite3.Connection, chance: random.Random) -> None:
    tables = [row[0] for row in opened.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
    if not tables:
        return
    table = chance.choice(tables)
    column = chance.choice([row[1] for row in opened.execute(f"PRAGMA table_info({table})")])
    number = chance.choice((*ODD_NUMBERS, *_SQL_WORDS))
    word = f"{number if not isinstance(number, int) else min(number, (1 << 63) - 1)}"
    where = chance.choice(("", " WHERE rowid = 1", " WHERE rowid % 7 = 3"))
    sentence = chance.choice(
        (
            f"UPDATE {table} SET {column} = {word}{where}",
            f"DELETE FROM {table}{where}",
            f"ALTER TABLE {table} RENAME COLUMN {column} TO other",
            f"DROP TABLE {table}",
            f"INSERT INTO {table} SELECT * FROM {table} LIMIT 3",
            f"INSERT INTO {table} ({column}) VALUES ({word})",
            f"ALTER TABLE {table} RENAME TO kept; CREATE VIEW {table} AS SELECT * FROM kept UNION SELECT * FROM kept",
        )
    )
    with contextlib.suppress(sqlite3.Error):
        for one in sentence.split("; "):
            opened.execute(one)


def by_packed(whole: tuple[bytes, ...], chance: random.Random) -> bytes:
    """A MATLAB file with a variable that is unpacked, changed and packed again."""
    content = chance.choice(whole)
    at, elements = 128, []
    while at + 8 <= len(content):
        kind, size = struct.unpack_from("<II", content, at)
        elements.append((kind, content[at + 8 : at + 8 + size]))
        at += 8 + size
    k = chance.randrange(len(elements))
    inside = damaged(zlib.decompress(elements[k][1]), chance)
    elements[k] = (elements[k][0], zlib.compress(inside, 1))
    return content[:128] + b"".join(struct.pack("<II", kind, len(data)) + data for kind, data in elements)


def by_header_lines(whole: tuple[bytes, ...], chance: random.Random) -> bytes:
    """A Blackbox log whose header's values are odd words and numbers, its frames whole."""
    lines = chance.choice(whole).split(b"\n")
    heads = [k for k, line in enumerate(lines) if line.startswith(b"H ")]
    for _ in range(chance.choice((1, 1, 2, 4))):
        k = chance.choice(heads)
        key, _, value = lines[k].partition(b":")
        parts = value.split(b",")
        odd = chance.choice((*ODD_WORDS, *map(str, ODD_NUMBERS), *map(str, ODD_FLOATS)))
        parts[chance.randrange(len(parts))] = odd.replace("\n", " ").encode("utf-8", "surrogatepass")
        match chance.randrange(4):
            case 0:
                parts *= 2
            case 1:
                del parts[chance.randrange(len(parts))]
            case _:
                pass
        lines[k] = key + b":" + b",".join(parts)
    return b"\n".join(lines)
