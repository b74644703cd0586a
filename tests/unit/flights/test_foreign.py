"""Others' libraries in a process of their own: its end, its limits and its forks cost an error at most."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

import hostile_bags
from swashplate.errors import FlightError
from swashplate.flights import foreign, hdf5
from swashplate.flights.foreign_process import limit_met
from swashplate.flights.readers.read import read

Limiting = Callable[..., None]


@pytest.fixture
def limiting(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Limiting:
    """Other limits than a file's own, and a folder for temporary files that must be empty in the end."""
    usual, place = foreign.limits, tmp_path / "temporary"
    place.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(place))

    def change(**others: float) -> None:
        monkeypatch.setattr(foreign, "limits", lambda job, size: replace(usual(job, size), **others))

    return change


def _file(path: Path) -> Path:
    with h5py.File(path, "w") as file:
        file.attrs["mark"] = 1
        file["a"] = np.arange(3.0)
    return path


@pytest.mark.parametrize(
    ("way", "said"),
    [(signal.SIGXCPU, "took more than 3 s of the processor"), (signal.SIGSEGV, r"ended its process \(SIGSEGV\)")],
)
def test_a_process_that_ends_is_told_and_another_one_started(
    way: signal.Signals, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    dying = f"import os, sys; sys.stdin.readline(); print(end='half', flush=True); os.kill(os.getpid(), {int(way)})"
    one = foreign._Process()
    piped = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    one._running = subprocess.Popen([sys.executable, "-c", dying], **piped)
    monkeypatch.setattr(foreign, "_processes", [one])
    path = _file(tmp_path / "a.nc")
    with pytest.raises(FlightError, match=rf"a\.nc: was given up: reading it {said}\. It is damaged or forged"):
        hdf5.read(path, wanted="mark")
    assert hdf5.read(path, wanted="mark") is not None
    one._close()


def test_a_fork_starts_its_own(tmp_path: Path) -> None:
    path = _file(tmp_path / "a.nc")
    hdf5.read(path, wanted="mark")
    before = foreign._processes[-1]
    before.owner += 1  # as seen from a fork
    try:
        hdf5.read(path, wanted="mark")
        assert foreign._processes[-1] is not before
        running = before._running
        before._close()
        assert running is not None
        assert running.poll() is None
        running.kill()
        running.wait()
    finally:
        before.owner = os.getpid()


MET = {
    "bzip2_bag": "needed more than 304 MB of memory",
    "zstandard_mcap": "needed more than 306 MB of memory",
    "zstandard_messages": "needed more than 314 MB of memory",
    "zstandard_file": "unpacked to more than 16 MB",
    "long_metadata": "took more than 0 s of the processor",
    "anchors": "took more than 0 s of the processor",
    "endless_search": "took more than 0 s of the processor",
    "endless_rows": "unpacked to more than 17 MB",
}


@pytest.mark.parametrize("name", [name for name in hostile_bags.HOSTILE if name != "pipe"])
def test_a_hostile_bag_is_given_up_with_the_limit_that_it_met(name: str, limiting: Limiting, tmp_path: Path) -> None:
    """The limits of memory and disk as they are; of time less, so that the test is quick."""
    path = hostile_bags.HOSTILE[name](tmp_path)
    limiting(**({"processor": 0} if "processor" in MET[name] else {"processor": 100, "seconds": 600.0}))
    with pytest.raises(FlightError, match=rf"bomb.*: was given up: reading it {MET[name]}\. It is damaged or forged"):
        read(path)
    assert not any((tmp_path / "temporary").iterdir())


def test_without_the_limit_the_bomb_is_unpacked(limiting: Limiting, tmp_path: Path) -> None:
    """The tests' own test: it is the limit that refuses it."""
    limiting(memory=6 << 30, disk=6 << 30, processor=100, seconds=600.0)
    other = tmp_path / "other"
    other.mkdir()
    flight = read(hostile_bags.zstandard_file(tmp_path))
    assert flight.values("a").tolist() == [0.0, 1.0, 2.0]
    with pytest.raises(FlightError, match="Chunk size mismatch: expected 252 bytes, got 629"):
        read(hostile_bags.zstandard_mcap(other))
    assert not any((tmp_path / "temporary").iterdir())


def test_the_clock_ends_what_the_processor_does_not(limiting: Limiting, tmp_path: Path) -> None:
    """All that a system without `resource` has; with it, what waits and takes no time of the processor."""
    limiting(processor=1000, seconds=0.3)
    with pytest.raises(FlightError, match=r"bomb\.db3: was given up: reading it took more than 0\.3 s\. "):
        read(hostile_bags.endless_search(tmp_path))


def test_what_is_handed_over_is_limited(limiting: Limiting, tmp_path: Path) -> None:
    limiting(handed=400)
    with h5py.File(tmp_path / "a.nc", "w") as file:
        file.attrs["mark"] = 1
        file["a"] = np.arange(100.0)
    with pytest.raises(FlightError, match=r"a\.nc: was given up: reading it gave more than 0 MB \(800 bytes at once\)"):
        hdf5.read(tmp_path / "a.nc", wanted="mark")


def test_a_pipe_in_a_bag_is_not_waited_for(tmp_path: Path) -> None:
    with pytest.raises(FlightError, match=r"bomb\.db3: is a pipe, a device or a link to nothing"):
        read(hostile_bags.pipe(tmp_path))


ASKING = """
import sys
from swashplate.flights import foreign
from swashplate.flights.readers.read import read
usual = foreign.limits
foreign.limits = lambda job, size: foreign.ProcessLimits(1000, 600.0, 1 << 30, 1 << 30, 1 << 20)
bytes_of = foreign._Process._bytes
def told(process, count, left):
    print(process.pid, flush=True)
    return bytes_of(process, count, left)
foreign._Process._bytes = staticmethod(told)
import signal
signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
try:
    read(sys.argv[1])
except KeyboardInterrupt:
    sys.exit(130)
"""


@pytest.mark.parametrize(("way", "code"), [(signal.SIGTERM, 128 + signal.SIGTERM), (signal.SIGINT, 130)])
def test_a_library_in_an_endless_loop_is_ended_with_the_program(way: signal.Signals, code: int, tmp_path: Path) -> None:
    path = hostile_bags.endless_search(tmp_path)
    (tmp_path / "t").mkdir()
    asking = subprocess.Popen(
        [sys.executable, "-c", ASKING, str(path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "TMPDIR": str(tmp_path / "t")},
    )  # fmt: skip
    with asking:
        assert asking.stdout is not None
        reader = int(asking.stdout.readline())
        asking.send_signal(way)
        _, said = asking.communicate(timeout=60)
    assert (asking.returncode, said) == (code, "")
    with pytest.raises(ProcessLookupError):
        os.kill(reader, 0)
    assert not any((tmp_path / "t").iterdir())


def test_a_limit_is_found_among_the_causes() -> None:
    error = ValueError("a library's own")
    error.__cause__ = KeyError("between")
    error.__cause__.__context__ = MemoryError()
    assert limit_met(error) == "memory"
    assert limit_met(OSError(27, "File too large")) == "disk"
    assert limit_met(ValueError()) == ""


@pytest.mark.proof
def test_a_heap_that_never_ends_is_refused(tmp_path: Path) -> None:
    """HDF5 2.0 counts the objects of a heap for ever where one claims all but 16 bytes of all numbers."""
    with h5py.File(tmp_path / "a.nc", "w") as file:
        file.attrs["mark"] = 1
        file["names"] = np.array(["p", "q"], dtype=object)
    content = bytearray((tmp_path / "a.nc").read_bytes())
    at = content.index(b"GCOL") + 16
    content[at + 8 : at + 16] = (2**64 - 16).to_bytes(8, "little")
    (tmp_path / "a.nc").write_bytes(content)
    with pytest.raises(FlightError, match="took more than 3 s of the processor"):
        hdf5.read(tmp_path / "a.nc", wanted="mark")


def test_a_long_flight_may_take_minutes() -> None:
    assert foreign.limits("hdf5", 1 << 30).processor < 60
    assert foreign.limits("rosbag", 100 << 20).processor == 203


def test_a_busy_machine_does_not_stop_the_clock_early(monkeypatch: pytest.MonkeyPatch) -> None:
    assert foreign.limits("rosbag", 1000).seconds == 120.0
    monkeypatch.setattr(foreign, "resource", None)  # Windows: the clock is all there is
    assert foreign.limits("rosbag", 1000).seconds == 22.0
