"""`swash open` from the command line: what it refuses before a page is served, and what it is told of the logs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

pytest.importorskip("starlette", reason="the extra `live` is not installed")

from swashplate.cli.app import app
from swashplate.links.web import libraries, serving


@pytest.fixture(autouse=True)
def page_is_here(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The page's libraries are not what is tested here."""
    monkeypatch.setattr(libraries, "LIBRARIES", {})


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["open", str(tmp_path / "no.bin"), "--port", "0"])
    assert done.exit_code == 2
    assert "there is no such file" in done.output


def test_an_address_of_others_must_be_meant() -> None:
    done = CliRunner().invoke(app, ["open", "--port", "0", "--host", "0.0.0.0"])
    assert done.exit_code == 2
    assert "--allow-remote" in done.output


def test_the_page_is_served_with_the_options_of_the_reading(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    log = tmp_path / "a.csv"
    log.write_text("time [s],p\n0,1\n1,2\n")
    seen: list[Any] = []
    monkeypatch.setattr(serving, "serve", lambda app_, *_, **given: seen.append((app_, given)))
    done = CliRunner().invoke(app, ["open", str(log), "--unit", "p=deg/s", "--port", "0"])
    assert done.exit_code == 0, done.output
    assert "Open http://127.0.0.1:" in done.output
    assert seen[0][1] == {"first": False}, "a page of logs need not run before others"
