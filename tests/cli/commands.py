"""Commands as a user types them, in this process (quick) or in one of their own (slow, but the whole truth)."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w
from typer.testing import CliRunner

from swashplate.cli.app import app


@dataclass(frozen=True)
class Outcome:
    """What a command left: exit code, standard output and standard error."""

    code: int
    out: str
    err: str


def swash(*arguments: str | Path) -> Outcome:
    """`swash ...` in this process."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    return Outcome(result.exit_code, result.stdout, result.stderr)


def swash_process(*arguments: str | Path, cwd: Path | None = None, **environment: str) -> Outcome:
    """`python -m swashplate ...` in a process of its own."""
    command = [sys.executable, "-m", "swashplate", *map(str, arguments)]
    done = subprocess.run(
        command, cwd=cwd, env={**os.environ, **environment}, capture_output=True, text=True, timeout=300, check=False
    )
    return Outcome(done.returncode, done.stdout, done.stderr)


def saying(**settings: Any) -> Path:
    """A file of settings, for `--settings`."""
    place = Path(tempfile.mkdtemp()) / "settings.toml"
    place.write_text(tomli_w.dumps(settings), encoding="utf-8")
    return place


def one_message(outcome: Outcome) -> str:
    """The error of a refused command: exit code 2, one paragraph on standard error, nothing on standard output."""
    assert outcome.code == 2, (outcome.code, outcome.out, outcome.err)
    assert outcome.out == ""
    assert outcome.err.startswith("Error: ")
    assert outcome.err.count("\n") == 1, outcome.err
    assert "Traceback" not in outcome.err
    return outcome.err.strip()
