"""`swash link accept` as a user types it: help that says what it does, refusals, and a process that is stopped."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from commands import one_message, swash

pytest.importorskip("pymavlink")
BINARY = Path(__file__).parents[1] / "sitl_standin.py"


def test_what_is_refused(tmp_path: Path) -> None:
    command = ["link", "accept", tmp_path / "none", "--vehicle", "raptor50", "--out", tmp_path / "out"]
    assert "there is no such file" in one_message(swash(*command))
    assert "'0.4' is not LOW-HIGH" in one_message(swash(*command, "--settings", "band=0.4"))
    assert "'rol' is none of roll, pitch, yaw, heave" in one_message(swash(*command, "--axes", "rol"))
    given = [
        *command[:2],
        BINARY,
        *command[3:],
        "--settings",
        f"defaults={tmp_path / 'no.parm'}",
        "--settings",
        "instance=61",
    ]
    assert "no.parm: defaults: there is no such file" in one_message(swash(*given))
    assert not (tmp_path / "out").exists()
    ended = one_message(swash(*command[:2], "/bin/true", *command[3:], "--settings", "instance=61"))
    assert "/bin/true: the binary ended with exit code 0; it said nothing." in ended
    assert "gains" not in ended


@pytest.mark.proof
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_command_that_is_stopped_leaves_no_binary_behind(number: signal.Signals, tmp_path: Path) -> None:
    """SIGKILL gives nobody a chance to clean up: then the binary sees that its parent is gone, as ArduPilot's does."""
    out = tmp_path / "out"
    command = [sys.executable, "-m", "swashplate", "link", "accept", str(BINARY), "--vehicle", "raptor50"]
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(sys.path),
        "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]),
    }
    with subprocess.Popen([*command, "--out", str(out), "--settings", "instance=62"], env=environment) as trial:
        until = time.monotonic() + 120.0
        while not (out / "sitl" / "pid").exists():
            assert time.monotonic() < until
            assert trial.poll() is None
            time.sleep(0.1)
        time.sleep(1.0)
        binary = int((out / "sitl" / "pid").read_text())
        trial.send_signal(number)
        assert trial.wait(60) == (128 + number if number == signal.SIGTERM else -number)
    until = time.monotonic() + 10.0
    while Path(f"/proc/{binary}").exists():
        assert time.monotonic() < until, "the binary is still there"
        time.sleep(0.1)
