"""Three looks of one figure: for paper, for a light screen, for a dark one. A figure's colours are replaced by name."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from typing import Any, Literal, get_args

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import SwashError
from swashplate.reporting.structure import Spec
from swashplate.reporting.theme import BAND, BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION

Theme = Literal["paper", "light", "dark"]
Frequency = Literal["Hz", "rad/s"]
Row = Sequence[Any] | Mapping[str, str]
"""Numbers of a trace: a list (None is a gap) or plotly's binary form; names where the axis has categories."""

DARK: Mapping[str, str] = {
    BLACK: "#e6e6e6",
    BLUE: "#4ba3e3",
    VERMILION: "#ff8a4c",
    GREEN: "#2fc79a",
    ORANGE: "#f0b429",
    PURPLE: "#e39bc6",
    SKY: "#7cc7f2",
    GREY: "#9aa0a6",
    BAND: "rgba(75,163,227,0.28)",
    "rgba(0,114,178,0.18)": "rgba(75,163,227,0.26)",
    "rgba(0,0,0,0.15)": "rgba(255,255,255,0.20)",
    "#fff": "#15191e",
    "#FFFFFF": "#2b3138",
    "#222": "#dcdcdc",
    "#333": "#c4c4c4",
    "#444": "#b4b4b4",
    "#999": "#7a828a",
    "#bbb": "#5a626a",
    "#e4e4e4": "#2e353d",
}
"""What stands for each colour of a light figure on a dark ground; colours that are not named stay."""

_HERTZ = 2.0 * np.pi


def checked(theme: str) -> Theme:
    """A theme's name, refused where it is none.

    Raises:
        SwashError: naming the themes.
    """
    if theme not in get_args(Theme):
        raise SwashError(f"is '{theme}', expected one of {', '.join(get_args(Theme))}.", channel="theme")
    return theme  # pyrefly: ignore[bad-return]


def coloured(value: Any, theme: Theme) -> Any:
    """A figure's description, or a part of it, in the colours of a theme."""
    if theme != "dark":
        return value
    if isinstance(value, str):
        return DARK.get(value, value)
    if isinstance(value, Mapping):
        return {
            key: entry if key in ("x", "y", "z", "text") else coloured(entry, theme) for key, entry in value.items()
        }
    if isinstance(value, list | tuple):
        return [coloured(entry, theme) for entry in value]
    return value


def unpacked(row: Row) -> Array:
    """Numbers of a trace, whether they are a list (None is a gap) or in plotly's binary form."""
    if isinstance(row, Mapping):
        return np.frombuffer(base64.b64decode(row["bdata"]), dtype=f"<{row['dtype']}").astype(np.float64)
    return np.array([np.nan if value is None else value for value in row], dtype=np.float64)


def in_unit(spec: Spec, frequency: str) -> Spec:
    """A figure over frequency with its axis in another unit; other figures stay as they are.

    A figure over frequency says in `layout.meta.frequency` which unit its x values have, "Hz" or "rad/s".

    Raises:
        SwashError: a unit that is neither.
    """
    if frequency not in get_args(Frequency):
        raise SwashError(f"is '{frequency}', expected Hz or rad/s.", channel="frequency")
    unit_of_figure = spec["layout"].get("meta", {}).get("frequency")
    if unit_of_figure is None or unit_of_figure == frequency:
        return spec
    factor = _HERTZ if frequency == "rad/s" else 1.0 / _HERTZ

    def swapped(value: Any) -> Any:
        if isinstance(value, str):
            return value.replace(unit_of_figure, frequency)
        if isinstance(value, Mapping):
            return {key: swapped(entry) for key, entry in value.items()}
        return [swapped(entry) for entry in value] if isinstance(value, list | tuple) else value

    data = []
    for trace in spec["data"]:
        turned = {"x": (factor * unpacked(trace["x"])).tolist()}
        if "hovertemplate" in trace:
            turned["hovertemplate"] = swapped(trace["hovertemplate"])
        data.append({**trace, **turned})
    layout = dict(spec["layout"]) | {"meta": {"frequency": frequency}}
    for key, entry in spec["layout"].items():
        if not key.startswith("xaxis"):
            continue
        changes = {"title": swapped(entry["title"])} if "title" in entry else {}
        if "range" in entry and entry.get("type") == "log":
            changes["range"] = [float(end + np.log10(factor)) for end in entry["range"]]
        layout[key] = {**entry, **changes}
    return {"data": data, "layout": layout}
