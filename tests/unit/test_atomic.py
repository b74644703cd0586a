"""Files and folders that are complete or not there: full disks, hard kills, and what those leave."""

from __future__ import annotations

import errno
import itertools
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from proof_page import leave
from swashplate import atomic
from swashplate.errors import WriteError

SMALL_DISK = """
import resource, sys
from pathlib import Path
import numpy as np
from swashplate.errors import WriteError
from swashplate.flights.tabular import write_csv
from swashplate.flights.flight import Flight, stream
from swashplate.bench.record import BenchRecord
from swashplate.atomic import folder_when_complete, write_bytes
from swashplate.identification.responses.frequency_response import FrequencyResponse

resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
folder = Path(sys.argv[1])
flight = Flight({"motion": stream(np.arange(4000.0), {"x": np.arange(4000.0)})})
n = 300
one = np.ones((n, 1, 1))
response = FrequencyResponse(
    omega=np.arange(1.0, n + 1), inputs=("a",), outputs=("p",), response=one + 0j, coherence=one, error=one,
    multiple=one[..., 0], input_power=one[..., 0], output_power=one[..., 0], input_coherence=one,
    input_units=("1",), output_units=("rad/s",), method="", windows=(), sources=(), warnings=(), problems=(),
    settings={},
)

def in_a_folder(path):
    with folder_when_complete(path, ours=()) as here:
        write_bytes(here / "small", b"x")
        write_bytes(here / "large", bytes(10_000))

for name, write in {
    "a.nc": flight.save,
    "a.csv": lambda path: write_csv(flight, path),
    "response.nc": response.save,
    "a.bin": lambda path: write_bytes(path, bytes(10_000)),
    "result": in_a_folder,
}.items():
    try:
        write(folder / name)
    except WriteError as error:
        print(name, str(error).replace(str(folder), "").split(":")[-1].strip())
print("alive")
"""


def test_a_full_disk_ends_in_words_and_leaves_nothing(tmp_path: Path) -> None:
    """A limit on the size of files stands for the full disk: the system refuses the same write with another number."""
    done = subprocess.run(
        [sys.executable, "-c", SMALL_DISK, str(tmp_path)], capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert [line.split()[0] for line in lines] == ["a.nc", "a.csv", "response.nc", "a.bin", "result", "alive"]
    assert all("File too large. Free some space" in line for line in lines[:-1])
    assert list(tmp_path.iterdir()) == []


def test_a_device_is_written_to_and_not_replaced() -> None:
    before = os.stat("/dev/full")
    with pytest.raises(WriteError, match=r"/dev/full: cannot be written: No space left on device\. Free some space"):
        atomic.write_bytes("/dev/full", b"text")
    assert os.path.samestat(before, os.stat("/dev/full"))


def test_a_text_may_name_a_file_whose_name_is_no_utf_8(tmp_path: Path) -> None:
    assert atomic.write_text(tmp_path / "page.html", "m\udce4rz.csv").read_bytes() == b"m?rz.csv"


def test_a_pipe_that_nobody_reads_from_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(WriteError, match="Nobody reads from this pipe"):
        atomic.write_bytes(tmp_path / "pipe", b"text")
    reader = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    atomic.write_bytes(tmp_path / "pipe", b"text")
    assert os.read(reader, 10) == b"text"
    os.close(reader)


@pytest.mark.parametrize(("number", "advice"), [(errno.ENOSPC, "space"), (errno.EDQUOT, "space"), (errno.EROFS, "may")])
@pytest.mark.parametrize("call", ["open", "fsync", "replace"])
def test_trouble_at_every_call_is_named_and_leaves_the_old_file(
    call: str, number: int, advice: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = atomic.write_text(tmp_path / "a.toml", "old")

    def fail(*_: object, **__: object) -> None:
        raise OSError(number, os.strerror(number), "a temporary name")

    monkeypatch.setattr(atomic.os, call, fail)
    with pytest.raises(WriteError, match=rf"a\.toml: cannot be written: {os.strerror(number)}.*{advice}"):
        atomic.write_text(path, "new")
    monkeypatch.undo()
    assert path.read_text() == "old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.toml"]


def test_text_keeps_permissions_and_bytes(tmp_path: Path) -> None:
    plain = tmp_path / "plain.txt"
    plain.write_text("x")
    path = atomic.write_text(tmp_path / "a.txt", "one\r\ntwo\nü")
    assert path.read_bytes() == "one\r\ntwo\nü".encode()
    assert path.stat().st_mode == plain.stat().st_mode
    path.chmod(0o640)
    assert atomic.write_bytes(path, b"new").stat().st_mode & 0o777 == 0o640


def test_a_block_that_fails(tmp_path: Path) -> None:
    def write_half() -> None:
        with atomic.replaced_when_complete(tmp_path / "a.txt") as temporary:
            temporary.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_half()
    assert list(tmp_path.iterdir()) == []


KILLED = """
import os, signal, sys
from pathlib import Path
from swashplate import atomic

target, stop = Path(sys.argv[1]), int(sys.argv[2])
calls = 0

def counted(function):
    def call(*arguments, **named):
        global calls
        calls += 1
        if calls == stop:
            os.kill(os.getpid(), signal.SIGKILL)
        return function(*arguments, **named)
    return call

for module, names in ((os, ("open", "mkdir", "replace", "unlink", "fsync", "rmdir")), (Path, ("unlink", "mkdir"))):
    for name in names:
        setattr(module, name, counted(getattr(module, name)))
with atomic.folder_when_complete(target, ours=("report", "model", "fit", "gone")) as here:
    for name in ("report", "model", "fit"):
        atomic.write_text(here / name, "new")
atomic.write_text(target.parent / "single", "new")
"""


def _killed(target: Path, stop: int) -> int:
    return subprocess.run([sys.executable, "-c", KILLED, str(target), str(stop)], check=False, timeout=60).returncode


def _results(target: Path) -> dict[str, str]:
    return {p.name: p.read_text() for p in target.iterdir() if p.is_file()}


def _litter(folder: Path) -> list[str]:
    return sorted(p.name for p in folder.rglob(".swash-*"))


def _kills(tmp_path: Path, stops: range) -> int:
    """Kills a writer at each of the given system calls; returns how many kills there were."""
    old = dict.fromkeys(("report", "model", "fit", "gone"), "old") | {"mine": "mine"}
    kills = 0
    for stop in stops:
        parent = tmp_path / str(stop)
        target = parent / "out"
        target.mkdir(parents=True)
        for name, text in old.items():
            (target / name).write_text(text)
        if _killed(target, stop) != -signal.SIGKILL:
            break
        kills += 1
        found = _results(target)
        assert found.pop("mine") == "mine"
        assert len(set(found.values())) <= 1, f"call {stop}: old and new lie side by side: {found}"
        begun = set(found.values()) != {"old"} or len(found) < 4
        atomic.sweep(target)
        new = dict.fromkeys(("report", "model", "fit"), "new") | {"mine": "mine"}
        assert _results(target) in ([new] if begun else [old, new]), f"call {stop}"
        atomic.sweep(parent)
        assert _litter(parent) == []
    return kills


def test_kills_never_mix_old_and_new_and_their_litter_is_swept(tmp_path: Path) -> None:
    assert _kills(tmp_path, range(20, 80, 7)) >= 4


@pytest.mark.proof
def test_kills_at_every_call(tmp_path: Path) -> None:
    kills = _kills(tmp_path, range(1, 1000))
    assert kills > 30
    leave(
        "siege-kills",
        {
            "title": "Hard kills while a folder of results is written",
            "text": "One kill at each call that opens, makes, renames, removes or flushes: old and new never lie side "
            "by side, other people's files stay, and the next run leaves no temporary file.",
            "columns": ["kills", "mixed results", "temporary files after the next run"],
            "rows": [[kills, 0, 0]],
            "passed": True,
        },
    )


def test_what_a_living_process_writes_is_not_swept(tmp_path: Path) -> None:
    with (
        atomic.folder_when_complete(tmp_path / "out", ours=()) as here,
        atomic.replaced_when_complete(tmp_path / "file") as temporary,
    ):
        atomic.sweep(tmp_path)
        atomic.sweep(tmp_path / "out")
        assert here.is_dir()
        assert temporary.exists()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file"]


@pytest.mark.parametrize("name", ["../precious", "..", ".", "", "a/../../precious"])
@pytest.mark.parametrize("key", ["remove", "move"])
def test_a_forged_note_cannot_reach_outside_its_folder(name: str, key: str, tmp_path: Path) -> None:
    (tmp_path / "precious").write_text("mine")
    forged = tmp_path / "out" / ".swash-0"
    (forged / "new").mkdir(parents=True)
    (forged / "commit").write_text(json.dumps({"remove": [], "move": []} | {key: [name]}))
    atomic.sweep(tmp_path / "out")
    assert (tmp_path / "precious").read_text() == "mine"


def test_an_interrupt_while_swapping_finishes_the_swap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a").write_text("old")
    moves = itertools.count()
    replace = os.replace

    def interrupted(source: Path, target: Path) -> None:
        if Path(target).parent == tmp_path and next(moves) == 1:
            raise KeyboardInterrupt
        replace(source, target)

    def write() -> None:
        with atomic.folder_when_complete(tmp_path, ours=()) as here:
            for name in "abc":
                atomic.write_text(here / name, "new")

    monkeypatch.setattr(atomic.os, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write()
    assert _results(tmp_path) == dict.fromkeys("abc", "new")
    assert _litter(tmp_path) == []


@pytest.mark.parametrize("old", [False, True])
def test_a_disk_that_is_full_while_swapping(old: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    replace = os.replace

    def full(source: Path, target: Path) -> None:
        if Path(target).parent == tmp_path:
            raise OSError(errno.ENOSPC, "No space left on device")
        replace(source, target)

    for name in "abc" if old else "":
        (tmp_path / name).write_text("old")
    monkeypatch.setattr(atomic.os, "replace", full)

    def write() -> None:
        with atomic.folder_when_complete(tmp_path, ours=()) as here:
            for name in "abc":
                atomic.write_text(here / name, "new")

    told = "waits in .swash-.* moves it to its place first" if old else "cannot be written: No space left"
    with pytest.raises(WriteError, match=told):
        write()
    monkeypatch.undo()
    assert len(os.listdir(tmp_path)) == int(old)
    atomic.sweep(tmp_path)
    assert _results(tmp_path) == (dict.fromkeys("abc", "new") if old else {})


def test_a_scratch_folder_goes_and_takes_those_of_dead_processes_along(tmp_path: Path) -> None:
    left = tmp_path / ".swash-0123"
    left.mkdir()
    (left / "a.c").touch()
    with atomic.scratch_folder(tmp_path) as folder:
        (folder / "b.c").touch()
        atomic.sweep(tmp_path)  # another process's: this one is held
        assert [entry.name for entry in tmp_path.iterdir()] == [folder.name]
        assert folder.stat().st_mode & 0o777 == 0o700
    assert not any(tmp_path.iterdir())


def test_no_file_is_written_to_find_the_place_for_temporary_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Python's own search writes one, which the siege's kills found behind a command."""

    def search() -> str:
        raise AssertionError("Python searches")

    monkeypatch.setattr("tempfile._get_default_tempdir", search)
    monkeypatch.setattr("tempfile.tempdir", None)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    with atomic.scratch_folder() as folder:
        assert folder.parent == tmp_path
    monkeypatch.setattr("tempfile.tempdir", None)
    monkeypatch.setenv("TMPDIR", str(tmp_path / "not there"))
    assert atomic.temporary_place() != str(tmp_path / "not there")
    monkeypatch.setattr("tempfile.tempdir", None)
    monkeypatch.setattr("tempfile._get_default_tempdir", lambda: os.listdir(tmp_path / "not there"))
    monkeypatch.setattr("os.access", lambda *_: False)
    with pytest.raises(WriteError, match="no folder for temporary files"):
        atomic.temporary_place()
