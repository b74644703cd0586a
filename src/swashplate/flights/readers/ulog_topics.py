"""The topics of a ULog file: pyulog (Goppert, Kueng and others) reads what describes them, their data stay in the file.

pyulog gets a short log: every message that is no data, and of the data one message of each size and number, so that it
says of which topic it is and whether it fits its description. Where it would do otherwise with the long log (data
appended later, a number given twice, descriptions within the data), it gets all of it.
"""

from __future__ import annotations

import contextlib
import io
import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.errors import FlightError
from swashplate.extras import library
from swashplate.flights.readers import dataflash
from swashplate.flights.readers.dataflash import Wanted
from swashplate.flights.readers.dataflash_index import MessageKind
from swashplate.flights.readers.source import Places, Stored, part
from swashplate.flights.readers.ulog_messages import HEADER, WholeMessages

_LARGEST = 65535  # bytes of a message: its size is two bytes
_LONGEST = 10000  # bytes of a message of an unknown kind: pyulog looks into longer ones
_SYNC = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"
_MARK = "swashplate: the short log ends here"
_CLOCK = b"swashplate_clock"
_END = (1 << 32) - 1  # behind every place in a file
_FLAGS = struct.pack("<HB", 40, ord("B"))


@dataclass(frozen=True)
class Topic:
    """The data of one instance of a topic.

    Attributes:
        name, instance: of the topic.
        kind: what the data are and where they stand.
        content: the bytes they stand in.
    """

    name: str
    instance: int
    kind: MessageKind
    content: Stored

    def __len__(self) -> int:
        return self.kind.at.size


class Topics:
    """What a ULog file holds.

    Attributes:
        log: pyulog's object: parameters, texts, dropouts. Its data are not those of the file.
        topics: by name and instance, as pyulog sorts them.
        lost, unfinished: see `WholeMessages`.

    Raises:
        FlightError: where pyulog cannot make anything of it.
        MissingLibraryError: where pyulog is not installed.
    """

    def __init__(self, content: Stored, where: str) -> None:
        self._content, self._where = content, where
        self._messages = messages = WholeMessages(content)
        self.lost, self.unfinished = messages.lost, messages.unfinished
        self._begin = next((at for kind, at, _ in messages.others if kind in "ALC"), len(content))
        self._subscribed = self._subscriptions()
        topics = None if self._subscribed is None else self._of_short_log()
        if topics is None:
            self.log = _parsed(self._joined(self._all()), where)
            topics = [_in_memory(data) for data in self.log.data_list]
        self.topics = topics

    def _all(self) -> list[tuple[int, int]]:
        data = [(at, at + size) for (_, size), places in self._messages.data.items() for at in places.tolist()]
        return sorted([*data, *((at, end) for _, at, end in self._messages.others)])

    def _bytes(self, at: int, end: int) -> bytes:
        return bytes(part(self._content, at, end))

    def _joined(self, places: Sequence[tuple[int, int]]) -> bytes:
        """The file's head and some of its messages."""
        body = [self._bytes(at, end) for at, end in places]
        if self.lost and body and body[0].startswith(_FLAGS):
            # Flag bits point at data by the file's own offsets, which no longer hold.
            body[0] = _FLAGS + bytes(40)
        return b"".join([self._content[:HEADER], *body])

    def _subscriptions(self) -> dict[int, int] | None:
        """Where each number is given to a topic; None where the short log would not be read as the long one is."""
        if len(self._content) < HEADER:
            return None
        given: dict[int, int] = {}
        for kind, at, end in self._messages.others:
            size = end - at - 3
            if kind == "B" and not self.lost and at < self._begin:
                flags = self._bytes(at + 3, end)
                if flags[8] & 1 and any(flags[16:40]):
                    return None  # data were appended
            if kind in ("RSO" if at < self._begin else "FBR") and size > _LONGEST:
                return None
            if kind in "FBR" and at >= self._begin and _SYNC in self._bytes(at + 3, end):
                return None
            if kind == "A" and size >= 3:
                (number,) = struct.unpack("<H", self._bytes(at + 4, at + 6))
                if number in given:
                    return None
                given[number] = at
        if any(size > _LONGEST and places[0] < self._begin for (_, size), places in self._messages.data.items()):
            return None
        return given

    def _of_short_log(self) -> list[Topic] | None:
        given = self._subscribed or {}
        places = [(at, end) for _, at, end in self._messages.others]
        first = dict[tuple[int, int], NDArray[np.uint32]]()  # data behind the message that gives their number
        for (number, size), at in self._messages.data.items():
            split = int(np.searchsorted(at, np.uint32(given.get(number, _END))))
            begin = int(np.searchsorted(at, np.uint32(self._begin)))
            before = [*at[:begin].tolist(), *at[begin:split][:1].tolist()]
            if split < at.size:
                first[number, size] = at[split:]
                before.append(int(at[split]))
            places += [(place, place + size) for place in before]
        places.sort()
        log = self._short(places, [], {})
        if log is None:
            return None
        topics = []
        for data in log.data_list:
            sizes = sorted(size for number, size in first if number == data.msg_id)
            dtype = np.dtype([(name, values.dtype) for name, values in data.data.items()])
            fitting = [size for size in sizes if size - 5 >= dtype.itemsize][: _rows(data)]
            at = np.concatenate([first[data.msg_id, size] for size in fitting])
            at.sort()
            topics.append(Topic(data.name, data.multi_id, _kind(data, dtype, at, head=5), self._content))
        stamped = [at for kind, at, _ in self._messages.others if kind in "OP" and at >= self._begin]
        if stamped:  # each has the latest stamp of the data before it
            edges = np.array(stamped, np.int64)
            latest = dataflash.latest(self._content, [_clock(topic.kind) for topic in topics], edges)
            log = self._short(places, stamped, dict(zip(stamped, latest.tolist(), strict=True)))
        self.log = log
        return topics if log is not None else None

    def _short(self, places: Sequence[tuple[int, int]], stamped: Sequence[int], latest: dict[int, int]) -> Any:
        """The short log as pyulog reads it; None where it does not come to its end."""
        number = next(number for number in range(1 << 16) if number not in (self._subscribed or {}))
        defined = [place for place in places if place[0] < self._begin]
        head = self._joined(defined)
        out = [head]
        if stamped:
            out.append(_message("F", _CLOCK + b":uint64_t timestamp;"))
            out.append(_message("A", struct.pack("<BH", 0, number) + _CLOCK))
        for at, end in places[len(defined) :]:
            if at in latest:
                out.append(_message("D", struct.pack("<HQ", number, latest[at])))
            out.append(self._bytes(at, end))
        out.append(_message("L", b"6" + bytes(8) + _MARK.encode()))
        log = _parsed(b"".join(out), self._where)
        if not log.logged_messages or log.logged_messages.pop().message != _MARK:
            return None
        return log


def _message(kind: str, payload: bytes) -> bytes:
    return struct.pack("<HB", len(payload), ord(kind)) + payload


def _parsed(content: bytes, where: str) -> Any:
    """What pyulog makes of the bytes; whatever it stumbles over is the file's fault."""
    core = library("pyulog.core", what="a PX4 ULog file", where=where)
    arrays = re.finditer(rb"\[(\d{1,20})\] ", content)  # a bracket is found ten times as fast as a letter before one
    if any(
        int(array[1]) > _LARGEST and re.match(rb"\w", content[array.start() - 1 : array.start()]) for array in arrays
    ):
        raise FlightError("describes an array that no message can hold: it is damaged or forged.", where=where)
    try:
        with contextlib.redirect_stdout(io.StringIO()), np.errstate(all="ignore"):
            return core.ULog(io.BytesIO(content))
    except Exception as error:  # a damaged file can raise anything in there
        raise FlightError(
            f"does not read as a ULog file: {str(error) or type(error).__name__}.",
            where=where,
            hint="It is damaged: copy it again.",
        ) from error


def _rows(data: Any) -> int:
    return len(next(iter(data.data.values()), ()))


def _kind(data: Any, dtype: np.dtype[np.void], at: Places, *, head: int) -> MessageKind:
    return MessageKind(data.msg_id, data.name, dtype, dict.fromkeys(dtype.names or (), 1.0), {}, at, head)


def _clock(kind: MessageKind) -> Wanted:
    """The stamps, as pyulog takes them: eight bytes."""
    _, offset = kind.place("timestamp")
    stamp = np.dtype({"names": ["timestamp"], "formats": ["<u8"], "offsets": [offset], "itemsize": offset + 8})
    return Wanted(
        MessageKind(kind.number, kind.name, stamp, {"timestamp": 1.0}, {}, kind.at, kind.head), kind.at, ["timestamp"]
    )


def _in_memory(data: Any) -> Topic:
    """A topic whose data pyulog has read."""
    dtype = np.dtype([(name, values.dtype) for name, values in data.data.items()])
    rows = np.empty(_rows(data), dtype)
    for name, values in data.data.items():
        rows[name] = values
    at = np.arange(rows.size, dtype=np.int64) * dtype.itemsize
    return Topic(data.name, data.multi_id, _kind(data, dtype, at, head=0), rows.tobytes())
