"""Flights that grow on disk: read back bit for bit, and whatever a kill or a bad disk leaves of them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import FlightError
from swashplate.flights import growing
from swashplate.flights.flight import Flight, stream
from swashplate.flights.growing import Abandoned, Growing
from swashplate.flights.provenance import Provenance

RATE = 200.0


def whole(n: int) -> Flight:
    """A flight whose numbers are told apart by their bits."""
    random = np.random.default_rng(3)
    columns = {"p": random.standard_normal(n), "bar_angle": random.standard_normal(n)}
    made = Flight(
        {"uniform": stream(np.arange(n) / RATE, columns, {"bar_angle": "rad"})},
        Provenance(source="a test", reader="tests", reader_version="1", simulated=True, vehicle="coax"),
    )
    return made.done("simulate", rate=RATE, link=True)


def grown(path: Path, n: int) -> Flight:
    flight = whole(n)
    with Growing(path, like=whole(0)) as file:
        for time, row in zip(flight.time("p"), flight.array(("p", "bar_angle")), strict=True):
            file.append(float(time), row)
    return flight


def the_same(one: Flight, other: Flight) -> None:
    assert one.streams.keys() == other.streams.keys()
    for name in one.streams:
        assert one.streams[name].identical(other.streams[name])
    assert one.history == other.history
    assert one.provenance == other.provenance


def test_it_is_the_flight_that_was_flown(tmp_path: Path) -> None:
    flight = grown(tmp_path / "a.growing", 500)
    the_same(sp.read(tmp_path / "a.growing"), flight)
    the_same(growing.load(tmp_path / "a.growing"), flight)
    growing.load(tmp_path / "a.growing").save(tmp_path / "a.nc")
    flight.save(tmp_path / "b.nc")
    the_same(sp.read(tmp_path / "a.nc"), sp.read(tmp_path / "b.nc"))
    assert (tmp_path / "a.growing").stat().st_size < 500 * (3 * 8 + 8) + 2000


def test_cut_off_anywhere_it_gives_every_whole_sample(tmp_path: Path) -> None:
    flight = grown(tmp_path / "a.growing", 20)
    content = (tmp_path / "a.growing").read_bytes()
    record = 8 + 3 * 8
    start = len(content) - 20 * record
    for size in range(start, len(content)):
        read = growing.parse(content[:size], where="a.growing")
        n, torn = divmod(size - start, record)
        assert np.array_equal(read.values("p"), flight.values("p")[:n])
        assert len(read.provenance.damage) == (1 if torn else 0)
    for size in range(start):
        with pytest.raises(FlightError, match=r"a\.growing"):
            growing.parse(content[:size], where="a.growing")


def test_damaged_samples_are_left_out_and_told(tmp_path: Path) -> None:
    flight = grown(tmp_path / "a.growing", 50)
    content = bytearray((tmp_path / "a.growing").read_bytes())
    start, record = len(content) - 50 * 32, 32
    content[start + 7 * record + 20] ^= 1
    content[start + 30 * record : start + 32 * record] = bytes(2 * record)
    read = growing.parse(bytes(content), where="a.growing")
    kept = [k for k in range(50) if k not in (7, 30, 31)]
    assert np.array_equal(read.values("p"), flight.values("p")[kept])
    assert read.provenance.damage == ("3 of 50 samples are damaged and left out",)


def test_mutated_files_raise_nothing_else(tmp_path: Path) -> None:
    grown(tmp_path / "a.growing", 30)
    content = (tmp_path / "a.growing").read_bytes()
    head = len(content) - 30 * 32
    random, refused = np.random.default_rng(0), 0
    for _ in range(1000):
        data = bytearray(content)
        for _ in range(int(random.integers(1, 5))):
            at = int(random.integers(0, head))
            data[at] = int(random.integers(0, 256))
        try:
            growing.parse(bytes(data), where="a.growing")
        except FlightError:
            refused += 1
    assert refused > 500


def test_it_never_takes_a_file_that_is_there(tmp_path: Path) -> None:
    (tmp_path / "a.growing").write_text("mine")
    with pytest.raises(FileExistsError):
        Growing(tmp_path / "a.growing", like=whole(0))
    assert (tmp_path / "a.growing").read_text() == "mine"


def test_a_full_disk_leaves_the_samples_before_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real, left = os.write, [6]

    def full(file: int, data: bytes) -> int:
        left[0] -= 1
        return real(file, data if left[0] > 0 else data[: len(data) // 2])

    with Growing(tmp_path / "a.growing", like=whole(0)) as file:
        monkeypatch.setattr(os, "write", full)
        for k in range(5):
            file.append(0.1 * k, (1.0, 2.0))
        with pytest.raises(OSError, match="No space left"):
            file.append(0.5, (1.0, 2.0))
    read = sp.read(tmp_path / "a.growing")
    assert read.values("p").size == 5
    assert read.provenance.damage == ()


WRITER = """
import sys, time
sys.path[:0] = {path!r}
from pathlib import Path
from tests.unit.flights.test_growing import whole
from swashplate.flights.growing import Growing
file = Growing(Path({file!r}), like=whole(0))
begun = time.monotonic()
for k in range(100_000):
    file.append(k / 200.0, (time.monotonic() - begun, float(k)))
    if k % 50 == 49:
        print(k, flush=True)
    time.sleep(0.001)
"""


def test_a_killed_program_leaves_all_it_appended_and_the_lock_tells_alive_from_dead(tmp_path: Path) -> None:
    file = tmp_path / "a.growing"
    code = WRITER.format(path=[str(Path(__file__).parents[3]), str(Path(__file__).parents[2])], file=str(file))
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as writer:
        assert writer.stdout is not None
        for _ in range(4):
            told = int(writer.stdout.readline())
        with Abandoned(file) as abandoned:
            assert not abandoned.free, "it is alive"
        writer.send_signal(signal.SIGKILL)
        rest = writer.stdout.read().split()
        last = int(rest[-1]) if rest else told
    with Abandoned(file) as abandoned:
        assert abandoned.free
    read = sp.read(file)
    assert read.values("p").size > last
    assert read.provenance.damage == ()
    assert np.array_equal(read.values("bar_angle"), np.arange(read.values("p").size))


def test_a_file_that_is_cut_off_after_it_was_read_ends_nothing(tmp_path: Path) -> None:
    flight = grown(tmp_path / "a.growing", 5000)
    loaded = growing.load(tmp_path / "a.growing")
    os.truncate(tmp_path / "a.growing", 100)  # numbers mapped from it would end this process now
    the_same(loaded, flight)


def test_a_newer_schema_and_doubled_columns_are_refused(tmp_path: Path) -> None:
    grown(tmp_path / "a.growing", 5)
    content = (tmp_path / "a.growing").read_bytes()
    with pytest.raises(FlightError, match="Update swashplate"):
        growing.parse(content.replace(b'"schema": 1', b'"schema": 9'), where="a")
    with pytest.raises(FlightError, match="doubled"):
        growing.parse(content.replace(b'["bar_angle"', b'["p"        '), where="a")
    (tmp_path / "b.growing").touch()
    with pytest.raises(FlightError, match="the file is empty"):
        growing.load(tmp_path / "b.growing")
