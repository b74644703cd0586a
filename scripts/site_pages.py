"""What Sphinx does with the pages of docs/ besides reading them: navigation, the Python reference, notebooks.

* A page with `<!-- navigation -->` gives its children by its own lists: every item that begins with a link to a page,
  under its heading of the second level. So the list that a person reads and the navigation are the same.
* `<!-- python reference -->` becomes every public name with its signature and docstring (`site_reference`).
* A page of docs/notebooks is offered as a Jupyter notebook too.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import docs_pages
import site_reference
from pygments.lexers.special import TextLexer

NAVIGATION = "<!-- navigation -->"
REFERENCE = "<!-- python reference -->"
NOTEBOOKS = "notebooks/"
_HEADING = re.compile(r"^## (.+)$", re.MULTILINE)
_ITEM = re.compile(r"^(?:[*-]|\d+\.) +\**\[[^\]]+\]\(([^)#]+)\.md\)", re.MULTILINE)


def navigation(text: str) -> str:
    """Hidden tables of contents, one for every heading of a page that lists pages."""
    parts = _HEADING.split(text)
    groups = [("", parts[0]), *zip(parts[1::2], parts[2::2], strict=True)]
    made = []
    for title, body in groups:
        items = _ITEM.findall(body)
        if items:
            caption = f":caption: {title}\n" if title else ""
            made.append("```{toctree}\n:hidden:\n" + caption + "\n" + "\n".join(items) + "\n```")
    return "\n\n".join(made)


def notebook(text: str) -> dict[str, Any]:
    """A page as a Jupyter notebook: its prose and its `python` fences; what they printed is left out."""
    cells, end = [], 0

    def prose(piece: str) -> None:
        if piece.strip():
            cells.append({"cell_type": "markdown", "metadata": {}, "source": piece.strip()})

    for fence in docs_pages.fences(text):
        if fence.language not in ("python", "text"):
            continue
        opening = text.rindex("```", 0, fence.start)
        prose(text[end:opening])
        end = fence.stop + len("```")
        if fence.language == "python":
            source = fence.text.rstrip("\n")
            cells.append(
                {"cell_type": "code", "metadata": {}, "source": source, "outputs": [], "execution_count": None}
            )
    prose(text[end:])
    for number, cell in enumerate(cells):
        cell["id"] = f"cell-{number}"
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}


def _read(app: Any, name: str, source: list[str]) -> None:
    text = source[0]
    if REFERENCE in text:
        text = text.replace(REFERENCE, site_reference.reference())
    if name.startswith(NOTEBOOKS) and name != "notebooks/index":
        link = f'<a href="{Path(name).name}.ipynb" download>Download this page as a Jupyter notebook</a>'
        text += f"\n\n```{{raw}} html\n<p>{link}</p>\n```\n"
    if NAVIGATION in text:
        text += "\n\n" + navigation(text) + "\n"
    source[0] = text


def _finish(app: Any, exception: Exception | None) -> None:
    if exception is not None or app.builder.format != "html":
        return
    for page in sorted((Path(app.srcdir) / NOTEBOOKS).glob("*.md")):
        if page.stem != "index":
            made = json.dumps(notebook(page.read_text(encoding="utf-8")), indent=1)
            (Path(app.outdir) / NOTEBOOKS / f"{page.stem}.ipynb").write_text(made + "\n", encoding="utf-8")


def setup(app: Any) -> dict[str, Any]:
    app.add_lexer("csv", TextLexer)
    app.connect("source-read", _read)
    app.connect("build-finished", _finish)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
