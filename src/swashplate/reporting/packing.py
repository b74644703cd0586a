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
import zlib
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
LARGEST = 256 << 20
"""Bytes that a page's figures may unpack to."""


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


def read_figures(text: str) -> list[dict[str, Any]]:
    """What `figures_text` wrote, each with its rows as lists (None is a gap): what the page's script does.

    Raises:
        ValueError: where it unpacks to more than `LARGEST`; and whatever damaged text leads to.
    """
    machine = zlib.decompressobj(wbits=zlib.MAX_WBITS | 16)  # with gzip's header
    unpacked = machine.decompress(base64.b64decode(text), LARGEST)
    if not machine.eof:
        raise ValueError(f"they are cut off, or unpack to more than {LARGEST:,} bytes")
    size = int.from_bytes(unpacked[:4], "little")
    rows = unpacked[4 + size :]
    specs: list[dict[str, Any]] = json.loads(unpacked[4 : 4 + size])
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
