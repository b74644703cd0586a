"""The command itself: quick help, version, completion, and what happens on a bug, an interrupt or a broken pipe."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest
from commands import swash, swash_process
from typer.testing import CliRunner

import swashplate as sp
from swashplate.cli.app import app
from swashplate.cli.console import console
from swashplate.flights import inspect as inspect_module


@pytest.mark.parametrize("arguments", [["--help"], ["identify", "--help"], ["vehicle", "show", "--help"]])
def test_help_loads_nothing_heavy(arguments: list[str]) -> None:
    code = (
        "import sys\nfrom swashplate.cli.app import app\n"
        f"app({arguments!r}, standalone_mode=False)\n"
        "heavy = {'jax', 'numpy', 'scipy', 'xarray', 'rich', 'plotly'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.DEVNULL)


def test_a_model_is_computed_without_jax() -> None:
    code = (
        "import sys\nimport swashplate as sp\ncoax = sp.vehicle('coax')\ntrim = sp.trim(coax)\n"
        "sp.linearize(coax, trim)\n"
        "sp.simulate_closed_loop(coax, sp.hover_hold(coax, trim), duration=1.0)\nassert 'jax' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("name", sp.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(sp, name) is not None
    assert name in dir(sp)


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        sp.nonsense  # type: ignore[attr-defined]  # noqa: B018


def test_version(monkeypatch: pytest.MonkeyPatch) -> None:
    outcome = swash("--version")
    assert (outcome.code, outcome.out.split()[1]) == (0, sp.__version__)

    def of(name: str) -> str:
        if name == "casadi":
            raise metadata.PackageNotFoundError(name)
        return "1.2.3"

    monkeypatch.setattr(metadata, "version", of)
    told = swash("--version")
    assert told.code == 0, "the plain package has no CasADi"
    assert "casadi not installed, numpy 1.2.3" in told.out


def test_without_a_verb_the_page_opens_and_help_lists_the_verbs(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []
    monkeypatch.setattr("swashplate.api.open_logs.serve_logs", lambda question, say: asked.append(question))
    assert swash().code == 0
    assert [(one.logs, one.port, one.open_page) for one in asked] == [((), None, True)]
    told = swash("--help")
    assert told.code == 0
    assert "identify" in told.out
    assert len(asked) == 1, "help opens nothing"


def test_an_unknown_verb_and_a_missing_option_are_usage_errors() -> None:
    for arguments in (("idntify",), ("identify", "--vehicle", "coax"), ("simulate", "--rate", "fast")):
        outcome = swash(*arguments)
        assert outcome.code == 2
        assert "Error" in outcome.err


@pytest.mark.parametrize(
    ("line", "expected"),
    [("swash ide", "identify"), ("swash identify --vehicle c", "coax"), ("swash inspect coax56/", "coax56/flight")],
)
def test_shell_completion(line: str, expected: str) -> None:
    outcome = swash_process(
        _SWASH_COMPLETE="complete_bash",
        COMP_WORDS=line,
        COMP_CWORD=str(len(line.split()) - 1),
    )
    assert expected in outcome.out


def _broken(*_: Any, **__: Any) -> None:
    raise ZeroDivisionError("float division by zero")


def test_a_bug_is_one_line_and_exit_code_1(simulated: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inspect_module, "inspect", _broken)
    monkeypatch.setattr(sys, "argv", ["swash", "inspect", "a b.nc"])
    outcome = swash("inspect", simulated)
    assert outcome.code == 1
    assert outcome.err.count("\n") == 1
    for part in ("ZeroDivisionError: float division by zero", "bug in swashplate", "swash --debug inspect 'a b.nc'"):
        assert part in outcome.err


def test_debug_shows_the_traceback(simulated: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inspect_module, "inspect", _broken)
    assert "Traceback" in swash("--debug", "inspect", simulated).err
    monkeypatch.setenv("SWASHPLATE_DEBUG", "1")
    assert "Traceback" in swash("inspect", simulated).err
    monkeypatch.setenv("SWASHPLATE_DEBUG", "0")
    assert "Traceback" not in swash("inspect", simulated).err


def test_an_interrupt_is_130(simulated: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(inspect_module, "inspect", interrupted)
    outcome = swash("inspect", simulated)
    assert (outcome.code, "Stopped" in outcome.err) == (130, True)


def test_colour_can_be_forbidden(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    assert "\x1b[31m" in CliRunner().invoke(app, ["inspect", "none.mat"], color=True).stderr
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b" not in CliRunner().invoke(app, ["inspect", "none.mat"], color=True).stderr


@pytest.mark.parametrize(("columns", "width"), [("20", 40), ("60", 60), ("120", 120)])
def test_a_narrow_terminal_cuts_no_number_off(monkeypatch: pytest.MonkeyPatch, columns: str, width: int) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert console().width == width


def test_a_closed_pipe_is_quiet(simulated: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-m", "swashplate", "inspect", str(simulated)], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert b"Traceback" not in process.stderr.read()


def test_closed_streams_are_no_bug_and_no_file_takes_their_place(tmp_path: Path) -> None:
    words = "import sys; from swashplate.__main__ import main; sys.argv[1:] = ['vehicle', 'structures']; main()"
    asked = 'exec "$0" -c "$1" <&- >&- 2>"$2"'
    ended = subprocess.run(["sh", "-c", asked, sys.executable, words, str(tmp_path / "said")], check=False)
    assert (ended.returncode, (tmp_path / "said").read_text()) == (0, "")


@pytest.mark.parametrize("number", [signal.SIGTERM, pytest.param(signal.SIGHUP, marks=pytest.mark.proof)])
def test_a_polite_kill_leaves_nothing_behind(simulated: Path, tmp_path: Path, number: signal.Signals) -> None:
    code = (
        "import signal, time\nfrom swashplate.cli.app import main\n"
        "signal.signal(signal.SIGHUP, signal.SIG_DFL)\n"  # `nohup make test` would hand down that it is ignored
        "from swashplate.api import identification\n"
        "def slow(*_, **__):\n    print('fitting', flush=True)\n    time.sleep(60)\n"
        "identification.identify = slow\nmain()"
    )
    arguments = ["identify", "--vehicle", "coax", "--flight", str(simulated), "--out", "fit"]
    with subprocess.Popen([sys.executable, "-c", code, *arguments], cwd=tmp_path, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"fitting\n"
        assert os.listdir(tmp_path) != []  # the temporary folder, until then
        process.send_signal(number)
        assert process.wait(20) == 128 + number
    assert os.listdir(tmp_path) == []


INTERRUPTED = """
import os, signal, sys
wanted = sys.argv[1]
class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == wanted:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Interrupting())
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell in the background ignores it
from swashplate.__main__ import main
if wanted == "the command line":
    from typer.core import TyperGroup
    TyperGroup.make_context = lambda *_, **__: os.kill(os.getpid(), signal.SIGINT)
sys.argv = ["swash", "vehicle", "trim", "--vehicle", "coax"]
main()
"""


@pytest.mark.parametrize(
    "loaded",
    [
        "swashplate.threads",
        "swashplate.cli.app",
        "typer",
        "swashplate.api.verbs.steady",
        "numpy",
        "casadi",
        "the command line",
    ],
)
def test_an_interrupt_while_something_is_loaded_ends_in_words(loaded: str) -> None:
    words = [sys.executable, "-P", "-c", INTERRUPTED, loaded]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "Stopped. Nothing was left half-written.\n")


def test_little_is_loaded_before_an_interrupt_ends_in_words() -> None:
    code = "import sys; had = set(sys.modules); import swashplate.__main__; print(*sorted(set(sys.modules) - had))"
    done = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, check=True)
    mine = [name for name in done.stdout.split() if name.startswith("swashplate")]
    assert mine == ["swashplate", "swashplate.__main__"]
    assert not {"typing", "inspect", "pathlib", "importlib.metadata"} & set(done.stdout.split())
