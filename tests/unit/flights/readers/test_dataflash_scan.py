"""Messages that are followed all at once are those that are walked one at a time, whatever the damage."""

from __future__ import annotations

import numpy as np
import pytest

import made_autopilot_logs as made
from swashplate.flights.readers import dataflash_index

KNOWN = made.dataflash(made.ardupilot_rows(until=24.0))
HEAD_INSIDE = made.dataflash([("MSG", (k, "\xa3\x95 is no head"[:12])) for k in range(40)])
DESCRIBED_LATE = KNOWN[89 * 4 :] + KNOWN


def scanned(content: bytes) -> tuple[object, ...]:
    scan = dataflash_index.Scan(content)
    there = {number: (kind.name, kind.at.tolist()) for number, kind in scan.kinds.items() if kind.at.size}
    return there, scan.lost, scan.unfinished


def walked(content: bytes) -> tuple[object, ...]:
    """Without the chain: types are learned on the way."""
    with pytest.MonkeyPatch.context() as patch:
        nothing = (np.zeros(0, dtype=np.uint32), np.zeros(0, dtype=np.uint8))
        patch.setattr(dataflash_index, "_heads", lambda _: nothing)
        return scanned(content)


@pytest.mark.parametrize("content", [KNOWN, HEAD_INSIDE, DESCRIBED_LATE, KNOWN + KNOWN, b"", KNOWN[:50], KNOWN[3:]])
def test_whole_and_torn_logs(content: bytes) -> None:
    assert scanned(content) == walked(content)


@pytest.mark.parametrize("seed", range(100))
def test_damage_by_chance(seed: int) -> None:
    random = np.random.default_rng(seed)
    content = bytearray(KNOWN)
    for _ in range(int(random.integers(1, 5))):
        at, length = int(random.integers(0, len(content))), int(random.integers(1, 200))
        kind = random.integers(0, 4)
        if kind == 0:
            del content[at : at + length]
        elif kind == 1:
            content[at : at + length] = random.bytes(len(content[at : at + length]))
        elif kind == 2:
            content[at:at] = dataflash_index.HEAD + bytes([int(random.integers(0, 256))])
        else:
            content[at:] = b"\xff" * len(content[at:]) if random.random() < 0.3 else content[at : len(content) - length]
    assert scanned(bytes(content)) == walked(bytes(content))


def test_heads_nearer_than_messages_usually_are_have_room() -> None:
    content = (dataflash_index.HEAD + b"\x07") * (3 * dataflash_index.SOME) + dataflash_index.HEAD
    heads, numbers = dataflash_index._heads(content)
    assert np.array_equal(heads, 3 * np.arange(3 * dataflash_index.SOME))
    assert np.array_equal(np.unique(numbers), [7])
