"""Names that say what was done to a value, or nothing, and not what it is: counted, and the count may only fall."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import swashplate

HOUSE = Path(swashplate.__file__).parent
WORDS = ("found", "moved", "words", "told", "plain", "flown", "made", "own", "late", "whole", "seen")
MOST = dict.fromkeys(("api/campaigns", "bench", "cli", "engine", "filtering", "models", "physics"), 0)
MOST |= dict.fromkeys(("links/betaflight", "links/live", "links/logs", "links/px4", "links/web"), 0)
MOST |= {"control": 2, "export": 7, "flights": 2, "identification": 2, "links/ardupilot": 1, "links/mavlink": 1}
MOST |= {"reporting": 8, "simulation": 9, "validation": 7}
"""Today, of all words together: fields of results and of the page's parts that other folders read, and "found"."""
MOST_IN_ALL = {"found": 7}
"""Today, in the whole package."""


def _bound(house: Path, words: tuple[str, ...]) -> list[str]:
    """Where one of some words, perhaps behind a "_", names a variable, a parameter, a field, a function or a class."""
    places = []
    pattern = re.compile(rf"\b_?(?:{'|'.join(words)})\b")
    for place in sorted(house.rglob("*.py")):
        text = place.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if pattern.search(text) else ():
            name = _name_of(node)
            if name.removeprefix("_") in words and not isinstance(getattr(node, "ctx", None), ast.Load):
                places.append(f"{place.relative_to(house)}:{node.lineno} {name}")  # type: ignore[attr-defined]
    return places


def _name_of(node: ast.AST) -> str:
    if isinstance(node, ast.arg):
        return node.arg
    if isinstance(node, ast.Name):
        return node.id
    return node.name if isinstance(node, ast.FunctionDef | ast.ClassDef) else ""


@pytest.mark.parametrize("folder", sorted(MOST))
def test_names_say_what_a_value_is(folder: str) -> None:
    places = _bound(HOUSE / folder, WORDS)
    assert len(places) <= MOST[folder], f"say what it is (response, delayed, summary_text ...): {', '.join(places)}"


@pytest.mark.parametrize("word", sorted(MOST_IN_ALL))
def test_values_are_not_called_found(word: str) -> None:
    places = _bound(HOUSE, (word,))
    assert len(places) <= MOST_IN_ALL[word], f"say what the value is (poles, match ...): {', '.join(places)}"


def test_every_kind_of_binding_counts(tmp_path: Path) -> None:
    text = "def f(found): ...\nfor found in (): print(found)\nif found := 1: ...\n"
    text += "def _told(): ...\nclass A:\n    own: int\n"
    (tmp_path / "a.py").write_text(text)
    assert sorted(_bound(tmp_path, WORDS)) == [
        "a.py:1 found",
        "a.py:2 found",
        "a.py:3 found",
        "a.py:4 _told",
        "a.py:6 own",
    ]
