"""What Windows lacks is asked for in one place: without `fcntl`, `resource` and POSIX's own names everything works."""

from __future__ import annotations

import os
import re
from pathlib import Path
from types import SimpleNamespace

import pytest

import swashplate
from other_machine import hide_posix, started
from swashplate import systems

SOURCE = Path(swashplate.__file__).parent


@pytest.fixture
def other(tmp_path: Path) -> Path:
    """A folder to work in; on the path of Python is what hides the names."""
    hide_posix(tmp_path / "hiding")
    (tmp_path / "here").mkdir()
    return tmp_path / "here"


def ran(other: Path, *words: str) -> str:
    return started({**os.environ, "PYTHONPATH": str(other.parent / "hiding")}, other, *words)


def swash(other: Path, *words: str) -> str:
    return ran(other, "-P", "-m", "swashplate", *words)


def test_what_is_hidden_is_hidden(other: Path) -> None:
    """The tests' own test, also for processes that are started by a process."""
    asked = "import os, signal, sys; print(hasattr(os, 'O_NONBLOCK'), hasattr(signal, 'SIGHUP'), sys.modules['fcntl'])"
    assert ran(other, "-c", asked) == "False False None\n"
    again = f"import subprocess, sys; print(subprocess.run([sys.executable, '-P', '-c', {asked!r}], check=True))"
    assert "False False None" in ran(other, "-c", again)


def test_commands_read_write_and_compute(other: Path) -> None:
    assert "identify" in swash(other, "--help")
    assert "swashplate" in swash(other, "--version")
    swash(other, "simulate", "--vehicle", "coax", "--maneuver", "multisine:roll,0.4-4Hz,20s,0.1", "-o", "a.nc")
    assert "coax, simulated" in swash(other, "inspect", "a.nc")
    swash(other, "respond", "a.nc", "--inputs", "servo_roll", "--outputs", "p", "--out", "response", "--quiet")
    assert (other / "response" / "report.html").is_file()
    assert not list(other.rglob(".swash-*"))


def test_logs_recordings_and_stores(other: Path) -> None:
    (other / "a.csv").write_text("time [s],p [rad/s]\n" + "".join(f"{0.01 * i},{i % 7}\n" for i in range(300)))
    assert "p " in swash(other, "inspect", "a.csv")
    words = """
import sys
from pathlib import Path
import swashplate as sp
from swashplate.api.campaigns.store import CampaignStore
from swashplate.flights.growing import Abandoned, Growing
from swashplate.flights.flight import Flight
flight = sp.read("a.csv")
(name, motion), = flight.streams.items()
with Growing(Path("b.growing"), like=Flight({name: motion.isel(time=slice(0, 0))}, flight.provenance)) as file:
    for t, p in zip(flight.time("p"), flight.values("p")):
        file.append(t, [p])
with Abandoned(Path("b.growing")) as left:
    assert left.free
assert sp.read("b.growing").values("p").tolist() == flight.values("p").tolist()
flight.save("c.nc")
flight.save("c.nc")
assert sp.read("c.nc").values("p").tolist() == flight.values("p").tolist()
store = CampaignStore(Path("store"))
with store.held():
    pass
assert store.owner == ""
print("fine")
"""
    (other / "words.py").write_text(words)
    assert ran(other, "words.py") == "fine\n"


def test_a_bag_without_an_end_is_ended_by_the_clock(other: Path) -> None:
    """No limit of the processor's time and of memory is left there."""
    pytest.importorskip("rosbags")
    import hostile_bags

    words = f"""
from dataclasses import replace
import swashplate as sp
from swashplate.flights import foreign
usual = foreign.limits
foreign.limits = lambda job, size: replace(usual(job, size), processor=0, seconds=1.0)
try:
    sp.read({str(hostile_bags.endless_search(other))!r})
except sp.SwashError as error:
    print(error)
"""
    (other / "words.py").write_text(words)
    assert "was given up: reading it took more than 1 s." in ran(other, "words.py")


def test_one_place_asks() -> None:
    names = re.compile(
        r"^\s*(?:import|from) (?:fcntl|resource|msvcrt|termios|pwd|grp)\b"
        r"|signal\.(?:SIGHUP|SIGXCPU|SIGKILL|SIGALRM|SIGUSR1)|os\.(?:O_NONBLOCK|O_NOFOLLOW|O_CLOEXEC|killpg|setpriority"
        r"|getuid|fork|pwrite|mkfifo)\b",
        re.MULTILINE,
    )
    found = {str(file.relative_to(SOURCE)) for file in SOURCE.rglob("*.py") if names.search(file.read_text("utf-8"))}
    assert found == {"systems.py"}


def test_windows_locks_a_byte_that_nobody_reads(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    asked: list[tuple[int, int, int]] = []
    locking = lambda file, how, count: asked.append((os.lseek(file, 0, os.SEEK_CUR), how, count))  # noqa: E731
    monkeypatch.setattr(systems, "fcntl", None)
    monkeypatch.setattr(systems, "msvcrt", SimpleNamespace(locking=locking, LK_LOCK=1, LK_NBLCK=2))
    with (tmp_path / "a").open("w+b") as file:
        file.write(b"abc")
        file.flush()
        systems.lock(file.fileno())
        systems.lock(file.fileno(), wait=True)
        assert asked == [(0x7FFFFFFE, 2, 1), (0x7FFFFFFE, 1, 1)]
        assert os.lseek(file.fileno(), 0, os.SEEK_CUR) == 3
