"""`found` says what was done, not what a value is: where it stands is counted, and the count may only fall."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import swashplate

HOUSE = Path(swashplate.__file__).parent
MOST = 14
"""Today: what a search gave or did not give (a compiler, a data file), and what was found beside what was expected."""


def _bound(house: Path) -> list[str]:
    """Where `found` is bound, as a variable, a parameter or a field."""
    places = []
    for place in sorted(house.rglob("*.py")):
        text = place.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if re.search(r"\bfound\b", text) else ():
            name = node.arg if isinstance(node, ast.arg) else node.id if isinstance(node, ast.Name) else ""
            if name == "found" and not isinstance(getattr(node, "ctx", None), ast.Load):
                places.append(f"{place.relative_to(house)}:{node.lineno}")  # type: ignore[attr-defined]
    return places


def test_values_are_not_called_found() -> None:
    places = _bound(HOUSE)
    assert len(places) <= MOST, f"say what the value is (response, poles, match ...): {', '.join(places)}"


def test_every_kind_of_binding_counts(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("def f(found): ...\nfor found in (): print(found)\nif found := 1: ...\n")
    assert sorted(_bound(tmp_path)) == ["a.py:1", "a.py:2", "a.py:3"]
