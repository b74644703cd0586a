"""The libraries that pages load, three.js and uPlot: they are here, and they are those that were pinned."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

from swashplate.errors import SwashError

_LIVE = Path(__file__).parent.parent / "live"
PAGE = _LIVE / "page"
"""Modules and styles that every page may use; the libraries lie in its folder `vendor`."""
LIBRARIES: Mapping[str, str] = json.loads((_LIVE / "libraries.json").read_text(encoding="utf-8"))
"""SHA-256 of what `scripts/vendor_page.py` brings, by name."""


def check_page() -> None:
    """That the page's libraries are here and are those that were pinned: they run in the pilot's browser.

    Raises:
        SwashError: saying how to get them.
    """
    files = {name: PAGE / "vendor" / name for name in LIBRARIES}
    missing = [name for name, path in files.items() if not path.is_file()]
    if missing:
        raise SwashError(
            f"lacks {', '.join(missing)}: this is a source checkout without the page's libraries.",
            where=PAGE / "vendor",
            hint="Run `python scripts/vendor_page.py` there (it needs Node's npm), or install a wheel.",
        )
    changed = [n for n, path in files.items() if hashlib.sha256(path.read_bytes()).hexdigest() != LIBRARIES[n]]
    if changed:
        raise SwashError(
            f"{', '.join(changed)}: not the library that was pinned (SHA-256 differs); the page is not served.",
            where=PAGE / "vendor",
            hint="Somebody or something changed it. Run `python scripts/vendor_page.py`, or install the wheel again.",
        )
