"""Recordings of links: every flight is kept, nothing is overwritten, and what a killed link left is saved next time."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from heli_autopilot import servo_packet
from link_bench import QUICK, Bench, bench
from swashplate.atomic import added_when_complete
from swashplate.engine.equations import SURROUNDINGS
from swashplate.errors import LinkError
from swashplate.flights.flight import Flight, stream
from swashplate.flights.growing import Growing
from swashplate.links.recorder import Recorder, begin, numbered, recover
from swashplate.simulation.record import simulated_flight, unflown

IDLE = [1500, 1500, 1500, 1500, 1300, 1300]
NONE = Flight({"uniform": stream(np.zeros(0), {"p": np.zeros(0), "q": np.zeros(0)})})


def flown(recorder: Recorder, n: int, *, value: float = 1.0) -> None:
    for k in range(n):
        recorder.add(0.01 * (k + 1), (value, float(k)))


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture(scope="module")
def coax() -> Bench:
    made = bench("coax", engine=QUICK)
    made.plant.prepare()
    return made


def test_every_start_of_the_autopilot_is_a_flight_of_its_own(coax: Bench, tmp_path: Path) -> None:
    said: list[str] = []
    plant = coax.plant
    kept = Recorder(
        tmp_path / "f.nc", like=unflown(plant.vehicle, details={"link": True, "rate": 400.0}), say=said.append
    )
    plant._recorder, plant._spacing = kept, 1.0 / 400.0
    rows: list[list[float]] = []
    try:
        for start, n in enumerate((300, 120, 40)):
            for count in range(n):
                coax.send(servo_packet(400, 5000 * (start == 0) + count, IDLE))
                if start == 0:
                    rows.append([plant.time, *plant._held.states])
        assert not (tmp_path / "f-3.nc").exists()
        assert (tmp_path / "f-3.growing").is_file()
        saved = kept.finish()
    finally:
        plant._recorder = None
    assert [path.name for path in saved] == ["f.nc", "f-2.nc", "f-3.nc"]
    assert names(tmp_path) == ["f-2.nc", "f-3.nc", "f.nc"]
    first = sp.read(tmp_path / "f.nc")
    assert np.array_equal(np.column_stack([first.time("phi"), first.array(plant.vehicle.state_names)]), np.array(rows))
    assert [sp.read(path).time("phi").size for path in saved] == [300, 120, 40]
    # The same file as one that was kept in memory would have become.
    columns = plant.vehicle.state_names, (*plant.vehicle.input_names, *SURROUNDINGS)
    again = simulated_flight(
        plant.vehicle,
        first.time("phi"),
        first.array(columns[0]),
        first.array(columns[1]),
        details={"link": True, "rate": 400.0},
    )
    assert again.streams["uniform"].identical(first.streams["uniform"])
    assert (again.provenance, again.history) == (first.provenance, first.history)


def test_what_is_there_stays(tmp_path: Path) -> None:
    for name in ("f.nc", "f-2.nc"):
        (tmp_path / name).write_text("mine")
    said: list[str] = []
    kept = Recorder(tmp_path / "f.nc", like=NONE, say=said.append)
    flown(kept, 5)
    kept.restart()
    flown(kept, 5)
    assert [path.name for path in kept.finish()] == ["f-3.nc", "f-4.nc"]
    assert {(tmp_path / name).read_text() for name in ("f.nc", "f-2.nc")} == {"mine"}
    assert said[0].endswith("f.nc is kept as it is: this flight becomes " + str(tmp_path / "f-3.nc") + ".")


def test_the_file_is_there_first_where_it_appears_during_the_flight(tmp_path: Path) -> None:
    kept = Recorder(tmp_path / "f.csv", like=NONE, say=lambda _: None)
    flown(kept, 5)
    (tmp_path / "f.csv").write_text("mine")
    assert [path.name for path in kept.finish()] == ["f-2.csv"]
    assert (tmp_path / "f.csv").read_text() == "mine"
    assert sp.read(tmp_path / "f-2.csv").values("q").tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_too_little_is_no_flight(tmp_path: Path) -> None:
    kept = Recorder(tmp_path / "f.nc", like=NONE, say=lambda _: None)
    flown(kept, 1)
    kept.restart()
    assert kept.finish() == ()
    assert names(tmp_path) == []


def test_many_that_begin_at_once_get_names_of_their_own(tmp_path: Path) -> None:
    got: list[Path] = []
    barrier = threading.Barrier(8)

    def run(value: float) -> None:
        barrier.wait()
        for _ in range(2):
            kept = Recorder(tmp_path / "f.nc", like=NONE, say=lambda _: None)
            flown(kept, 3, value=value)
            got.extend(kept.finish())

    threads = [threading.Thread(target=run, args=(float(k),)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(got) == len(set(got)) == 16
    values = sorted(float(sp.read(path).values("p")[0]) for path in tmp_path.iterdir())
    assert values == sorted(2 * [float(k) for k in range(8)]), "none was lost or written over"


def test_a_name_that_was_let_go_between_two_looks_is_not_taken(tmp_path: Path) -> None:
    """Another program saves its file and lets the name go between our look at the file and our claim of the name."""
    looks: list[Path] = []

    def taken(path: Path) -> bool:
        looks.append(path)
        if len(looks) == 1:
            path.write_text("theirs")
            return False
        return path.exists()

    file, begun = begin(numbered(tmp_path / "f.nc"), like=NONE, taken=taken)
    begun.discard()
    assert file == tmp_path / "f-2.nc"
    assert names(tmp_path) == ["f.nc"]


@pytest.mark.parametrize("links", [True, False])
def test_nothing_is_put_over_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, links: bool) -> None:
    if not links:

        def no(*_: object) -> None:
            raise OSError("this file system has no links")

        monkeypatch.setattr(os, "link", no)
    with added_when_complete(tmp_path / "a") as temporary:
        temporary.write_text("one")
    with pytest.raises(FileExistsError), added_when_complete(tmp_path / "a") as temporary:
        temporary.write_text("two")
    two = added_when_complete(tmp_path / "b")
    two.__enter__().write_text("two")
    (tmp_path / "b").write_text("one")
    with pytest.raises(FileExistsError):
        two.__exit__(None, None, None)
    assert names(tmp_path) == ["a", "b"]
    assert {path.read_text() for path in tmp_path.iterdir()} == {"one"}


def test_a_full_disk_ends_the_recording_and_not_the_flight(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    kept = Recorder(tmp_path / "f.nc", like=NONE, say=said.append)
    flown(kept, 20)

    def full(*_: object) -> int:
        raise OSError(28, os.strerror(28))

    with monkeypatch.context() as during:
        during.setattr(os, "write", full)
        kept.add(1.0, (1.0, 2.0))
    kept.add(1.1, (1.0, 2.0))
    assert len(said) == 1
    assert "the recording has stopped, the flight goes on" in said[0]
    assert "No space left" in said[0]
    with pytest.raises(LinkError, match="the recording has stopped"):
        kept.finish()
    assert sp.read(tmp_path / "f.nc").values("p").size == 20


def test_what_cannot_be_saved_stays_as_it_was_recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = Recorder(tmp_path / "f.csv", like=NONE, say=lambda _: None)
    kept.add(0.1, (1.0, float("nan")))  # no CSV file can hold it
    kept.add(0.2, (1.0, 2.0))
    with pytest.raises(LinkError, match=r"What was flown stays in .*f\.growing"):
        kept.finish()
    assert names(tmp_path) == ["f.growing"]
    assert sp.read(tmp_path / "f.growing").values("p").size == 2


def test_memory_stays_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """40,000 samples of 40 channels are 13 MB on disk; less than a hundredth of it is in memory while flying."""
    import tracemalloc

    wide = Flight({"uniform": stream(np.zeros(0), {f"c{k}": np.zeros(0) for k in range(40)})})
    kept = Recorder(tmp_path / "f.nc", like=wide, say=lambda _: None)
    row = np.arange(40.0).tolist()
    tracemalloc.start()
    try:
        for k in range(40_000):
            kept.add(0.01 * k, row)
        (_, flying), size = tracemalloc.get_traced_memory(), (tmp_path / "f.growing").stat().st_size
        tracemalloc.reset_peak()
        kept.finish()
        _, saving = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert size > 13e6
    assert flying < 0.01 * size
    # The numbers are read and not mapped, for a file that is cut off would end the process, and the netCDF file is made
    # in memory, for a full disk would crash its library: twice the file.
    assert saving < 2.2 * size


LEFT = """
import sys
sys.path[:0] = {path!r}
from pathlib import Path
import time
import numpy as np
from swashplate.flights.flight import Flight, stream
from swashplate.links.recorder import Recorder
none = Flight({{"uniform": stream(np.zeros(0), {{"p": np.zeros(0), "q": np.zeros(0)}})}})
kept = Recorder(Path({file!r}), like=none, say=print)
for count in (30, 40):
    for k in range(count):
        kept.add(0.01 * (k + 1), (1.0, float(k)))
    if count == 30:
        kept.restart()
print("here", flush=True)
time.sleep(60)
"""


def test_what_a_killed_program_left_is_saved_and_what_a_living_one_writes_is_not(tmp_path: Path) -> None:
    file = tmp_path / "f.nc"
    code = LEFT.format(path=[str(Path(__file__).parents[3]), str(Path(__file__).parents[2])], file=str(file))
    said: list[str] = []
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as writer:
        try:
            assert writer.stdout is not None
            for line in writer.stdout:  # ends where the writer does
                if line.strip() == "here":
                    break
            assert writer.poll() is None, "it is alive"
            assert recover(file, said.append) == (), "it is alive"
            assert names(tmp_path) == ["f-2.growing", "f.nc"]
        finally:
            writer.send_signal(signal.SIGKILL)
    assert sp.read(tmp_path / "f-2.growing").values("q").size == 40
    assert recover(file, said.append) == (tmp_path / "f-2.nc",)
    assert names(tmp_path) == ["f-2.nc", "f.nc"]
    assert sp.read(tmp_path / "f-2.nc").values("q").size == 40
    assert said == [f"an earlier recording was cut off; its 0.4 s are saved: {tmp_path / 'f-2.nc'}."]


def test_only_recordings_of_this_file_are_recovered(tmp_path: Path) -> None:
    for stem in ("f", "f-7", "g", "flight", "f-x"):
        with Growing(tmp_path / f"{stem}.growing", like=NONE) as left:
            for k in range(3):
                left.append(0.1 * k, (1.0, 2.0))
    (tmp_path / "f-8.growing").touch()  # killed before its first line
    (tmp_path / "f-9.growing").write_bytes(b"rubbish\n")
    said: list[str] = []
    assert recover(tmp_path / "f.nc", said.append) == (tmp_path / "f-7.nc", tmp_path / "f.nc")
    assert names(tmp_path) == ["f-7.nc", "f-9.growing", "f-x.growing", "f.nc", "flight.growing", "g.growing"]
    assert sum("stays as it is" in words for words in said) == 1


def test_names_are_counted() -> None:
    assert [str(path) for path, _ in zip(numbered(Path("a/f.nc")), range(3), strict=False)] == [
        "a/f.nc",
        "a/f-2.nc",
        "a/f-3.nc",
    ]
