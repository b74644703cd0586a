"""Messages of a log followed all at once: the head of each is joined to the one that stands where the message ends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SOME = 1 << 16  # heads that are looked at at a time: they stay in the processor's cache


class JoinedHeads:
    """What looks like a head, each joined to the one at which its message ends.

    Args:
        heads: where each stands, increasing, shape (n,). numbers: of the types behind them, shape (n,).
        lengths: of messages with their heads, by number; 0 for those that are not known.
    """

    def __init__(
        self, heads: NDArray[np.uint32], numbers: NDArray[np.unsignedinteger], lengths: NDArray[np.uint32]
    ) -> None:
        self.heads, self.numbers = heads, numbers
        self._joined = np.zeros(heads.size, dtype=np.bool_)
        for start in range(0, heads.size - 1, SOME):
            some = heads[start : start + SOME + 1]
            after = lengths.take(numbers[start : start + some.size - 1])
            after += some[:-1]
            np.equal(after, some[1:], out=self._joined[start : start + some.size - 1])
        # The others may be joined to a later head, over what only looks like one.
        self._breaks = np.flatnonzero(~self._joined)
        ends = heads[self._breaks] + lengths[numbers[self._breaks]]
        self._following = np.searchsorted(heads, ends)
        inside = (self._following < heads.size) & (ends > heads[self._breaks])
        self._joined[self._breaks[inside]] = heads[self._following[inside]] == ends[inside]

    def run(self, at: int) -> tuple[list[tuple[int, int]], int]:
        """Rows of heads (from, to) that follow each other from a byte on, and the byte behind them."""
        index = int(np.searchsorted(self.heads, np.uint32(at)))
        if index >= self.heads.size or self.heads[index] != at or not self._joined[index]:
            return [], at
        rows = []
        while True:  # from one break to the next
            one = int(np.searchsorted(self._breaks, index))
            stop = int(self._breaks[one])
            if not self._joined[stop]:
                rows.append((index, stop))
                return rows, int(self.heads[stop])
            rows.append((index, stop + 1))
            index = int(self._following[one])
