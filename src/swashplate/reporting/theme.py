"""Colours, line styles, layouts and thinned series that all figures share.

The colours are those of Okabe and Ito (2008), which the usual kinds of colour blindness can tell apart; line style or
marker says the same a second time.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swashplate.arrays import Array
from swashplate.flights.schema import channel

FigurePart = dict[str, Any]
"""A trace, a layout or an axis of a plotly figure, as JSON types."""

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILION, PURPLE, GREY = "#0072B2", "#D55E00", "#CC79A7", "#6B6B6B"

FLIGHT, MODEL, PUBLISHED, CONSTANT, HOLD = BLACK, BLUE, VERMILION, GREEN, GREY
BAND = "rgba(0,114,178,0.20)"

PREDICTOR_STYLE: dict[str, tuple[str, str, str]] = {
    "model": (MODEL, "solid", "circle"),
    "published card": (PUBLISHED, "dash", "square-open"),
    "constant rates": (CONSTANT, "dot", "x"),
    "hold": (HOLD, "dashdot", "line-ns-open"),
}
"""Colour, line and marker of each predictor."""

PREDICTOR_WORDS = {
    "model": "identified model",
    "published card": "published card",
    "constant rates": "constant rates",
    "hold": "hold the last value",
}

INPUT_COLORS = (ORANGE, PURPLE, SKY, GREEN)


def numbers(values: ArrayLike) -> list[float | None]:
    """A row of numbers as short JSON: six significant digits, gaps as null."""
    row = np.asarray(values, dtype=np.float64).ravel().tolist()
    return [float(f"{value:.6g}") if math.isfinite(value) else None for value in row]


_SMALL = 200
_FAR = 4096.0
"""Beyond this, single precision no longer resolves a millisecond."""


def packed(values: Iterable[float | None]) -> list[float | None] | dict[str, str]:
    """A long row of numbers in plotly's binary form (base64, little-endian; NaN are gaps), a short one as is."""
    row = np.asarray([np.nan if value is None else value for value in values], dtype=np.float64).ravel()
    if row.size <= _SMALL:
        return numbers(row)
    single = not np.any(np.abs(row[np.isfinite(row)]) > _FAR)
    data = row.astype("<f4" if single else "<f8").tobytes()
    return {"dtype": "f4" if single else "f8", "bdata": base64.b64encode(data).decode("ascii")}


def unit_words(unit: str) -> str:
    """A unit as people write it: "kg m^2" becomes "kg m²", a pure number has none."""
    if unit == "1":
        return ""
    for digits, small in (("^-1", "⁻¹"), ("^-2", "⁻²"), ("^2", "²"), ("^3", "³")):
        unit = unit.replace(digits, small)
    return unit


def shown(name: str, values: Array) -> Array:
    """Values of a channel in the unit that people expect on plots."""
    return np.asarray(values, dtype=np.float64) * channel(name).shown_factor


def quantity(name: str, unit: str) -> str:
    """Name and unit for an axis: a pure number ("1") says [-], and a unit that nobody knows is called unknown."""
    return f"{name} [{unit_words(unit) or '-'}]" if unit else f"{name} [unit unknown]"


def inputs_title(names: Sequence[str], units: Mapping[str, str] | None = None) -> str:
    """Title of the axis that several inputs share; inputs of several units keep their own."""
    shared = {(units or {}).get(name) or channel(name).unit for name in names}
    unit = shared.pop() if len(shared) == 1 else ""
    return quantity("input", unit) if unit else "input [own units]"


def axis_title(name: str) -> str:
    """Name and unit of a channel for an axis."""
    return quantity(name, channel(name).shown_unit)


def line(
    time: Iterable[float | None],
    values: Iterable[float | None],
    *,
    name: str,
    color: str,
    dash: str = "solid",
    width: float = 1.4,
    axis: str = "",
    hover: str = "",
    **more: Any,
) -> FigurePart:
    """A line trace on the subplot whose axes end in `axis` ("" for the first)."""
    trace: FigurePart = {
        "type": "scatter",
        "mode": "lines",
        "x": packed(time),
        "y": packed(values),
        "name": name,
        "line": {"color": color, "dash": dash, "width": width},
        "xaxis": f"x{axis}",
        "yaxis": f"y{axis}",
        "hovertemplate": (hover or f"{name}<br>%{{x:.2f}} s, %{{y:.4g}}") + "<extra></extra>",
    }
    return {**trace, **more}


def shade(x: Iterable[float | None], y: Iterable[float | None], *, name: str, color: str, axis: str = "") -> FigurePart:
    """A closed shape, filled, that answers no pointer."""
    edge = line(x, y, name=name, color=color, width=0, axis=axis)
    return {**edge, "fill": "toself", "fillcolor": color, "hoverinfo": "skip", "hovertemplate": None}


def dots(x: Iterable[float | None], y: Iterable[float | None], marker: FigurePart, **more: Any) -> FigurePart:
    """Markers instead of a line; `more` as of `line`."""
    return {**line(x, y, **{"color": marker.get("color", BLACK), **more}), "mode": "markers", "marker": marker}


def axis_number(i: int) -> str:
    """What the axes of panel i, from 0, end in."""
    return "" if i == 0 else str(i + 1)


def style(i: int) -> tuple[str, str]:
    """Colour and line style number i."""
    return _COLORS[i % len(_COLORS)], _DASHES[i % len(_DASHES)]


_COLORS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK, GREY)
_DASHES = ("solid", "dash", "dot", "dashdot")


def base_layout(height: int, *, left: int = 58, top: int = 8, right: int = 10, bottom: int = 40) -> FigurePart:
    """What every figure has: margins that leave a telephone some plot, no legend (keys stand in the page)."""
    return {
        "height": height,
        "autosize": True,
        "showlegend": False,
        "margin": {"l": left, "r": right, "t": top, "b": bottom},
        "font": {
            "family": "system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif",
            "size": 12,
            "color": "#222",
        },
        "paper_bgcolor": "#fff",
        "plot_bgcolor": "#fff",
        "hovermode": "closest",
    }


def axis(title: str = "", **more: Any) -> FigurePart:
    """One axis: light grid, thin frame."""
    defaults: FigurePart = {
        "gridcolor": "#e4e4e4",
        "zeroline": False,
        "linecolor": "#999",
        "showline": True,
        "mirror": True,
        "ticks": "outside",
        "ticklen": 3,
        "tickcolor": "#999",
        "automargin": False,
        "exponentformat": "e",
    }
    if title:
        defaults["title"] = {"text": title, "standoff": 4, "font": {"size": 12}}
    return {**defaults, **more}


def phase_ticks(values: ArrayLike) -> FigurePart:
    """What a phase axis [deg] has beside its title: marks at multiples of 5 degrees or more, few enough to be read."""
    finite = np.asarray(values, dtype=np.float64)
    finite = finite[np.isfinite(finite)]
    span = float(np.ptp(finite)) if finite.size else 200.0
    return {"tick0": 0, "dtick": next((step for step in (5, 15, 30, 45, 90, 180) if span <= 5 * step), 360)}


def bands(count: int, *, gap: float) -> list[tuple[float, float]]:
    """Domains from top to bottom that share the unit interval, `gap` apart."""
    size = (1.0 - gap * (count - 1)) / count
    return [(max(0.0, 1.0 - (i + 1) * size - i * gap), min(1.0, 1.0 - i * size - i * gap)) for i in range(count)]


def stacked(titles: Sequence[str], *, height: int, x_title: str = "time [s]") -> FigurePart:
    """A layout of panels one below the other that zoom in time together."""
    layout = base_layout(height * len(titles) + 48)
    for i, (title, domain) in enumerate(zip(titles, bands(len(titles), gap=0.1 / len(titles)), strict=True)):
        number = axis_number(i)
        last = i == len(titles) - 1
        layout[f"yaxis{number}"] = axis(title, domain=list(domain), anchor=f"x{number}", nticks=5)
        layout[f"xaxis{number}"] = axis(
            x_title if last else "", anchor=f"y{number}", matches=None if i == 0 else "x", showticklabels=last
        )
    return layout


def over_frequency(titles: Sequence[str], *, height: int = 170, unit: str = "rad/s") -> FigurePart:
    """A layout of panels over one logarithmic frequency axis, whose unit ("Hz" or "rad/s") a reader may change."""
    layout = stacked(titles, height=height, x_title=f"frequency [{unit}]")
    for k in range(len(titles)):
        layout[f"xaxis{'' if k == 0 else k + 1}"]["type"] = "log"
    return {**layout, "meta": {"frequency": unit}}


def grid(
    titles: Sequence[str], *, columns: int, height: int, x_title: str, y_title: str = "", gap: float = 0.12
) -> FigurePart:
    """A layout of small panels in rows, each under its own heading; on a narrow screen the page puts fewer in a row.

    Args:
        titles: headings, with the unit of what the panel shows. columns: in a row. height: of a panel [px].
        x_title, y_title: of the lowest panels and of those on the left; no `y_title` where the headings say it.
        gap: share of the width between two panels.
    """
    rows = -(-len(titles) // columns)
    layout = base_layout(height * rows + 56, left=58 if y_title else 44, top=24)
    down = bands(rows, gap=0.4 / rows)
    width = (1.0 - gap * (columns - 1)) / columns
    layout |= {
        "annotations": [],
        "meta": {"grid": {"panels": len(titles), "columns": columns, "height": height, "gap": gap}},
    }
    for i, title in enumerate(titles):
        number = axis_number(i)
        row, column = divmod(i, columns)
        left = column * (width + gap)
        lowest = i + columns >= len(titles)
        layout[f"xaxis{number}"] = axis(
            x_title if lowest else "", domain=[left, min(1.0, left + width)], anchor=f"y{number}", nticks=4, tickangle=0
        )
        left_title = y_title if column == 0 else ""
        layout[f"yaxis{number}"] = axis(left_title, domain=list(down[row]), anchor=f"x{number}", nticks=5)
        layout["annotations"].append(
            {
                "text": f"<b>{title}</b>",
                "xref": "paper",
                "yref": "paper",
                "x": left,
                "y": down[row][1],
                "xanchor": "left",
                "yanchor": "bottom",
                "showarrow": False,
                "font": {"size": 12},
            }
        )
    return layout


MAX_POINTS = 1500
"""Points that one line of a page may have: a least and a greatest for each column of a screen's plot, or nearly."""


def kept(values: Array, *, limit: int = MAX_POINTS) -> NDArray[np.int64]:
    """Indices of at most `limit` samples: the least and the greatest of every stretch, and both ends.

    A line through them looks the same at any width of fewer than limit / 2 pixels.

    Args:
        values: shape (n,); NaN mark gaps and stay.
        limit: at least 4.
    """
    n = values.size
    if n <= limit:
        return np.arange(n, dtype=np.int64)
    gaps = np.flatnonzero(~np.isfinite(values))
    stretches = max(1, (limit - 2 - gaps.size) // 2)
    width = -(-n // stretches)
    padded = np.full(width * -(-n // width), np.nan)
    padded[:n] = values
    rows = padded.reshape(-1, width)
    finite = np.isfinite(rows)
    lowest = np.where(finite, rows, np.inf).argmin(axis=1)
    highest = np.where(finite, rows, -np.inf).argmax(axis=1)
    first = np.arange(rows.shape[0]) * width
    drawn = finite.any(axis=1)
    return np.unique(np.concatenate([[0, n - 1], gaps, (first + lowest)[drawn], (first + highest)[drawn]])).astype(
        np.int64
    )


def joined(pieces: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Time and values of several pieces in one row, with a gap (NaN) between them so that no line bridges it."""
    times: list[Array] = []
    values: list[Array] = []
    for time, row in pieces:
        if times:
            middle = 0.5 * (times[-1][-1] + time[0])
            times.append(np.array([middle]))
            values.append(np.array([np.nan]))
        times.append(np.asarray(time, dtype=np.float64))
        values.append(np.asarray(row, dtype=np.float64))
    return np.concatenate(times), np.concatenate(values)
