"""Every `$ swash` line of the helicopter's pages runs."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from swashplate.cli.app import app

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGES = (
    "explanation/conventional-helicopter.md",
    "explanation/lpv.md",
    "howto/your-own-helicopter.md",
    "howto/published-derivatives.md",
)


@pytest.mark.parametrize("page", PAGES)
def test_commands_of_a_page(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = (DOCS / page).read_text(encoding="utf-8")
    for name, content in re.findall(r"<!-- file: (\S+) -->\n```\w+\n(.*?)```", text, re.DOTALL):
        Path(name).write_text(content, encoding="utf-8")
    lines = [line.strip() for line in text.splitlines()]
    commands = [line.removeprefix("$ swash ") for line in lines if line.startswith("$ swash ")]
    assert commands
    for command in commands:
        outcome = CliRunner().invoke(app, shlex.split(command))
        assert outcome.exit_code == 0, (command, outcome.output)
