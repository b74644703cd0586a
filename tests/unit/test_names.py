"""Public class names say one thing in the whole package: none is used twice."""

from __future__ import annotations

import ast
from collections import defaultdict
from pathlib import Path

import swashplate

HOUSE = Path(swashplate.__file__).parent


def _twice(house: Path) -> dict[str, list[str]]:
    """Modules by the name of a public class that several of them define."""
    found = defaultdict(list)
    for place in sorted(house.rglob("*.py")):
        text = place.read_text(encoding="utf-8")
        for node in ast.parse(text).body if "class " in text else ():
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[node.name].append(str(place.relative_to(house)))
    return {name: places for name, places in found.items() if len(places) > 1}


def test_no_two_public_classes_share_a_name() -> None:
    assert _twice(HOUSE) == {}


def test_a_name_used_twice_is_found(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("class Step: ...\nclass _Own: ...\n")
    (tmp_path / "b.py").write_text("class Step: ...\nclass _Own: ...\nclass Other: ...\n")
    assert _twice(tmp_path) == {"Step": ["a.py", "b.py"]}
