"""A page of ours as one HTML file: its modules, styles and data in it, nothing fetched, nothing evaluated from data."""

from __future__ import annotations

import base64
import gzip
import hashlib
import html
import json
import posixpath
import re
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from swashplate.links.web.libraries import PAGE, check_page

WEB_ASSEMBLY = "flight"
"""What is packed under this name is a model's code."""
_IMPORT = re.compile(r'((?:from|import)\s*)"((?:\.|/)[\w./-]+\.js)"')
_STYLE = re.compile(r'<link rel="stylesheet" href="([^"]+)">\n')
_ENTRY = re.compile(r'<script type="module" src="([^"]+)"></script>')


def single_file(
    page: Path,
    *,
    title: str,
    documents: Mapping[str, Any],
    packed: Mapping[str, bytes],
    folders: Mapping[str, Path] | None = None,
    entry: str = "",
    instead: Mapping[str, str] | None = None,
    within: Mapping[str, str] | None = None,
) -> str:
    """The text of a page that opens from a disk.

    Args:
        page: the HTML file as it is served.
        title: of its window.
        documents: what becomes JSON, by the id under which the page's modules find it.
        packed: bytes, gzipped, by id.
        folders: where addresses lead that the page's files ask for ("/open/"), besides "/page/".
        entry: the module that begins, in the stead of the page's own.
        instead: modules that take the place of others, by address.
        within: HTML that takes the place of HTML of the page.

    Raises:
        SwashError: without the page's libraries.
    """
    check_page()
    places = {"/page/": PAGE, **(folders or {})}
    text = page.read_text(encoding="utf-8")
    begins = _ENTRY.search(text)
    assert begins is not None, page
    styles = "".join(_text(address, places) for address in _STYLE.findall(text))
    modules: dict[str, str] = {}
    _add(entry or begins[1], modules, places, instead or {})
    script = (PAGE / "bundle.js").read_text(encoding="utf-8")
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    allowed = {
        "default-src": "'none'",
        "script-src": f"'sha256-{digest}' blob:" + " 'wasm-unsafe-eval'" * (WEB_ASSEMBLY in packed),
        "style-src": "'unsafe-inline'",
        "img-src": "data: blob:",
        "base-uri": "'none'",
        "form-action": "'none'",
    }
    policy = html.escape("; ".join(f"{what} {who}" for what, who in allowed.items()))
    bodies = (
        *(f'<script type="application/json" id="{name}">{_json(one)}</script>' for name, one in documents.items()),
        *(f'<script type="text/plain" id="{name}">{_gzipped(one)}</script>' for name, one in packed.items()),
        f'<script type="text/plain" id="modules">{_packed_modules(json.dumps([*modules.items()]).encode())}</script>',
        f"<script>{script}</script>",
    )
    text = text.replace(begins[0], "\n".join(bodies))
    text = _STYLE.sub("", text).replace("</head>", f"<style>{styles}</style>\n</head>")
    text = re.sub("<title>.*?</title>", lambda _: f"<title>{html.escape(title)}</title>", text, count=1)
    head = '<meta charset="utf-8">'
    text = text.replace(head, f'{head}\n<meta http-equiv="Content-Security-Policy" content="{policy}">')
    for old, new in (within or {}).items():
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def _text(address: str, places: Mapping[str, Path]) -> str:
    begin = next(begin for begin in places if address.startswith(begin))
    return (places[begin] / address.removeprefix(begin)).read_text(encoding="utf-8")


def _add(address: str, modules: dict[str, str], places: Mapping[str, Path], instead: Mapping[str, str]) -> None:
    """A module after those that it imports, which it names by whole addresses."""
    if address in modules:
        return

    def named(match: re.Match[str]) -> str:
        path = posixpath.normpath(posixpath.join(posixpath.dirname(address), match[2]))
        path = instead.get(path, path)
        _add(path, modules, places, instead)
        return f'{match[1]}"{path}"'

    modules[address] = _IMPORT.sub(named, _text(address, places))


def _gzipped(content: bytes) -> str:
    return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode()


_packed_modules = lru_cache(maxsize=2)(_gzipped)
"""The same modules for every page of a kind; the libraries among them take half a second."""


def _json(document: Any) -> str:
    """JSON that ends no script, whatever a card or a log calls things."""
    return json.dumps(document, separators=(",", ":")).replace("<", "\\u003c")
