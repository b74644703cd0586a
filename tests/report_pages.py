"""A report's page as a reader sees it: its words, and what its figures say."""

from __future__ import annotations

import base64
import gzip
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from swashplate.reporting.packing import _GAP


def whole(path: Path) -> str:
    """The page's text, followed by its figures' descriptions as JSON."""
    page = path.read_text(encoding="utf-8")
    packed = re.search(r'id="figures-gzip">([A-Za-z0-9+/=]*)</script>', page)
    assert packed, "the page carries its figures"
    return page + json.dumps(read_figures(packed[1]), ensure_ascii=False)


def read_figures(text: str) -> list[dict[str, Any]]:
    """What `figures_text` wrote, each with its rows as lists (None is a gap): what the page's script does."""
    whole = gzip.decompress(base64.b64decode(text))
    size = int.from_bytes(whole[:4], "little")
    rows = whole[4 + size :]
    specs: list[dict[str, Any]] = json.loads(whole[4 : 4 + size])
    for spec in specs:
        for trace in spec["data"]:
            for side in ("x", "y"):
                if isinstance(trace.get(side), dict) and "at" in trace[side]:
                    trace[side] = _row(trace[side], rows)
    return specs


def _row(place: Mapping[str, Any], rows: bytes) -> list[float | None]:
    n, at = place["n"], place["at"]
    high, low = (np.frombuffer(rows, dtype=np.uint8, count=n, offset=at + k * n).astype(np.int64) for k in (0, 1))
    levels = np.cumsum(256 * high + low) % 65536
    return [None if level == _GAP else float(place["low"] + place["step"] * level) for level in levels]
