"""`swash live` while it records: whichever way it ends, the recording is on disk, and its name is told."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from swashplate.compiler import web_compiler
from swashplate.flights.flight import Flight
from swashplate.links.live.recording import recover
from swashplate.links.web import libraries
from told_rows import told

connect = pytest.importorskip("websockets.sync.client", reason="the extra `live` is not installed").connect
pytestmark = pytest.mark.skipif(
    not (libraries.PAGE / "vendor" / "three.module.min.js").is_file() or web_compiler() is None,
    reason="the page's libraries (python scripts/vendor_page.py) or the extra 'compiler' are not here",
)
SECONDS = 2.2


@pytest.fixture
def flying(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[str], Any]]:
    """`swash live` that records, and its page; two seconds are flown. Terminals do not ignore SIGHUP."""
    command = ["-P", "-c", "import signal, runpy; signal.signal(signal.SIGHUP, signal.SIG_DFL); "
               "runpy.run_module('swashplate', run_name='__main__')"]  # fmt: skip
    with subprocess.Popen(
        [sys.executable, *command, "live", "coax", "--port", "0"], cwd=tmp_path, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        assert process.stderr is not None
        try:
            found = re.search(r"http://(\S+)/", process.stdout.readline())
            assert found is not None, process.stderr.read()
            with connect(f"ws://{found[1]}/socket", origin=f"http://{found[1]}") as page:
                version = json.loads(page.recv(timeout=120.0))["version"]
                page.send(json.dumps({"type": "record", "value": True}))
                assert line_of(process) == "Recording 1 grows in live/recording-1.growing.\n"
                page.send(told(version, 1, round(100 * SECONDS)))
                while json.loads(page.recv(timeout=120.0)).get("recording") != SECONDS:
                    pass
                yield process, page
        finally:
            process.kill()


def line_of(process: subprocess.Popen[str]) -> str:
    """The next line on standard error that is no progress of a slow machine."""
    assert process.stderr is not None
    return next(line for line in process.stderr if not line.startswith("... "))


def flown(folder: Path) -> None:
    """What is there is whole."""
    assert sorted(os.listdir(folder)) == ["card-1.toml", "recording-1-truth.nc", "recording-1.nc"]
    assert Flight.load(folder / "recording-1-truth.nc").duration > SECONDS - 0.1
    assert Flight.load(folder / "recording-1.nc").duration > SECONDS - 0.1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_it_with_the_recording_saved(
    number: signal.Signals, flying: tuple[subprocess.Popen[str], Any], tmp_path: Path
) -> None:
    process, _ = flying
    process.send_signal(number)
    _, said = process.communicate(timeout=300)
    (saved,) = (line for line in said.splitlines() if not line.startswith("... "))
    assert saved == "Recording 1 is saved: live/recording-1.nc."
    assert process.returncode == (0 if number == signal.SIGINT else 128 + number)
    flown(tmp_path / "live")


def test_a_closed_page_has_it_saved(flying: tuple[subprocess.Popen[str], Any], tmp_path: Path) -> None:
    process, page = flying
    page.close()
    assert line_of(process) == "Recording 1 is saved: live/recording-1.nc.\n"
    flown(tmp_path / "live")
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=300)
    assert (process.returncode, said) == (0, "")


def test_a_closed_page_that_records_nothing_is_no_news(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "swashplate", "live", "coax", "--port", "0"]
    with subprocess.Popen(command, cwd=tmp_path, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        try:
            found = re.search(r"http://(\S+)/", process.stdout.readline())
            assert found is not None
            with connect(f"ws://{found[1]}/socket", origin=f"http://{found[1]}") as page:
                version = json.loads(page.recv(timeout=120.0))["version"]
                page.send(told(version, 1, 30))
        finally:
            process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=300)
    assert [line for line in said.splitlines() if not line.startswith("... ")] == []
    assert os.listdir(tmp_path) == []


def test_a_hard_kill_leaves_it_for_the_next_session(flying: tuple[subprocess.Popen[str], Any], tmp_path: Path) -> None:
    process, _ = flying
    process.kill()
    process.wait()
    said: list[str] = []
    assert recover(tmp_path / "live", said.append) == (tmp_path / "live" / "recording-1.nc",)
    assert len(said) == 1
    flown(tmp_path / "live")
