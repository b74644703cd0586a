"""Tables in a terminal of 80 columns, and what a pipe is told of a long job."""

import io
import re
import time
from pathlib import Path

import pytest
from commands import swash
from test_frequency_verbs import log

from swashplate import text_table
from swashplate.cli import console
from swashplate.flights import inspect


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return log(tmp_path_factory.mktemp("narrow") / "flown_with_quite_a_long_name_of_a_file.csv", seed=1, seconds=40.0)


def words(text: str) -> set[str]:
    return set(re.findall(r"[+-]?\d+\.\d+(?:e[+-]\d+)?", text))


@pytest.mark.parametrize(
    "verb",
    [
        ("inspect", "FLOWN"),
        (
            "vehicle",
            "list",
        ),
        ("vehicle", "show", "coax"),
        ("vehicle", "trim", "raptor50", "--speed", "0-10/5"),
        ("vehicle", "derivatives", "raptor50"),
        ("maneuver", "sweep:roll,0.5-8Hz,30s,0.1"),
        ("bench", "plan", "--accuracy", "0.05"),
    ],
    ids=" ".join,
)
def test_no_number_is_broken_at_80_columns(verb: tuple[str, ...], flown: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = [str(flown) if word == "FLOWN" else word for word in verb]
    wide = swash(*asked)
    for module in (console, text_table, inspect):
        monkeypatch.setattr(module, "screen_width", lambda: 80)
    narrow = swash(*asked)
    assert narrow.code == wide.code == 0, narrow.err
    tables = [
        line for line in narrow.out.split("\n") if "  " in line.strip() and not line.lstrip().startswith(("-", "•"))
    ]
    assert max(map(len, tables)) <= 80, max(tables, key=len)
    assert words(wide.out) <= words(narrow.out)


def test_a_pipe_is_told_the_stages_of_a_long_job_once(monkeypatch: pytest.MonkeyPatch) -> None:
    said = io.StringIO()
    monkeypatch.setattr(console, "_STAGES_AFTER", 0.05)
    monkeypatch.setattr("sys.stderr", said)
    with console.progress(quiet=False) as line:
        line.say("reading the flights")
        assert said.getvalue() == ""
        line.say("fitting", note="iteration 1")
        until = time.monotonic() + 10.0
        while not said.getvalue() and time.monotonic() < until:
            time.sleep(0.01)
        line.say("fitting", note="iteration 2")
        line.say("validating")
    assert said.getvalue() == "... fitting\n... validating\n"


def test_quiet_and_quick_ones_say_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    said = io.StringIO()
    monkeypatch.setattr("sys.stderr", said)
    with console.doing("designing the controller", quiet=False):
        pass
    monkeypatch.setattr(console, "_STAGES_AFTER", 0.01)
    with console.doing("designing the controller", quiet=True):
        time.sleep(0.05)
    assert said.getvalue() == ""
