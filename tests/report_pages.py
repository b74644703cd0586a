"""A report's page as a reader sees it: its words, and what its figures say."""

from __future__ import annotations

import json
import re
from pathlib import Path

from swashplate.reporting.packing import read_figures


def whole(path: Path) -> str:
    """The page's text, followed by its figures' descriptions as JSON."""
    page = path.read_text(encoding="utf-8")
    packed = re.search(r'id="figures-gzip">([A-Za-z0-9+/=]*)</script>', page)
    assert packed, "the page carries its figures"
    return page + json.dumps(read_figures(packed[1]), ensure_ascii=False)
