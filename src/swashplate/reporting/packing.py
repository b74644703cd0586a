"""What a page carries besides its words, made small: plotly.js and the figures' numbers, compressed as text.

Long rows of a linear axis are kept to a 65534th of their span, less than a tenth of a pixel of any panel, as
differences from point to point: those compress, the digits of floating-point numbers hardly do. The page's script
unpacks them.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.atomic import write_text
from swashplate.errors import WriteError
from swashplate.extras import library
from swashplate.kept import cache_folder
from swashplate.reporting.figures.themes import unpacked
from swashplate.reporting.structure import Figure

_LEVELS = 65534
_GAP = 65535
"""The level that stands for no number."""


@cache
def plotly_script() -> str:
    """plotly.js as base64 of gzip; kept in the user's cache folder with its digest, for it takes a tenth of a second.

    Raises:
        SwashError: plotly missing, with the command that installs it.
    """
    script = str(library("plotly.offline", what="a page").get_plotlyjs()).encode("utf-8")
    folder = cache_folder("pages")
    if folder is None:
        return _squeezed(script)
    place = folder / f"plotly-{_digest(script)}.txt"
    with suppress(OSError, ValueError):
        digest, _, known = place.read_text(encoding="ascii").partition("\n")
        if digest == _digest(known.encode("ascii")):
            return known
    text = _squeezed(script)
    with suppress(OSError, WriteError):  # without it, it is made again the next time
        write_text(place, f"{_digest(text.encode('ascii'))}\n{text}")
    return text


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def figures_text(figures: Sequence[Figure]) -> str:
    """All figures as base64 of gzip: four bytes with the length of a JSON text, that text, the rows' bytes.

    In the text, a long row is {"at": first byte, "n": points, "low": least, "step": of a level}.
    """
    rows = bytearray()
    specs = [{"name": figure.identifier, **_spec(figure.spec, rows)} for figure in figures]
    text = json.dumps(specs, separators=(",", ":"), allow_nan=False).encode("utf-8")
    return _squeezed(len(text).to_bytes(4, "little") + text + bytes(rows))


def _squeezed(content: bytes) -> str:
    return base64.b64encode(gzip.compress(content, mtime=0)).decode("ascii")


def _spec(spec: Mapping[str, Any], rows: bytearray) -> dict[str, Any]:
    """A figure whose long rows lie in `rows`."""
    data = []
    for trace in spec["data"]:
        restored = {}
        for side in ("x", "y"):
            axis = spec["layout"].get(f"{side}axis{trace.get(f'{side}axis', side)[1:]}", {})
            if not (isinstance(row := trace.get(side), Mapping) and "bdata" in row):
                continue
            values = unpacked(row)
            restored[side] = _levels(values, rows) if axis.get("type") != "log" else _as_list(values)
        data.append({**trace, **restored})
    return {"data": data, "layout": spec["layout"]}


def _as_list(values: Array) -> list[float | None]:
    return [float(f"{value:.6g}") if np.isfinite(value) else None for value in values]


def _levels(values: Array, rows: bytearray) -> dict[str, Any]:
    """Writes a row's levels to the end of `rows`, high bytes of the differences first; says where."""
    finite = np.isfinite(values)
    low, high = (float(np.min(values[finite])), float(np.max(values[finite]))) if finite.any() else (0.0, 0.0)
    step = (high - low) / _LEVELS or 1.0
    levels = np.full(values.size, _GAP, dtype=np.int64)
    levels[finite] = np.rint((values[finite] - low) / step).astype(np.int64)
    steps = np.diff(levels, prepend=0) % 65536
    place = {"at": len(rows), "n": int(values.size), "low": low, "step": step}
    rows += (steps // 256).astype(np.uint8).tobytes() + (steps % 256).astype(np.uint8).tobytes()
    return place
