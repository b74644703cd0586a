"""What is drawn of a log is kept within bounds, the longest unused goes first, and the numbers are the flight's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import made_autopilot_logs as made
from swashplate.flights.stored_column import StoredColumn
from swashplate.links.logs import drawn_channels
from swashplate.links.logs.bins import trace
from swashplate.links.logs.channel_groups import shown_unit
from swashplate.links.logs.code_lines import Read
from swashplate.links.logs.drawn_channels import DrawnChannel, DrawnChannels
from swashplate.links.logs.opened import Opened

NOWHERE = np.zeros(0, dtype=np.int64)


def drawn(size: int, time: np.ndarray | None = None) -> DrawnChannel:
    stamps = np.arange(float(size)) if time is None else time
    values = np.ones(stamps.size, dtype=np.float32)
    return DrawnChannel(stamps, StoredColumn(values), "", NOWHERE, (stamps, values))


def test_what_was_not_asked_for_the_longest_goes_first() -> None:
    kept = DrawnChannels(room=3 * 12 * 100)
    for name in "abc":
        kept.keep(name, drawn(100))
    assert kept.get("a") is not None
    kept.keep("d", drawn(100))
    assert kept.get("b") is None
    assert all(kept.get(name) for name in "acd")
    assert kept.size == 3 * 12 * 100
    kept.keep("large", drawn(1000))
    assert kept.get("large") is not None, "what is drawn now is kept whatever its size"
    assert not any(kept.get(name) for name in "acd")


def test_fields_of_one_message_share_their_times() -> None:
    kept, first = DrawnChannels(room=10_000), drawn(100)
    kept.keep("a", first)
    again = kept.same_times(np.arange(100.0))
    assert again is first.time
    kept.keep("b", drawn(100, again))
    assert kept.size == 100 * (8 + 4 + 4)
    assert kept.same_times(np.arange(100.0) + 1e-9) is not first.time


@pytest.fixture
def opened(tmp_path: Path) -> Opened:
    path = tmp_path / "a.bin"
    path.write_bytes(made.dataflash(made.ardupilot_rows()))
    log = Opened(1, path, Read(path.name))
    log.load(log.read)
    assert log.fields is not None
    return log


def test_channels_of_a_log_cost_nothing_beside_the_flight(opened: Opened) -> None:
    for name in opened.ready.channels:
        shown, values = opened.shown(name), opened.ready.values(name)
        _, factor = shown_unit(opened.ready, name)
        assert np.array_equal(shown.values, values * factor)
        part = trace(shown.time, shown.numbers, start=-np.inf, stop=np.inf, bins=20, breaks=shown.breaks)
        whole = trace(shown.time, shown.values, start=-np.inf, stop=np.inf, bins=20, breaks=shown.breaks)
        assert np.array_equal(part.time, whole.time)
        assert np.array_equal(part.values, whole.values)
    held = {name for name in opened.ready.channels if isinstance(opened.shown(name).numbers, StoredColumn)}
    assert {"p", "q", "r", "mixer_roll"} <= held
    assert opened._channels.size <= 8 * sum(opened.shown(n).time.size for n in opened.ready.channels if n not in held)


def test_browsing_every_field_stays_within_its_room(opened: Opened, monkeypatch: pytest.MonkeyPatch) -> None:
    assert opened.fields is not None
    opened._channels = DrawnChannels(room=20_000)
    for name in opened.fields.listed:
        first = opened.shown(name)
        assert opened._channels.size <= max(20_000, sum(array.nbytes for array in first.unshared))
    names = list(opened.fields.listed)
    assert opened._channels.get(names[0]) is None, "the first has gone"
    again = opened.shown(names[0])
    assert np.array_equal(again.values, opened.fields.read(names[0])[1])
    assert drawn_channels.ROOM < 0.1 * 2**30
