"""A user's snippets need no inner module: what a page calls has a name in `swashplate`."""

from __future__ import annotations

import re
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"
PAGES = [*sorted((DOCS / "howto").rglob("*.md")), *sorted((DOCS / "tutorials").rglob("*.md")),
         *sorted((DOCS / "explanation").rglob("*.md")), DOCS.parent / "README.md"]  # fmt: skip


def _inner(text: str) -> set[str]:
    """Imports of inner modules in a page's Python."""
    blocks = re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)
    lines = (line.strip() for block in blocks for line in block.splitlines())
    return {line.partition("  #")[0] for line in lines if re.match(r"(from|import) swashplate\.", line)}


def test_pages_for_users_import_swashplate_alone() -> None:
    found = {page.name: inner for page in PAGES if (inner := _inner(page.read_text(encoding="utf-8")))}
    assert len(PAGES) > 15
    assert found == {}


def test_an_inner_import_is_found() -> None:
    page = "```python\nimport swashplate as sp\nfrom swashplate.flights.flight import Flight\n```\n"
    assert _inner(page) == {"from swashplate.flights.flight import Flight"}
