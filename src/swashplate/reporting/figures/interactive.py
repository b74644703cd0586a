"""A report's figure as a plotly figure, to zoom and point at in a notebook: the same description, with a legend."""

from __future__ import annotations

from typing import Any

from swashplate.extras import library
from swashplate.reporting.figures.themes import checked, coloured, in_unit
from swashplate.reporting.structure import Figure, Key

_PLAIN_MARKERS = {"line": "line-ns-open"}


def interactive(figure: Figure, *, theme: str = "light", frequency: str = "Hz", title: str = "") -> Any:
    """The figure as a `plotly.graph_objects.Figure`.

    Args:
        figure: of a report. theme, frequency: as of `still.still`. title: above it.

    Raises:
        SwashError: a theme or a unit that there is not; plotly missing.
    """
    look = checked(theme)
    objects = library("plotly.graph_objects", what="drawing")
    spec = in_unit(figure.spec, frequency)
    layout = dict(spec["layout"]) | {"showlegend": bool(figure.keys)}
    margin = dict(layout.get("margin", {}))
    top = 34 * bool(title) + (14 + 20 * -(-len(figure.keys) // 5)) * bool(figure.keys)
    margin["t"] = margin.get("t", 8) + top
    layout |= {
        "margin": margin,
        "height": figure.height + top,
        "legend": {"orientation": "h", "yref": "container", "y": 1.0 - 34 * bool(title) / (figure.height + top),
                   "yanchor": "top", "x": 0.0},
    }  # fmt: skip
    if title:
        layout["title"] = {
            "text": title.replace("<", "‹"),
            "font": {"size": 14},
            "x": 0.01,
            "y": 0.99,
            "yanchor": "top",
        }
    traces = [{**trace, "showlegend": False} for trace in spec["data"]]
    traces += [_entry(key) for key in figure.keys]
    drawn = coloured({"data": traces, "layout": layout}, look)
    return objects.Figure(data=drawn["data"], layout=drawn["layout"], skip_invalid=False)


def _entry(key: Key) -> dict[str, Any]:
    """A trace without points, whose entry in the legend is the key."""
    entry: dict[str, Any] = {"type": "scatter", "x": [None], "y": [None], "name": key.words, "showlegend": True}
    if key.style in ("solid", "dash", "dot", "dashdot"):
        return entry | {"mode": "lines", "line": {"color": key.color, "dash": key.style, "width": 2}}
    symbol = "square" if key.style in ("band", "bar") else _PLAIN_MARKERS.get(key.style, key.style)
    return entry | {"mode": "markers", "marker": {"color": key.color, "symbol": symbol, "size": 11}}
