"""How much there is to learn: verbs, options, public names, and how soon the help is there."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

from typer.main import get_command

import swashplate as sp
from swashplate.cli.app import app
from swashplate.cli.verbs import VERBS

ROOT = Path(__file__).resolve().parents[2]
MOST_VERBS, MOST_OPTIONS, MOST_NAMES = 20, 260, 60
HELP_SECONDS = 0.3
"""Of the processor."""
SAME = (
    "--out",
    "--precision",
    "--outputs",
    "--vehicle",
    "--flight",
    "--hold-out",
    "--set",
    "--seed",
    "--unit",
    "--mapping",
)
"""Options that mean the same wherever they stand."""
REFERENCE = ("command-line.md", "old-names.md")
"""Pages that list every option, and say nothing of what it is for."""


def _commands(group: Any, before: str = "swash") -> Iterator[tuple[str, Any]]:
    yield before, group
    for name, command in getattr(group, "commands", {}).items():
        yield from _commands(command, f"{before} {name}")


def _options() -> list[tuple[str, str]]:
    """Every option of every command, without --help."""
    return [
        (name, parameter.opts[0])
        for name, command in _commands(get_command(app))
        for parameter in command.params
        if parameter.param_type_name == "option" and parameter.name != "help"
    ]


def _pages() -> str:
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    return "\n".join(page.read_text(encoding="utf-8") for page in pages if page.name not in REFERENCE)


def test_there_are_few_verbs_and_few_options() -> None:
    options = _options()
    print(f"{len(VERBS)} verbs, {len(options)} options")
    assert len(VERBS) <= MOST_VERBS
    assert len(options) <= MOST_OPTIONS
    assert len({name for name, _ in options}) > 30, "options of verbs inside groups are counted too"


def test_every_option_stands_on_a_page_that_says_what_it_is_for() -> None:
    text = _pages()
    flags = sorted({flag for _, flag in _options()})
    assert [flag for flag in flags if not re.search(rf"{flag}(?![\w-])", text)] == []


def test_an_option_of_one_name_takes_the_same_everywhere() -> None:
    taken: dict[str, set[tuple[bool, str]]] = {}
    for _, command in _commands(get_command(app)):
        for p in command.params:
            if p.param_type_name == "option" and p.opts[0] in SAME:
                taken.setdefault(p.opts[0], set()).add((p.is_flag, (p.metavar or "").removesuffix("|FILE")))
    assert {flag: kinds for flag, kinds in taken.items() if len(kinds) > 1} == {}


def test_there_are_few_public_names_and_nothing_else() -> None:
    print(f"{len(sp.__all__)} names")
    assert len(sp.__all__) == len(set(sp.__all__)) <= MOST_NAMES
    others = {name for name in dir(sp) if not name.startswith("__")} - set(sp.__all__)
    assert others == set()
    modules = {name for name, value in vars(sp).items() if isinstance(value, ModuleType)}
    assert {name for name in vars(sp) if not name.startswith("_")} - modules <= set(sp.__all__)


def test_help_is_there_at_once() -> None:
    """Within 0.3 s of the processor; where all is slow, within 1.8 times what the library of command lines takes."""
    spent = [(_seconds("-m", "swashplate", "--help"), _seconds("-c", "import typer.main")) for _ in range(3)]
    ours, library = (min(each) for each in zip(*spent, strict=True))
    print(f"{ours:.3f} s of the processor, typer alone {library:.3f} s")
    assert 0.0 < ours < max(HELP_SECONDS, 1.8 * library)


def _seconds(*words: str) -> float:
    """Of the processor that a Python takes."""
    before = os.times()
    subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL)
    after = os.times()
    return after.children_user - before.children_user + after.children_system - before.children_system
