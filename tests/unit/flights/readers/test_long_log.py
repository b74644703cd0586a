"""A long log: what is decoded of it and how much memory that takes are counted, and the numbers are the short way's."""

from __future__ import annotations

import os
import pickle
import tracemalloc
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import made_autopilot_logs as made
import swashplate as sp
from swashplate import files
from swashplate.errors import FlightError
from swashplate.flights.readers import dataflash, log_fields, source
from swashplate.flights.readers.dataflash import Wanted
from swashplate.flights.readers.source import Stored

FORMATS = {**made.ARDUPILOT, "LONG": (44, "Q" + 15 * "f", "TimeUS," + ",".join(f"V{k}" for k in range(15)))}
SIZE = 20 << 20
PERIOD = 30_000_000  # us


def repeated(rows: Sequence[made.Row], copies: int) -> bytes:
    """Rows again and again, each time later."""
    head, once = made.dataflash([], FORMATS), made.dataflash(rows, FORMATS)
    cells = np.tile(np.frombuffer(once, np.uint8, offset=len(head)), (copies, 1))
    at = np.array([kind.at for kind in dataflash.kinds(once)], dtype=object)
    stamps = np.sort(np.concatenate(at).astype(np.int64))[:, None] - len(head) + 3 + np.arange(8)
    times = np.ascontiguousarray(cells[:, stamps]).view("<u8")[..., 0]
    times += (PERIOD * np.arange(copies, dtype=np.uint64))[:, None]
    cells[:, stamps] = times[..., None].view(np.uint8)
    return head + cells.tobytes()


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """20 MB, of which half is a message that the schema does not know."""
    rows = [row for row in made.ardupilot_rows() if row[0] not in ("SIDS", "SIDD", "MODE", "EV", "PARM", "MSG")]
    times = np.linspace(rows[0][1][0], rows[0][1][0] + PERIOD - 1e6, 3000).astype(int).tolist()
    rows += [("LONG", (t, *np.sin(np.arange(15) + 1e-6 * t).tolist())) for t in times]
    rows.sort(key=lambda row: row[1][0])
    content = repeated(rows, 1 + SIZE // len(made.dataflash(rows, FORMATS)))
    path = tmp_path_factory.mktemp("long") / "long.bin"
    path.write_bytes(content)
    return path


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """How many numbers were decoded, by message and field."""
    counts: dict[str, int] = {}
    decode = dataflash.decoded

    def counting(content: Stored, wanted: Sequence[Wanted]) -> list[dict[str, NDArray[np.generic]]]:
        for kind, at, names in wanted:
            for name in names:
                counts[f"{kind.name}.{name}"] = counts.get(f"{kind.name}.{name}", 0) + at.size
        return decode(content, wanted)

    monkeypatch.setattr(dataflash, "decoded", counting)
    return counts


def test_only_what_the_schema_needs_is_decoded_and_once(log: Path, counted: dict[str, int]) -> None:
    flight = sp.read(log)
    assert flight.values("p").size * 4 > SIZE / 200
    there = {kind.name: kind.at.size for kind in dataflash.kinds(log.read_bytes())}
    assert {name for name in counted if name.startswith("LONG.")} == {"LONG.TimeUS"}
    assert {name: count for name, count in counted.items() if count > there[name.partition(".")[0]]} == {}
    assert "RATE.RDes" in counted, "the counter counts"


def test_every_field_is_listed_and_one_is_decoded_when_asked_for(log: Path, counted: dict[str, int]) -> None:
    fields = log_fields.log_fields(log)
    assert fields is not None
    assert {f"LONG.V{k}" for k in range(15)} <= fields.listed.keys()
    assert not [name for name in counted if name.startswith("LONG.V")]
    time, values = fields.read("LONG.V3")
    since = (time - time[0] + 1e-7) % (1e-6 * PERIOD)
    assert values == pytest.approx(np.sin(3 + time[0] + since), abs=1e-5)
    assert [name for name in counted if name.startswith("LONG.V")] == ["LONG.V3"]


def test_the_memory_is_that_of_the_channels_and_a_small_part_of_the_log(log: Path) -> None:
    tracemalloc.start()
    flight = sp.read(log)
    kept, peak = (bytes_ / log.stat().st_size for bytes_ in tracemalloc.get_traced_memory())
    tracemalloc.stop()
    channels = sum(v.nbytes for data in flight.streams.values() for v in data.variables.values()) / log.stat().st_size
    assert kept < 0.7 * channels, "most numbers are kept in the log's 32 bits, not in 64"
    assert peak < 0.9, "neither the log nor what is not asked for is in memory"


def test_on_disk_or_in_memory_the_flight_is_the_same(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    on_disk, stored = sp.read(log), source.open_source(log).stored
    assert not isinstance(stored, bytes)
    monkeypatch.setattr(source, "_LEFT_ON_DISK", SIZE * 2)
    assert isinstance(source.open_source(log).stored, bytes)
    flight = sp.read(log)
    assert flight.provenance == on_disk.provenance
    for name in flight.channels:
        assert np.array_equal(flight.values(name), on_disk.values(name))
        assert np.array_equal(flight.time(name), on_disk.time(name))


def test_nobody_writes_into_numbers_that_are_made_when_they_are_looked_at(log: Path) -> None:
    flight = sp.read(log)
    with pytest.raises(ValueError, match="read-only"):
        flight["p"].values[0] = 1.0
    changed = pickle.loads(pickle.dumps(flight)).with_channel("p", flight.values("p") + 1.0, like="p")
    assert changed.values("p")[0] == flight.values("p")[0] + 1.0


def test_a_log_that_is_cut_off_while_it_is_read_is_told_and_ends_nothing(log: Path, tmp_path: Path) -> None:
    path = tmp_path / "cut.bin"
    path.write_bytes(log.read_bytes())
    opened, fields = source.open_source(path), log_fields.log_fields(path)
    assert fields is not None
    flight = sp.read(path)
    os.truncate(path, SIZE // 2)
    with pytest.raises(FlightError, match="was cut off while it was read") as told:
        dataflash.messages(opened.stored)
    assert told.value.where == str(path)
    with pytest.raises(FlightError, match="cut off"):
        opened.sha256  # noqa: B018
    with pytest.raises(FlightError, match="has changed"):
        fields.read("LONG.V3")
    assert np.isfinite(flight.values("p")).all(), "what was read is there"
    assert sp.read(path).stop < flight.stop


@pytest.mark.parametrize("at_once", [True, False])
def test_bytes_on_disk_are_those_of_the_file(log: Path, at_once: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if not at_once:  # as where the system cannot read at a place
        monkeypatch.setattr(files, "READ_AT", None)
    content, lies = log.read_bytes(), files.BytesOnDisk(log, most=1 << 30)
    assert len(lies) == len(content)
    for begin, end in (
        (0, 3),
        (5, 5),
        (70_000, 70_010),
        (70_008, 200_000),
        (len(content) - 2, len(content) + 9),
        (3, 8),
    ):
        assert lies[begin:end] == lies.part(begin, end) == content[begin:end]
    last = content[-300:]
    assert lies.find(last) == content.find(last) == len(content) - 300
    assert lies.find(b"\xa3\x95", 100_000) == content.find(b"\xa3\x95", 100_000)
    assert lies.find(b"nowhere in it") == -1
    with pytest.raises(OSError, match="more than"):
        files.BytesOnDisk(log, most=100)
