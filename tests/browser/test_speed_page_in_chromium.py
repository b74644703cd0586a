"""What `swash vehicle trim --out` and `derivatives --out` write, in a real browser: drawn, without an error."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from chromium import Visit, running_browser
from swashplate.cli.app import app


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    yield from running_browser()


@pytest.mark.parametrize(
    ("verb", "size"),
    [
        ("trim", (1200, 900)),
        pytest.param("trim", (390, 844), marks=pytest.mark.proof),
        pytest.param("derivatives", (1200, 900), marks=pytest.mark.proof),
        ("derivatives", (390, 844)),
    ],
)
def test_the_page_is_drawn_says_nothing_and_fetches_nothing(
    browser: Any, tmp_path: Path, verb: str, size: tuple[int, int]
) -> None:
    page = tmp_path / f"{verb}.html"
    outcome = CliRunner().invoke(app, ["vehicle", verb, "raptor50", "--speed", "0-8/4", "--out", str(page)])
    assert outcome.exit_code == 0, outcome.output
    seen = Visit(browser, page, size)
    assert seen.said == []
    assert all(url.startswith(("file:", "data:", "blob:")) for url in seen.asked)
    marks = seen.page.evaluate(
        "Array.from(document.querySelectorAll('.canvas'), c => c.querySelectorAll('.trace, .point').length)"
    )
    assert len(marks) >= (9 if verb == "derivatives" else 3)
    assert all(count > 0 for count in marks)
    assert seen.page.evaluate("document.documentElement.scrollWidth") <= size[0]
    boxes = seen.page.evaluate("Array.from(document.querySelectorAll('.wide'), b => b.scrollWidth - b.clientWidth)")
    assert max(boxes) <= 1 or size[0] > 400, "on a telephone no panel lies beyond the edge"
    panels = seen.page.evaluate("document.querySelector('.canvas').layout.meta.grid")
    rows = seen.page.evaluate("new Set(document.querySelector('.canvas').layout.annotations.map(a => a.y)).size")
    assert rows == -(-panels["panels"] // min(panels["columns"], 2 if size[0] < 400 else 6))
    seen.page.close()
