"""A link and an autopilot that are killed at random, again and again: nothing that was answered is lost.

Every flight ends with `kill -9` of one side. The autopilot writes down the last time stamp of each flight; afterwards
the recordings that lie in the folder have to be these flights, each to its last sample, and nothing else.
"""

from __future__ import annotations

import os
import random
import re
import signal
import socket
import struct
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

import swashplate as sp
from proof_page import leave

PILOT = Path(__file__).parents[1] / "soak_pilot.py"
SPACING = 1.0 / 200.0
LEAST = 0.1
"""s: shorter flights may end before their second sample."""


class Soak:
    """Both sides as processes, and what became of their flights."""

    def __init__(self, folder: Path, seed: int) -> None:
        self.folder, self.random = folder, random.Random(seed)
        self.kills = {"link": 0, "autopilot": 0}
        self.ledgers: list[Path] = []
        self.starts = 0
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
        (folder / "flights").mkdir()

    def start_link(self) -> None:
        command = [
            sys.executable,
            "-m",
            "swashplate",
            "link",
            "ardupilot",
            "--vehicle",
            "coax",
            "--port",
            str(self.port),
        ]
        command += ["--record", str(self.folder / "flights" / "flown.nc")]
        self.link = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=self.environment)
        assert self.link.stderr is not None
        said = ""
        while "waiting for an autopilot" not in said:
            line = self.link.stderr.readline()
            assert line, f"the link did not start: {said}"
            said += line
        os.set_blocking(self.link.stderr.fileno(), False)

    def start_autopilot(self) -> None:
        self.starts += 1
        self.ledgers.append(self.folder / f"ledger-{self.starts}")
        command = [sys.executable, str(PILOT), str(self.port), str(self.ledgers[-1]), str(self.starts)]
        self.autopilot = subprocess.Popen(command, env=self.environment)

    def kill(self, which: str) -> None:
        process = getattr(self, which)
        process.send_signal(signal.SIGKILL)
        process.wait()
        if process.stderr is not None:
            process.stderr.close()
        self.kills[which] += 1

    def progress(self) -> bytes:
        return self.ledgers[-1].read_bytes() if self.ledgers[-1].exists() else b""

    def flies_on(self, longest: float) -> None:
        """Until the newest autopilot gets answers."""
        before, until = self.progress(), time.monotonic() + longest
        while self.progress() == before:
            assert time.monotonic() < until, "the link was not taken up again"
            assert self.link.poll() is None, "the link ended by itself"
            time.sleep(0.05)

    def run(self, seconds: float, *, between: tuple[float, float]) -> None:
        with ExitStack() as clean:
            clean.callback(lambda: [p.kill() for p in (self.link, self.autopilot)])
            self.start_link()
            self.start_autopilot()
            self.flies_on(30.0)
            which, until = "link", time.monotonic() + seconds
            while time.monotonic() < until:
                time.sleep(self.random.uniform(*between))
                self.kill(which)
                getattr(self, f"start_{which}")()
                self.flies_on(60.0)
                which = self.random.choice(("link", "autopilot"))
            time.sleep(between[0])
            self.kill("autopilot")
            self.link.send_signal(signal.SIGINT)
            assert self.link.wait(120) == 0
            assert self.link.stderr is not None
            self.link.stderr.close()

    def flown(self) -> list[float]:
        """The last time stamp of every flight that the autopilots were told [s]."""
        found = []
        for ledger in self.ledgers:
            if ledger.exists():
                found += [value for (value,) in struct.iter_unpack("<d", ledger.read_bytes())]
        return found

    def recorded(self) -> list[float]:
        """The last time stamp of every recording [s]; nothing else may lie there."""
        files = sorted((self.folder / "flights").iterdir())
        assert all(re.fullmatch(r"flown(-\d+)?\.nc", file.name) for file in files), files
        return [sp.read(file).stop for file in files]


def nothing_is_lost(soak: Soak) -> list[tuple[float, float]]:
    """Flights with their recordings, each as long as the other; short ones may have none."""
    flown, recorded = sorted(soak.flown(), reverse=True), sorted(soak.recorded(), reverse=True)
    known = [t for t in flown if t > LEAST]
    assert len(recorded) >= len(known), f"{len(known)} flights, {len(recorded)} recordings"
    assert len(recorded) <= len(flown) + 1
    pairs = list(zip(known, recorded, strict=False))
    # A link that was killed may have kept an answer that nobody read; a recording ends at its last sample.
    assert all(-1.1 * SPACING <= kept - told <= 2.0 * SPACING for told, kept in pairs), pairs
    return pairs


@pytest.mark.proof
def test_a_short_soak_loses_nothing(tmp_path: Path) -> None:
    """Each side is killed once."""
    soak = Soak(tmp_path, seed=2)
    soak.run(0.1, between=(0.5, 1.0))
    assert soak.kills["link"] == 1
    assert len(nothing_is_lost(soak)) == 2


@pytest.mark.parametrize("recorded", [[1.0], [], [1.5, 1.5, 1.5]])
def test_what_is_missing_is_seen(recorded: list[float], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Half a second at the end of a recording, a recording, or a flight that nobody flew."""
    soak = Soak(tmp_path, seed=0)
    soak.ledgers = [tmp_path / "ledger"]
    soak.ledgers[0].write_bytes(struct.pack("<d", 1.5))
    monkeypatch.setattr(soak, "recorded", lambda: recorded)
    with pytest.raises(AssertionError):
        nothing_is_lost(soak)


@pytest.mark.proof
def test_half_an_hour_of_kills_loses_nothing(tmp_path: Path) -> None:
    seconds = 60.0 * float(os.environ.get("SWASHPLATE_SOAK_MINUTES", "30"))
    soak = Soak(tmp_path, seed=1)
    begun = time.monotonic()
    soak.run(seconds, between=(1.0, 12.0))
    pairs = nothing_is_lost(soak)
    worst = max(abs(kept - told) for told, kept in pairs)
    rows = [
        ["minutes", (time.monotonic() - begun) / 60.0],
        ["kills of the link", soak.kills["link"]],
        ["kills of the autopilot", soak.kills["autopilot"]],
        ["flights", len(pairs)],
        ["simulated seconds flown and recorded", sum(told for told, _ in pairs)],
        ["largest difference at a flight's end [ms]", 1e3 * worst],
    ]
    text = "swash link ardupilot --record and an autopilot, each killed (kill -9) at random and started again."
    leave("link_soak", {"title": "A link that is killed at random", "text": text, "columns": ["what", "found"],
                        "rows": rows, "passed": True})  # fmt: skip
