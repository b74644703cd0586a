"""The frames of one Blackbox log: found from end to end, resynchronised behind damage.

A frame carries neither length nor checksum. It counts where the byte behind it begins another one; otherwise the search
goes on at the next byte that may begin a frame, and P frames, which build on those before them, wait for the next I
frame.

Source: "Blackbox logging internals" of Betaflight's documentation ("Log payload", "Log validation"); the payloads of
events from the firmwares' lists of events.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass, field

import numpy as np

from swashplate.flights.readers.blackbox_encodings import PADDING, Bytes, Whole, decoded
from swashplate.flights.readers.blackbox_header import Header
from swashplate.flights.readers.source import refuse_oversized

_BLOCK = 1 << 22  # bytes that are searched for beginnings at once
_AT_ONCE = 1 << 22  # numbers that are decoded at once: 32 MB
_END = re.compile(rb"End of log[ -~]{0,40}\0")  # some firmwares add why they were disarmed
_NUMBERS = {0: 1, 14: 2, 15: 1, 30: 2, 50: 1, 51: 1, 52: 1}  # events whose payload is so many variable bytes
_NAMES = {
    0: "sync beep", 14: "logging resumes", 15: "disarmed", 30: "flight mode", 50: "governor state",
    51: "rescue state", 52: "airborne state",
}  # fmt: skip


@dataclass(frozen=True)
class FrameDamage:
    """An event: what it is, its numbers, and how many main frames stand before it."""

    kind: int
    text: str
    numbers: tuple[float, ...]
    after: int


@dataclass
class FoundFrames:
    """What stands in a log.

    Attributes:
        written: numbers of the main frames before prediction, shape (fields, n).
        intra: which of them are I frames, shape (n,).
        broken: main frames behind which bytes were lost, shape (m,): places in `intra`.
        others: by letter (S, G, H): written numbers (fields, k), and how many main frames stand before each (k,).
        events: in order.
        lost: bytes that belong to no frame; places: in so many stretches; waiting: P frames without an I frame.
        ended: the log has its end marker.
    """

    written: Whole
    intra: np.ndarray
    broken: Whole
    others: dict[str, tuple[Whole, Whole]] = field(default_factory=dict)
    events: list[FrameDamage] = field(default_factory=list)
    lost: int = 0
    places: int = 0
    waiting: int = 0
    unfinished: int = 0
    ended: bool = False


class _Walk:
    """From end to end through the frames of a log."""

    def __init__(self, content: bytes, header: Header, *, where: str) -> None:
        self.content, self.header, self.where = content, header, where
        self.letters = "".join(letter for letter in "IPSGH" if letter in header.layouts)
        self.beginnings = re.compile(f"[{self.letters}E]".encode())
        self.following = frozenset(self.letters.encode() + b"E")
        self.found = FoundFrames(np.zeros((0, 0), np.int64), np.zeros(0, np.bool_), np.zeros(0, np.int64))
        self.broken: list[int] = []
        self.parts: dict[str, list[Whole]] = {letter: [] for letter in self.letters}
        self.orders: dict[str, list[int]] = {letter: [] for letter in self.letters}
        self.main = 0  # main frames that count so far
        self.whole = False  # an I frame stands before, and nothing was lost since
        self.searching = False
        self.at = 0

    def run(self) -> FoundFrames:
        size = len(self.content)
        data = np.frombuffer(self.content + bytes(PADDING), dtype=np.uint8)
        starts = np.isin(np.arange(256), list(self.letters.encode()))
        width = max(len(self.header.layouts[letter].names) for letter in self.letters)
        for block in range(0, size, _BLOCK):
            places = np.flatnonzero(starts[data[block : min(block + _BLOCK, size)]]) + block
            step = max(_AT_ONCE // width, 1024)
            cuts = [*places[step::step].tolist(), min(block + _BLOCK, size)]
            for i, stop in enumerate(cuts):
                if self.at < stop and not self.found.ended:
                    self._piece(data, places[i * step : (i + 1) * step], stop)
        return self._gathered(size)

    def _piece(self, data: Bytes, places: Whole, stop: int) -> None:
        """Walks up to `stop` over frames that begin at some of these places."""
        places = places[places >= self.at]
        base = self.at
        ends = np.full(stop - base, -1, dtype=np.int64)
        letters = data[places]
        decodings: dict[str, tuple[Whole, Whole]] = {}
        for letter in self.letters:
            mine = places[letters == ord(letter)]
            written, after = decoded(data, mine + 1, self.header.layouts[letter])
            ends[mine - base] = after
            decodings[letter] = (mine, written)
        taken = self._steps(ends.data, base, stop)
        for letter, chosen in taken.items():
            if chosen:
                mine, written = decodings[letter]
                self.parts[letter].append(written[:, np.searchsorted(mine, np.asarray(chosen))].astype(np.int64))
        frames = sum(map(len, self.orders.values()))
        width = max(len(layout.names) for layout in self.header.layouts.values())
        refuse_oversized(8 * width * frames, size=len(self.content), where=self.where, what="the row of frames")

    def _steps(self, ends: memoryview, base: int, stop: int) -> dict[str, list[int]]:
        content, size, following = self.content, len(self.content), self.following
        taken: dict[str, list[int]] = {letter: [] for letter in self.letters}
        intra, inter = taken["I"], taken["P"]
        orders_i, orders_p = self.orders["I"], self.orders["P"]
        at, main, complete = self.at, self.main, self.whole
        while at < stop:
            letter = content[at]
            end = ends[at - base] if letter != 69 else -1
            if letter == 69:  # E
                self.main = main
                end = self._event(at)
                if self.found.ended:
                    break
            if end < 0 or (end < size and content[end] not in following):
                if not self.searching:
                    self.found.places += 1
                    self.searching = True
                    self.broken.append(main)
                    complete = False
                match = self.beginnings.search(content, at + 1)
                after = match.start() if match else size
                if after == size and end < 0:
                    self.found.unfinished += size - at
                else:
                    self.found.lost += after - at
                at = after
                continue
            self.searching = False
            if letter == 73:  # I
                complete = True
                intra.append(at)
                orders_i.append(main)
                main += 1
            elif letter == 80:  # P
                if complete:
                    inter.append(at)
                    orders_p.append(main)
                    main += 1
                else:
                    self.found.waiting += 1
            elif letter != 69:
                taken[chr(letter)].append(at)
                self.orders[chr(letter)].append(main)
            at = end
        self.at, self.main, self.whole = at, main, complete
        return taken

    def _event(self, at: int) -> int:
        """Reads an event at this place; returns where it ends, -1 where it is none."""
        content, place = self.content, at + 2
        kind = content[at + 1] if at + 1 < len(content) else -1
        text, numbers = _NAMES.get(kind, f"event {kind}"), list[float]()
        if kind == 255:
            last = _END.match(content, place)
            self.found.ended = last is not None
            return last.end() if last else -1
        if kind in _NUMBERS:
            for _ in range(_NUMBERS[kind]):
                value, place = _variable(content, place)
                numbers.append(float(value))
        elif kind == 13 and place < len(content):
            text = f"adjustment {content[place] & 127}"
            if content[place] & 128:
                numbers = list(struct.unpack("<f", content[place + 1 : place + 5].ljust(4, b"\0")))
                place += 5
            else:
                value, place = _variable(content, place + 1)
                numbers = [float((value >> 1) ^ -(value & 1))]
        elif kind in (100, 101) and place < len(content):
            length = content[place]
            text = content[place + 1 : place + 1 + length].decode("utf-8", "replace") if kind == 101 else "custom data"
            place += 1 + length
        else:
            return -1
        if not 0 <= place <= len(content) or not np.all(np.isfinite(numbers)):
            return -1
        if place == len(content) or content[place] in self.following:
            self.found.events.append(FrameDamage(kind, text, tuple(numbers), self.main))
        return place

    def _gathered(self, size: int) -> FoundFrames:
        frames = self.found
        if not frames.ended:
            frames.unfinished += max(size - self.at, 0) if self.at < size else 0
        joined = {
            letter: np.concatenate(parts, axis=1)
            if parts
            else np.zeros((len(self.header.layouts[letter].names), 0), np.int64)
            for letter, parts in self.parts.items()
        }
        frames.intra = np.zeros(self.main, dtype=np.bool_)
        frames.intra[self.orders["I"]] = True
        frames.written = np.zeros((len(self.header.layouts["I"].names), self.main), dtype=np.int64)
        frames.written[:, self.orders["I"]] = joined["I"]
        frames.written[:, self.orders["P"]] = joined["P"]
        frames.broken = np.unique(np.asarray(self.broken, dtype=np.int64))
        for letter in "SGH":
            if letter in joined and joined[letter].size:
                frames.others[letter] = (joined[letter], np.asarray(self.orders[letter], dtype=np.int64))
        return frames


def _variable(content: bytes, place: int) -> tuple[int, int]:
    """A number of variable bytes and the place behind it; place -1 where it is none."""
    value = 0
    for shift in range(0, 35, 7):
        if not 0 <= place < len(content):
            return 0, -1
        value |= (content[place] & 0x7F) << shift
        place += 1
        if not content[place - 1] & 0x80:
            return value & 0xFFFFFFFF, place
    return 0, -1


def find_frames(content: bytes, header: Header, *, stop: int, where: str) -> FoundFrames:
    """The frames between the header and `stop` [bytes].

    Raises:
        FlightError: where frames of next to no bytes would need more memory than such a file may.
    """
    return _Walk(content[header.end : stop], header, where=where).run()
