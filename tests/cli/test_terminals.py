"""Terminals that are not UTF-8, and names that are made to deceive: all is shown, nothing disturbs the screen."""

from __future__ import annotations

import json
import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest

NAMES = ["ro\u202ell", "na中😀", "qé\x1b]0;hidden\x07", "\x1bcreset"]
COMMAND = [sys.executable, "-P", "-m", "swashplate", "inspect"]


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A log whose channels have such names, and which has such a name."""
    head = ",".join(["time [s]", *(f"{name} [deg]" for name in NAMES)])
    rows = "".join(f"{0.01 * i},{i % 7},{i % 5},{i % 3},{i % 2}\n" for i in range(300))
    (tmp_path / "a\u2066b.csv").write_text(f"{head}\n{rows}", encoding="utf-8")
    return tmp_path / "a\u2066b.csv"


@pytest.mark.parametrize(
    "encoding",
    [
        "cp1252",
        "ascii",
        "utf-8",
        *(pytest.param(name, marks=pytest.mark.proof) for name in ("latin-1", "cp437", "shift_jis")),
    ],
)
def test_everything_is_shown_in_any_encoding(encoding: str, log: Path) -> None:
    here = {**os.environ, "PYTHONIOENCODING": encoding}
    told = subprocess.run([*COMMAND, log.name], cwd=log.parent, env=here, capture_output=True, check=True).stdout
    text = told.decode(encoding)
    for shown in ("ro\\u202ell", "\\u001b]0;hidden\\u0007", "a\\u2066b.csv"):
        assert shown in text
    assert "na\\u4e2d\\ud83d\\ude00" in text or encoding in ("utf-8", "shift_jis")
    assert not {"\x1b", "\x07", "\u202e", "\u2066"} & set(text)
    listed = subprocess.run([*COMMAND, log.name, "--json"], cwd=log.parent, env=here, capture_output=True, check=True)
    told_names = [channel["name"] for channel in json.loads(listed.stdout.decode(encoding))["channels"]]
    assert told_names == NAMES, "JSON has the names themselves"


@pytest.mark.parametrize("way", [{}, {"PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}])
def test_a_system_without_a_language_shows_it_too(way: dict[str, str], log: Path) -> None:
    here = {name: value for name, value in os.environ.items() if not name.startswith(("LC_", "LANG"))}
    here["LC_ALL"] = "POSIX"
    told = subprocess.run(
        [*COMMAND, log], env={**here, "LC_ALL": "POSIX", **way}, capture_output=True, check=True
    ).stdout
    assert b"ro\\u202ell" in told


def test_a_name_that_is_no_text_is_shown_on_both_streams(tmp_path: Path) -> None:
    name = b"x\xff\x1b[2Jy.csv"
    told = subprocess.run([*map(str, COMMAND), name], cwd=tmp_path, capture_output=True, check=False)
    assert told.returncode == 2
    assert b"x\\udcff\\u001b[2Jy.csv: there is no such file" in told.stderr
    (tmp_path / os.fsdecode(name)).write_text(
        "time [s],p [rad/s]\n" + "".join(f"{0.01 * i},{i % 7}\n" for i in range(300))
    )
    told = subprocess.run([*map(str, COMMAND), name], cwd=tmp_path, capture_output=True, check=True)
    assert b"x\\udcff\\u001b[2Jy.csv" in told.stdout


def test_on_a_screen_our_own_colours_are_all_that_is_left(log: Path) -> None:
    ours, theirs = pty.openpty()
    environment = {name: value for name, value in os.environ.items() if name != "NO_COLOR"} | {"TERM": "xterm"}
    with subprocess.Popen([*COMMAND, log.name], cwd=log.parent, stdout=theirs, stderr=theirs, env=environment) as shown:
        os.close(theirs)
        text = b""
        try:
            while piece := os.read(ours, 4096):
                text += piece
        except OSError:  # how the end of a terminal is told
            pass
    os.close(ours)
    assert shown.returncode == 0
    assert b"\x1b[1m" in text, "headings are bold"
    for code in (b"\x1b]", b"\x1bc", b"\x07", "\u202e".encode()):
        assert code not in text
    assert b"\\u001b]0;hidden\\u0007" in text
