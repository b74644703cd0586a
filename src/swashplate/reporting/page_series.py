"""The series over time that a report's page draws, as a flight: measured, fitted, predicted, simulated.

They are what the page holds: thinned out to what a screen shows, and kept to a tenth of a pixel (`packing`). Bands and
figures over anything but time are left out.
"""

from __future__ import annotations

import re
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import ExportError
from swashplate.files import read_text
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.reporting.packing import read_figures

_FIGURES = re.compile(r'id="figures-gzip">([^<]*)<')
_TITLE = re.compile(r"(.*?)\s*\[([^\]]*)\]$")
_TIME = "time [s]"
_LARGEST = 256 << 20  # bytes of a page


def page_series(path: str | Path) -> Flight:
    """Every line over time of a page that `swash` wrote, one stream a line.

    Args:
        path: of the page (.html).

    Raises:
        ExportError: where the page is none of ours, is damaged, or draws nothing over time.
    """
    page = Path(path)
    try:
        match = _FIGURES.search(read_text(page, most=_LARGEST))
    except (OSError, ValueError) as error:
        raise ExportError(f"cannot be read: {error}.", where=page) from error
    if match is None:
        raise ExportError("is no report of swashplate.", where=page, hint="Name a report.html, or a flight.")
    try:
        specs = read_figures(match[1])
        lines = {name: line for spec in specs for name, line in _lines(spec)}
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError, zlib.error) as error:
        raise ExportError(f"its figures cannot be read: {error}.", where=page, hint="Write it again.") from error
    if not lines:
        raise ExportError("draws nothing over time.", where=page)
    streams = {}
    for name, (time, values, unit) in lines.items():
        called = re.sub(r"\W+", "_", name)
        streams[name] = stream(time, {called: values}, {called: unit})
    note = "series of a report's page: thinned out to what a screen shows, kept to a tenth of a pixel"
    return Flight(streams, Provenance(source=page.name, notes=(note,)))


def _lines(spec: dict[str, Any]) -> list[tuple[str, tuple[Array, Array, str]]]:
    layout, series = spec["layout"], []
    if not any(_title(axis) == _TIME for name, axis in layout.items() if name.startswith("xaxis")):
        return []
    for trace in spec["data"]:
        if "lines" not in str(trace.get("mode")) or trace.get("fill") == "toself" or not trace.get("name"):
            continue
        time, values = (np.array([np.nan if v is None else v for v in trace[side]], dtype=np.float64) for side in "xy")
        matched = _TITLE.match(_title(layout.get(str(trace["yaxis"]).replace("y", "yaxis", 1), {})))
        quantity, unit = (matched[1], matched[2]) if matched else ("", "")
        name = str(trace["name"])
        label = name if not quantity or quantity in name else f"{quantity} {name}"
        there = np.isfinite(time)
        time, values = time[there], values[there]
        cuts = np.flatnonzero(np.diff(time) <= 0.0) + 1  # each prediction of several begins before the last one ends
        pieces = list(zip(np.split(time, cuts), np.split(values, cuts), strict=True))
        for number, (stamps, numbers) in enumerate(pieces, start=1):
            called = re.sub(r"[^\w]+", "_", label).strip("_") + (f"_{number}" if len(pieces) > 1 else "")
            if stamps.size > 1:
                series.append((f"{spec['name']}/{called}", (stamps, numbers, "1" if unit == "-" else unit)))
    return series


def _title(axis: Any) -> str:
    title = axis.get("title") or ""
    return str(title.get("text") or "" if isinstance(title, dict) else title)
