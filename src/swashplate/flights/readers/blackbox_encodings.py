"""The fields of Blackbox frames, decoded at many places of the file at once (NumPy instead of a loop over bytes).

A frame has no length: where it ends is known when its fields are decoded. So every byte that may begin a frame is taken
as a beginning, all of them are decoded together, field by field, and `blackbox_frames` then walks from end to end.

Source: "Blackbox logging internals" of Betaflight's documentation (section "Field encoders"); TAG2_3SVARIABLE, which it
leaves out, has 2 bits a value, or 5, 5 and 4, or 8, 7 and 7, or whole bytes as TAG2_3S32.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swashplate.flights.readers.blackbox_header import FrameLayout

Bytes = NDArray[np.uint8]
Whole = NDArray[np.int64]

PADDING = 64  # zero bytes behind the file's last: a field that begins inside reads no further
_GROUPS = {6: 8, 7: 3, 8: 4, 10: 3}  # encodings that write several fields together, at most so many
_BITS = (4, 5)  # Elias delta: a row of bits that only a field of whole bytes ends
_NOTHING = 9


def groups(encodings: tuple[int, ...]) -> list[tuple[int, int, int]]:
    """Fields that are written together: (encoding, first, end).

    Neighbours of one encoding, as many as it holds. Elias delta: up to the next field that writes whole bytes, signed
    and unsigned alike, and over fields that write nothing (as the C decoder of blackbox-tools reads it).
    """
    runs, at = [], 0
    while at < len(encodings):
        kind, end = encodings[at], at + 1
        if kind in _BITS:
            while end < len(encodings) and encodings[end] in (*_BITS, _NOTHING):
                end += 1
        while end < len(encodings) and encodings[end] == kind and end - at < _GROUPS.get(kind, 1):
            end += 1
        runs.append((encodings[at], at, end))
        at = end
    return runs


def decoded(data: Bytes, places: Whole, layout: FrameLayout) -> tuple[Whole, Whole]:
    """What is written of each field at these places, before prediction.

    Args:
        data: the file's bytes and `PADDING` zeros behind them.
        places: of the bytes behind the frame's letter, shape (n,).

    Returns:
        Written numbers, shape (fields, n), and where each frame ends, shape (n,); −1 where it runs out of the file or
        a number has too many bytes.
    """
    reading = _Reading(data, places)
    written = np.zeros((len(layout.names), places.size), dtype=np.int64)
    for encoding, first, end in groups(layout.encodings):
        if encoding in _BITS:
            reading.elias(written[first:end], layout.encodings[first:end])
        else:
            reading.group(encoding, written[first:end])
    ends = np.where(reading.bad | (reading.at > data.size - PADDING), -1, reading.at)
    return written, ends


def _signed(values: Whole, bits: int) -> Whole:
    """Two's complement of so many bits."""
    return np.asarray(((values & ((1 << bits) - 1)) ^ (1 << (bits - 1))) - (1 << (bits - 1)))


def _unfolded(values: Whole) -> Whole:
    """Zig-zag numbers as signed ones."""
    return np.asarray((values >> 1) ^ -(values & 1))


class _Reading:
    """Places in the file that move on as fields are read."""

    def __init__(self, data: Bytes, places: Whole) -> None:
        self.data, self.last = data, data.size - PADDING
        self.at = places.astype(np.int64)
        self.bad = np.zeros(places.size, dtype=np.bool_)

    def byte(self, chosen: Whole | slice = slice(None)) -> Whole:
        """The next byte; behind the end a zero."""
        values = self.data[np.minimum(self.at[chosen], self.last)].astype(np.int64)
        self.at[chosen] += 1
        return np.asarray(values)

    def variable(self, chosen: Whole | slice = slice(None)) -> Whole:
        """Seven bits a byte, the lowest first; at most 32 bits."""
        value = self.byte(chosen)
        more = np.flatnonzero(value & 0x80)
        value &= 0x7F
        where = np.arange(self.at.size)[chosen] if more.size else None
        for shift in (7, 14, 21, 28):
            if where is None or not more.size:
                break
            byte = self.byte(where[more])
            value[more] |= (byte & 0x7F) << shift
            more = more[(byte & 0x80) != 0]
        if where is not None and more.size:
            self.bad[where[more]] = True
        return np.asarray(value & 0xFFFFFFFF)

    def group(self, encoding: int, out: Whole) -> None:
        """Reads the fields of a group into `out`, shape (fields, n)."""
        if encoding == 0:
            out[0] = _unfolded(self.variable())
        elif encoding == 1:
            out[0] = self.variable()
        elif encoding == 3:
            out[0] = -_signed(self.variable(), 14)
        elif encoding == 6:
            self._tag8_8svb(out)
        elif encoding == 8:
            self._tag8_4s16(out)
        elif encoding in (7, 10):
            values = self._tag2(variable=encoding == 10)
            for row, value in zip(out, values, strict=False):  # a short group at the frame's end: the rest is filler
                row[:] = value

    def _tag8_8svb(self, out: Whole) -> None:
        if len(out) == 1:  # a single field has no tag
            out[0] = _unfolded(self.variable())
            return
        tag = self.byte()
        for i, row in enumerate(out):
            there = np.flatnonzero(tag & (1 << i))
            row[there] = _unfolded(self.variable(there))

    def _tag8_4s16(self, out: Whole) -> None:
        tag = self.byte()
        nibble = self.at * 2  # place in half bytes: values follow each other without filling
        for i in range(4):
            size = np.array([0, 1, 2, 4])[(tag >> (2 * i)) & 3]
            first = np.minimum(nibble >> 1, self.last)
            window = self.data[first].astype(np.int64) << 16
            window |= self.data[first + 1].astype(np.int64) << 8
            window |= self.data[first + 2]
            window >>= np.where(nibble & 1, 20, 24) - 4 * size
            if i < len(out):
                for half_bytes in (1, 2, 4):
                    there = size == half_bytes
                    out[i][there] = _signed(window[there], 4 * half_bytes)
            nibble += size
        self.at = (nibble + 1) >> 1

    def _tag2(self, *, variable: bool) -> tuple[Whole, Whole, Whole]:
        """Three values behind two bits that say how they are packed."""
        lead = self.byte()
        a, b, c = (_signed(lead >> shift, 2) for shift in (4, 2, 0))
        kind = lead >> 6
        there = np.flatnonzero(kind == 1)
        second = self.byte(there)
        if variable:
            a[there] = _signed(lead[there] >> 1, 5)
            b[there] = _signed((lead[there] << 4) | (second >> 4), 5)
        else:
            a[there], b[there] = _signed(lead[there], 4), _signed(second >> 4, 4)
        c[there] = _signed(second, 4)
        there = np.flatnonzero(kind == 2)
        second, third = self.byte(there), self.byte(there)
        if variable:
            a[there] = _signed((lead[there] << 2) | (second >> 6), 8)
            b[there] = _signed((second << 1) | (third >> 7), 7)
            c[there] = _signed(third, 7)
        else:
            a[there], b[there], c[there] = _signed(lead[there], 6), _signed(second, 6), _signed(third, 6)
        there = np.flatnonzero(kind == 3)
        for i, row in enumerate((a, b, c)):
            row[there] = self._whole_bytes(there, 1 + ((lead[there] >> (2 * i)) & 3))
        return a, b, c

    def _whole_bytes(self, chosen: Whole, count: Whole) -> Whole:
        """Signed values of one to four bytes, the lowest first."""
        value = np.zeros(chosen.size, dtype=np.int64)
        for i in range(4):
            there = np.flatnonzero(count > i)
            value[there] |= self.byte(chosen[there]) << (8 * i)
        for size in (1, 2, 3, 4):
            there = count == size
            value[there] = _signed(value[there], 8 * size)
        return value

    def elias(self, out: Whole, encodings: tuple[int, ...]) -> None:
        """Elias delta numbers in a row of bits, filled up to whole bytes behind the last."""
        bit = self.at * 8
        for row, encoding in zip(out, encodings, strict=True):
            if encoding == _NOTHING:
                continue
            first = np.minimum(bit >> 3, self.last)
            window = np.zeros(bit.size, dtype=np.uint64)
            for i in range(8):
                window = (window << np.uint64(8)) | self.data[first + i].astype(np.uint64)
            window <<= (bit & 7).astype(np.uint64)
            zeros = np.zeros(bit.size, dtype=np.int64)  # in front: one less than the bits of the length
            for i in range(6):
                zeros += (window >> np.uint64(63 - i)) == 0
            self.bad |= zeros > 5
            zeros = np.minimum(zeros, 5)
            length = _bits(window, zeros, zeros + 1)
            self.bad |= length > 32
            length = np.clip(length, 1, 32)
            behind = 2 * zeros + 1
            value = (np.int64(1) << (length - 1)) | _bits(window, behind, length - 1)
            behind += length - 1
            escaped = value == 0xFFFFFFFF  # one more bit tells the two largest numbers apart
            value = np.where(escaped, value - 1 + _bits(window, behind, np.ones_like(behind)), value - 1)
            bit += behind + escaped
            row[:] = _unfolded(value) if encoding == 5 else value
        self.at = (bit + 7) >> 3


def _bits(window: NDArray[np.uint64], skipped: Whole, count: Whole) -> Whole:
    """So many bits of a 64-bit window behind those that are skipped, the highest first."""
    left = window << skipped.astype(np.uint64)
    # Two shifts: one by 64, for no bits at all, would do nothing.
    return (left >> np.uint64(1) >> (63 - count).astype(np.uint64)).astype(np.int64)
