"""What Sphinx does with the pages of docs/ besides reading them: navigation, the Python reference, notebooks.

* A page with `<!-- navigation -->` gives its children by its own lists: every item that begins with a link to a page,
  under its heading of the second level. So the list that a person reads and the navigation are the same.
* A link to a file of the repository's root leads to its page (`OF_THE_ROOT`).
* A link into research/, which is no part of the site, becomes the name of its file.
* `<!-- include -->` before a link to a file of the repository's root shows that file there, with links that hold.
* `<!-- fly NAME -->` becomes the vehicle's exported page (`--format web`), where ziglang is installed; `fly all` leads
  to that of every packaged vehicle.
* `<!-- step NAME KNOB -->` becomes a small page in which a control, a number or the speed is moved (`step_picture`).
* `<!-- python reference -->` becomes every public name with its signature and docstring (`site_reference`).
* A page of docs/notebooks is offered as a Jupyter notebook too.
"""

from __future__ import annotations

import json
import posixpath
import re
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import docs_pages
import docs_running
import site_reference
import step_picture
from pygments.lexers.special import TextLexer
from sphinx.search.en import SearchEnglish

import swashplate as sp
from swashplate.atomic import write_text
from swashplate.models.card import packaged_cards

NAVIGATION = "<!-- navigation -->"
REFERENCE = "<!-- python reference -->"
NOTEBOOKS = "notebooks/"
FLYING, ALL = "fly", "all"
"""Folder of the exported pages, and what asks for that of every packaged vehicle."""
OF_THE_ROOT = {
    "README.md": "index.md",
    "ARCHITECTURE.md": "developers/architecture.md",
    "CONTRIBUTING.md": "developers/contributing.md",
    "CHANGELOG.md": "developers/changes.md",
    "SECURITY.md": "developers/security-policy.md",
}
"""Where files of the repository's root stand on the site."""

_INCLUDE = re.compile(r"^<!-- include -->\[[^\]]+\]\((?:\.\./)+(\w+\.md)\)$", re.MULTILINE)
_TO_THE_ROOT = re.compile(r"\]\((?:\.\./)+([A-Z]+\.md)\)")
_TO_RESEARCH = re.compile(r"\[([^\[\]]*)\]\((?:\.\./)+(research/[\w./-]+\.md)(?:#[^)]*)?\)")
_FLY = re.compile(r"^<!-- fly (\w+) -->$", re.MULTILINE)  # "all": links to those of every packaged vehicle
_STEP = re.compile(r"^<!-- step (\w+) (\w+) -->$", re.MULTILINE)
_LINK = re.compile(r"\[([^\[\]]*)\]\((?!https?:|#)([^)\s]+)\)")
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


def included(name: str, page: str) -> str:
    """A file of the repository's root as part of a page, with links and pictures relative to that page.

    Args:
        name: of the file.
        page: the page's path below docs/.
    """
    here = posixpath.dirname(page)

    def relative(match: re.Match[str]) -> str:
        path, mark, anchor = match[2].partition("#")
        target = path.removeprefix("docs/") if path.startswith("docs/") else OF_THE_ROOT.get(path)
        if target is None:
            return match[1]  # a file that is no page
        return f"[{match[1]}]({posixpath.relpath(target, here or '.')}{mark}{anchor})"

    return _LINK.sub(relative, (docs_pages.ROOT / name).read_text(encoding="utf-8"))


def notebook(text: str) -> dict[str, Any]:
    """A page as a Jupyter notebook: its prose and its `python` fences; what they printed is left out."""
    cells, end = [], 0

    def prose(piece: str) -> None:
        if piece.strip():
            cells.append({"cell_type": "markdown", "metadata": {}, "source": piece.strip()})

    for fence in docs_running.fences(text):
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


def flying(name: str, here: str, *, knob: str = "") -> str:
    """A vehicle's exported page inside a page of a folder, or a step of it; nothing where no ziglang makes one."""
    if find_spec("ziglang") is None:
        return ""
    if name == ALL:
        links = (f'<a href="{posixpath.relpath(FLYING, here)}/{one}.html">{one}</a>' for one in packaged_cards())
        return f"```{{raw}} html\n<p>Fly one in this browser: {', '.join(links)}.</p>\n```"
    file = f"{name}-{knob}" if knob else name
    place = posixpath.relpath(f"{FLYING}/{file}.html", here)
    may = 'loading="lazy" sandbox="allow-scripts allow-downloads"'
    title, look = (f"{name}, a step", "step") if knob else (f"{name}, flying", "flying")
    frame = f'<iframe class="{look}" src="{place}" title="{title}" {may}></iframe>'
    more = "" if knob else f'\n<p><a href="{place}">Fly {name} in the whole window</a></p>'
    return f"```{{raw}} html\n{frame}{more}\n```"


def _read(app: Any, name: str, source: list[str]) -> None:
    text = _INCLUDE.sub(lambda match: included(match[1], f"{name}.md"), source[0])
    here = posixpath.dirname(name) or "."
    text = _TO_THE_ROOT.sub(lambda match: f"]({posixpath.relpath(OF_THE_ROOT[match[1]], here)})", text)
    text = _TO_RESEARCH.sub(r"\1 (`\2`)", text)
    text = _FLY.sub(lambda match: flying(match[1], here), text)
    text = _STEP.sub(lambda match: flying(match[1], here, knob=match[2]), text)
    if REFERENCE in text:
        text = text.replace(REFERENCE, site_reference.reference())
    if name.startswith(NOTEBOOKS):
        link = f'<a href="{Path(name).name}.ipynb" download>Download this page as a Jupyter notebook</a>'
        text += f"\n\n```{{raw}} html\n<p>{link}</p>\n```\n"
    if NAVIGATION in text:
        text += "\n\n" + navigation(text) + "\n"
    source[0] = text


def _finish(app: Any, exception: Exception | None) -> None:
    if exception is not None or app.builder.format != "html":
        return
    if find_spec("ziglang") is not None:
        folder = Path(app.outdir) / FLYING
        whole = "\n".join(page.read_text(encoding="utf-8") for page in Path(app.srcdir).rglob("*.md"))
        asked = set(_FLY.findall(whole))
        for name in sorted({*asked, *packaged_cards()} - {ALL} if ALL in asked else asked):
            sp.export_model(name, "web").save(folder)
        for name, knob in sorted(set(_STEP.findall(whole))):
            write_text(folder / f"{name}-{knob}.html", step_picture.step_picture(name, knob))
    for page in sorted((Path(app.srcdir) / NOTEBOOKS).glob("*.md")):
        made = json.dumps(notebook(page.read_text(encoding="utf-8")), indent=1)
        (Path(app.outdir) / NOTEBOOKS / f"{page.stem}.ipynb").write_text(made + "\n", encoding="utf-8")


_stem = lru_cache(maxsize=None)(SearchEnglish({}).stemmer.stemWord)


class _Search(SearchEnglish):
    """Sphinx's English search, which stems each word once and not once a page."""

    def stem(self, word: str) -> str:
        return _stem(word.lower())


def setup(app: Any) -> dict[str, Any]:
    app.add_search_language(_Search)
    app.add_lexer("csv", TextLexer)
    app.connect("source-read", _read)
    app.connect("build-finished", _finish)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
