"""Channels and fields of a log as they are drawn, kept for the next zoom as long as there is room."""

from __future__ import annotations

import threading
from collections import OrderedDict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.flights.stored_column import StoredColumn

ROOM = 96 << 20
"""Bytes that are kept of one log beside its flight; the channel that was drawn last is kept whatever its size."""


@dataclass(frozen=True)
class DrawnChannel:
    """A channel as it is drawn.

    Attributes:
        time: stamps [s], shape (n,).
        numbers: in the unit of the screen, as the log stores them where it has few bits, shape (n,).
        unit: of the screen.
        breaks: samples before which there is a gap.
        unshared: what of it is held here alone, and no flight has.
    """

    time: Array
    numbers: Array | StoredColumn
    unit: str
    breaks: NDArray[np.int64]
    unshared: tuple[NDArray[np.generic], ...] = ()

    @property
    def values(self) -> Array:
        """Its numbers, each in 64 bits."""
        return self.numbers.numbers if isinstance(self.numbers, StoredColumn) else self.numbers


class DrawnChannels:
    """The channels that were drawn last, by name, within `room` bytes."""

    def __init__(self, room: int = ROOM) -> None:
        self._room, self._lock = room, threading.Lock()
        self._kept: OrderedDict[str, DrawnChannel] = OrderedDict()

    def get(self, name: str) -> DrawnChannel | None:
        """A channel that is kept still; None for any other."""
        with self._lock:
            if name in self._kept:
                self._kept.move_to_end(name)
            return self._kept.get(name)

    def keep(self, name: str, drawn: DrawnChannel) -> None:
        """Keep a channel, and drop those that were not asked for the longest."""
        with self._lock:
            self._kept[name] = drawn
            self._kept.move_to_end(name)
            while len(self._kept) > 1 and self.size > self._room:
                self._kept.popitem(last=False)

    def same_times(self, time: Array) -> Array:
        """These stamps, as another channel that is kept has them: fields of one message share theirs."""
        with self._lock:
            return next((d.time for d in reversed(self._kept.values()) if np.array_equal(d.time, time)), time)

    @property
    def size(self) -> int:
        """Bytes that are kept beside the flight."""
        arrays = {id(array): array.nbytes for drawn in self._kept.values() for array in drawn.unshared}
        return sum(arrays.values())
