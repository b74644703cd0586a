"""Each campaign in short, and that each can say no."""

from __future__ import annotations

import contextlib
import os
import random
import signal
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from swashplate.errors import FlightError

from . import files, forged, fuzz, fuzzed, kills, neighbours, odd_options, packets, pages, places, small, worker
from .containers import CONTAINERS, Container
from .files import Files
from .kills import Case
from .plain import Ended
from .targets import TARGETS, Target

MUTANTS = 6


@pytest.mark.parametrize("name", TARGETS)
def test_whole_files_are_read_and_damaged_ones_refused_in_words(name: str, tmp_path: Path) -> None:
    target = TARGETS[name]()
    for content in target.whole:
        path = tmp_path / f"whole{target.suffix}"
        path.write_bytes(content)
        with contextlib.suppress(FlightError):  # a log that is cut off, or has no units
            target.use(path)
    found = [worker.outcome(name, seed, tmp_path) for seed in range(MUTANTS)]
    assert {told[0] for told in found} <= set("arw"), found


@pytest.mark.parametrize(
    ("name", "split", "join"),
    [
        ("ULog", forged.split_ulog, forged.join_ulog),
        ("DataFlash", forged.split_dataflash, forged.join_dataflash),
        ("MATLAB, level 5", forged.split_matlab, forged.join_matlab),
        ("growing recording", forged.split_growing, forged.join_growing),
        ("ROS bag, first form", forged.split_bag1, forged.join_bag1),
        ("telemetry (MAVLink)", forged.split_tlog, forged.join_tlog),
        ("MCAP", forged.split_mcap, forged.join_mcap),
    ],
)
def test_what_is_taken_apart_and_put_together_is_the_same(name: str, split: forged.Split, join: forged.Join) -> None:
    for content in CONTAINERS[name]().whole:
        start, records = split(content)
        assert len(records) > 4
        assert join(start, records) == content


INPUTS = 48


@pytest.mark.parametrize("name", CONTAINERS)
def test_every_container_is_fuzzed_in_short(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    monkeypatch.setattr(fuzzed.Loop, "_tell", lambda self, content, words: told.append(words))
    (tmp_path / "kept").mkdir()
    loop = fuzzed.Loop(name, CONTAINERS[name](), seed=0, kept=tmp_path / "kept", folder=tmp_path)
    counts = loop.run(INPUTS, 120.0)
    assert counts["fell"] == 0, told
    assert counts["inputs"] == INPUTS
    assert counts["kept"] > 1, "outcomes are told from each other"
    assert counts["read"] + counts["refused"] + counts["contained"] == INPUTS


def test_the_fuzzer_adds_up_what_its_processes_tell(tmp_path: Path) -> None:
    siege = fuzz.Fuzz(["MATLAB, level 5"], inputs=300, seconds=60.0, folder=tmp_path, workers=1)
    found = siege.run()
    assert found.bad == []
    assert found.rows[0][1] == found.rows[-1][1] == 300
    again = fuzz.Fuzz(["MATLAB, level 5"], inputs=300, seconds=60.0, folder=tmp_path, workers=1)
    assert again.run().rows == found.rows, "a folder with counts is gone on with"
    (tmp_path / "fell").mkdir()
    (tmp_path / "fell" / "MATLAB, level 5 fell before").write_bytes(b"no longer")
    assert fuzz.Fuzz(["MATLAB, level 5"], inputs=300, seconds=60.0, folder=tmp_path).run().rows[0][1] == 301
    assert list((tmp_path / "fell").iterdir()) == []


def _dying(content: bytes, path: Path) -> object:
    match content[:1]:
        case b"k":
            os.kill(os.getpid(), signal.SIGKILL)
        case b"h":
            while True:
                pass
        case b"m":
            return len(bytearray(1 << 32))
        case b"e":
            raise KeyError(content)
    return content[:1]


@pytest.mark.parametrize("job", [True, False])
def test_what_ends_or_holds_up_a_parser_is_told(job: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    monkeypatch.setattr(fuzzed, "SLOWEST", 1)
    monkeypatch.setattr(fuzzed.Loop, "_tell", lambda self, content, words: told.append(words))
    monkeypatch.setattr(fuzzed.Loop, "_changed", lambda self: b"akhmeb"[self.counts["inputs"] :][:1])
    made = Container(".x", (b"z",), _dying, use=lambda path: None, job=job)
    loop = fuzzed.Loop("made up", made, seed=0, kept=tmp_path / "kept", folder=tmp_path)
    (tmp_path / "kept").mkdir()
    counts = loop.run(6, 60.0)
    assert counts["inputs"] == 6
    assert (counts["fell"], counts["contained"]) == ((0, 2) if job else (4, 0))
    assert told[:2] == [
        f"{'contained: ' * job}{words}" for words in ("ended the process with -9", "took more than 1 s")
    ]


def _raises(error: Exception) -> Callable[[Path], object]:
    def use(path: Path) -> object:
        raise error

    return use


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (FlightError("no."), "r"),
        (KeyError("a"), "x KeyError"),
        (MemoryError(), "x MemoryError"),
        (OSError(5, "io"), "x OS"),
    ],
)
def test_what_is_no_error_of_ours_is_counted(
    error: Exception, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(worker._made, "made up", Target(".x", (b"a",), lambda whole, chance: whole[0], _raises(error)))
    assert worker.outcome("made up", 0, tmp_path).startswith(told)


DYING = """
import os, signal, sys
for line in sys.stdin:
    name, first, count = line.split("\\t")
    for seed in range(int(first), int(first) + int(count)):
        print("?", seed, flush=True)
        if seed == 3:
            os.kill(os.getpid(), signal.SIGSEGV)
        while seed == 6:
            pass
        print("a", seed, flush=True)
    print(".", flush=True)
"""


def test_a_dead_and_a_hanging_process_are_counted_and_the_rest_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "WORKER", (sys.executable, "-c", DYING))
    monkeypatch.setattr(files, "SLOWEST", 0.3)
    siege = Files(["dying"], files=9, seconds=60.0, workers=1)
    found = siege.run()
    assert found.rows[0] == ["dying", 9, 7, 0, 0, 0, 1, 1]
    assert f"seed 3 ended the process with {-signal.SIGSEGV}" in found.bad[0]
    assert "seed 6 took more than 0.3 s" in found.bad[1]
    assert not found.to_document()["passed"]


def _case(old: dict[str, bytes], new: dict[str, bytes]) -> Case:
    case = object.__new__(Case)
    case.old, case.new, case.varies = old, {**new, "mine.txt": b"mine"}, set()
    return case


@pytest.mark.parametrize(
    ("found", "complete", "problem"),
    [
        ({"a": b"old", "b": b"old"}, False, ""),
        ({"a": b"new", "b": b"new"}, True, ""),
        ({"b": b"new"}, False, ""),
        ({"a": b"old", "b": b"new"}, False, "side by side"),
        ({"a": b"ne", "b": b"new"}, False, "a is half-written (2 bytes)"),
        ({"a": b"new"}, True, "is said to be complete"),
        ({"a": b"old", "b": b"old"}, True, "is said to be complete"),
    ],
)
def test_old_or_new_and_nothing_between(found: dict[str, bytes], complete: bool, problem: str) -> None:
    case = _case({"a": b"old", "b": b"old"}, {"a": b"new", "b": b"new"})
    wrong = case.judged({**found, "mine.txt": b"mine"}, complete=complete)
    assert [problem in words for words in wrong] == ([True] if problem else [])
    assert "own file is gone" in case.judged(found, complete=complete)[0]


def test_kills_and_full_disks_in_short() -> None:
    chosen, loaded = (
        {"maneuver": kills.QUICK["maneuver"]},
        ("swashplate.cli.app", "swashplate.flights.maneuvers.planned"),
    )
    found = kills.besiege(chosen, kills=2, failures=2, seconds=600.0, loaded=loaded)
    assert [one.bad for one in found] == [[], []]
    assert [one.rows[0][2] for one in found] == [2, 2]


def test_odd_paths_in_short() -> None:
    loaded = ("swashplate.cli.app", "swashplate.flights.maneuvers.planned")
    chosen = ("nothing", "pipe that nobody writes into", "folder", "no permission")
    found = places.besiege(commands=("maneuver",), places=chosen, loaded=loaded)
    assert found.bad == []
    assert found.rows[-1][1] == len(chosen)


@pytest.mark.parametrize(
    ("code", "said", "seconds", "problem"),
    [
        (2, "Error: no such file.", 1.0, ""),
        (1, "Error: KeyError", 1.0, "ends with 1"),
        (0, "", 1.0, "ends with 0"),
        (2, "Traceback", 1.0, "says"),
        (2, "Error: no.", 11.0, "takes 11.0 s"),
    ],
)
def test_an_odd_path_is_refused_or_counted(code: int, said: str, seconds: float, problem: str, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_bytes(b"mine")
    told = {"code": code, "seconds": seconds, "hang": False}
    wrong = places._wrong(told, said, "nothing", tmp_path, reads=True)
    assert [words.startswith(problem) for words in wrong] == ([True] if problem else [])
    (tmp_path / ".swash-abc").touch()
    assert "leaves .swash-abc" in places._wrong(told, said, "nothing", tmp_path, reads=True)


def test_packets_in_short(monkeypatch: pytest.MonkeyPatch) -> None:
    some = {
        name: make
        for name, make in packets.LINKS.items()
        if name not in ("ArduPilot, strangers", "ArduPilot, a second autopilot", "PX4")
    }
    monkeypatch.setattr(packets, "LINKS", some)
    found = packets.besiege(packets=packets._EVERY, seconds=60.0)
    assert found.bad == []
    assert [row[1] for row in found.rows] == [packets._EVERY] * len(some)


def test_a_link_that_is_moved_by_strangers_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def take(data: bytes, chance: random.Random) -> None:
        if len(data) > 1000:
            raise IndexError(len(data))

    link = packets._Link(take, (b"a" * 2000,), lambda: "it moved")
    monkeypatch.setattr(packets, "LINKS", {"made up": lambda: link})
    found = packets.besiege(packets=3 * packets._EVERY, seconds=20.0)  # a packet that fails is not looked behind
    assert any("IndexError" in words for words in found.bad)
    assert any("it moved" in words for words in found.bad)


def test_hostile_pages_in_short() -> None:
    found = pages.besiege(half_open=70, live=False, every=4)
    assert found.bad == []
    assert sum(row[2] for row in found.rows) > 90


def test_small_machines_in_short() -> None:
    found = small.besiege(
        commands=("inspect a bag",), machines=("1 GB of memory", "64 open files", "no standard streams")
    )
    assert found.bad == []
    assert [row[1] for row in found.rows] == [1, 1, 1]
    lying = small.besiege(commands=("simulate",), machines=("a compiler that says yes and writes nothing",))
    assert lying.bad == []
    assert lying.rows[0][3] == 1, "it is refused in words"


@pytest.mark.parametrize(
    ("ended", "problem"),
    [
        (Ended(0, ""), ""),
        (Ended(2, "Error: no."), ""),
        (Ended(None, ""), "hangs"),
        (Ended(-11, ""), "ends with -11"),
        (Ended(0, "Traceback"), "ends with 0"),
        (Ended(2, "This is a bug in swashplate"), "ends with 2"),
        (Ended(2, ""), "says"),
    ],
)
def test_how_a_command_ends_on_a_small_machine_is_judged(ended: Ended, problem: str) -> None:
    assert ended.wrong().startswith(problem)
    assert bool(ended.wrong()) == bool(problem)


def test_neighbours_in_short() -> None:
    found = neighbours.besiege(commands=("simulate",))
    assert found.bad == []
    assert found.rows[0][1] > 0
    assert found.rows[0][3] > 0, "it is seen that a library is loaded"


@pytest.mark.parametrize(
    ("event", "problem"),
    [
        (("open", "/t/fixed", False), "fixed in the folder for temporary files has the same name each time"),
        (("open", "/t/another/fixed", False), ""),
        (("os.mkdir", "/t/r4nd0m", 0o777), "others may look into"),
        (("os.mkdir", "/t/r4nd0m", 0o700), ""),
        (("open", "/etc/odd", False), "writes to /etc/odd"),
        (("open", "/c/swashplate/c/a.so", True), ""),
        (("socket.bind", "('127.0.0.1', 0)", "AF_INET"), "can be reached"),
        (("socket.bind", "'\\x00swashplate-core-0'", "AF_UNIX"), "can be reached"),
        (("socket.connect", "('1.2.3.4', 80)", "AF_INET"), "connects to"),
        (("ctypes.dlopen", "/o/planted.so", ""), ""),
        (("ctypes.dlopen", "/home/else/planted.so", ""), "loads /home/else/planted.so"),
        (("subprocess.Popen", "cc", ""), "starts cc"),
        (("subprocess.Popen", "/usr/bin/cc", ""), ""),
    ],
)
def test_what_a_neighbour_could_use_is_told(event: neighbours.Event, problem: str) -> None:
    places = {"temporary": Path("/t"), "cache": Path("/c"), "out": Path("/o")}
    told = neighbours.wrong([event], [("open", "/t/fixed", False), ("os.mkdir", "/t/other", 0o700)], places)
    assert [words.startswith(problem) for words in told] == ([True] if problem else [])


def test_odd_options_in_short() -> None:
    loaded = ("swashplate.cli.app", "swashplate.flights.maneuvers.planned")
    found = odd_options.besiege(count=12, seconds=120.0, seed=1, verbs=("maneuver check",), loaded=loaded)
    assert found.bad == []
    assert found.rows[-1][1] == 12


@pytest.mark.parametrize(
    ("code", "said", "seconds", "problem"),
    [
        (2, "Error: --rate: is 1e308.", 1.0, ""),
        (0, "trimmed", 1.0, ""),
        (1, "Error: KeyError", 1.0, "ends with 1"),
        (2, "This is a bug in swashplate", 1.0, "ends with 2"),
        (2, "Error: no.", 61.0, "takes 61 s"),
    ],
)
def test_an_odd_option_is_judged(code: int, said: str, seconds: float, problem: str) -> None:
    came = odd_options.wrong({"code": code, "seconds": seconds, "hang": False}, said)
    assert came.startswith(problem)
    assert bool(came) == bool(problem)
