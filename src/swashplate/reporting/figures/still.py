"""A report's figure as a matplotlib figure: for papers and notebooks, in vectors, without pyplot's global state.

There is one description of what is drawn, the one that the report hands to plotly (`structure.Figure.spec`); this draws
the same description. Known are lines, markers, filled shapes, bars, pictures of matrices, and texts.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from swashplate.arrays import Array
from swashplate.extras import library
from swashplate.reporting.figures.themes import Row, Theme, checked, coloured, in_unit, unpacked
from swashplate.reporting.structure import Figure, Key, Spec

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Still
    from matplotlib.figure import SubFigure

_PX = 1.0 / 100.0
"""Inches of a report's pixel in height."""
_WIDTH = {"paper": 7.0, "light": 8.4, "dark": 8.4}
_SIZES = {"paper": 8.0, "light": 9.5, "dark": 9.5}
_DASHES = {"solid": "-", "dash": (0, (5, 2.5)), "dot": (0, (1.2, 1.8)), "dashdot": (0, (6, 2, 1.2, 2))}
_MARKERS = {
    "circle": ("o", True),
    "diamond": ("D", True),
    "square-open": ("s", False),
    "x": ("x", True),
    "line-ns-open": ("|", True),
    "line": ("|", True),
    "triangle-left-open": ("<", False),
}
_TAG = re.compile(r"</?[a-z]+>")


def still(figures: Sequence[Figure], *, theme: str = "paper", frequency: str = "Hz", title: str = "") -> Still:
    """Figures one below the other as one matplotlib figure; `savefig` writes it as PDF, SVG or PNG.

    Args:
        figures: of a report.
        theme: "paper" (small type, no title), "light" or "dark".
        frequency: unit of axes of frequency, "Hz" or "rad/s".
        title: above all of it; not on paper, where the caption says it.

    Raises:
        SwashError: a theme or a unit that there is not.
    """
    look = checked(theme)
    mpl, made_by = library("matplotlib", what="drawing"), library("matplotlib.figure", what="drawing")
    ink, ground = ("#dcdcdc", "#15191e") if look == "dark" else ("#111111", "#ffffff")
    size = _SIZES[look]
    style = {
        "font.size": size,
        "axes.labelsize": size,
        "axes.titlesize": size,
        "xtick.labelsize": size - 0.5,
        "ytick.labelsize": size - 0.5,
        "legend.fontsize": size - 0.5,
        "text.color": ink,
        "axes.labelcolor": ink,
        "axes.edgecolor": ink,
        "xtick.color": ink,
        "ytick.color": ink,
        "axes.facecolor": ground,
        "axes.linewidth": 0.7,
        "grid.color": "#2e353d" if look == "dark" else "#e0e0e0",
        "grid.linewidth": 0.6,
        "axes.unicode_minus": True,
    }
    shares = [_PX * figure.height for figure in figures]
    legends = [
        0.2 * -(-len(figure.keys) // _across(len(figure.keys))) + 0.1 if figure.keys else 0.0 for figure in figures
    ]
    scale = 0.9 if look == "paper" else 1.0
    width = max(_WIDTH[look], *(_PX * figure.min_width * scale for figure in figures)) if figures else _WIDTH[look]
    with mpl.rc_context(style):
        drawing: Still = made_by.Figure(
            figsize=(width, scale * sum(shares) + sum(legends)), layout="constrained", facecolor=ground
        )
        heights = np.add(shares, legends)
        apart = len(shares) > 1 or (bool(title) and look != "paper")  # a title and a legend share no place
        parts: Sequence[Still | SubFigure] = (drawing,)
        if apart:
            parts = list(drawing.subfigures(len(figures), 1, squeeze=False, height_ratios=heights)[:, 0])
        for part, figure in zip(parts, figures, strict=True):
            part.set_facecolor(ground)
            _Sheet(part, coloured(in_unit(figure.spec, frequency), look), look).draw(figure.keys)
        if title and look != "paper":
            drawing.suptitle(title, fontsize=size + 2, x=0.01, ha="left")
    return drawing


class _Sheet:
    """One figure on its part of the page."""

    def __init__(self, part: Still | SubFigure, spec: Spec, theme: Theme) -> None:
        self.part, self.spec, self.theme = part, spec, theme
        self.layout: Spec = spec["layout"]
        self.panels: dict[str, Axes] = {}

    def draw(self, keys: Sequence[Key]) -> None:
        self._make_panels()
        for trace in self.spec["data"]:
            panel = self.panels[trace.get("yaxis", "y")[1:]]
            {"bar": self._bars, "heatmap": self._matrix}.get(trace["type"], self._scatter)(panel, trace)
        for number, panel in self.panels.items():
            self._axis(panel, "x", self.layout.get(f"xaxis{number}", {}))
            self._axis(panel, "y", self.layout.get(f"yaxis{number}", {}))
        self._texts()
        for shape in self.layout.get("shapes", ()):
            if shape.get("x0") == shape.get("x1"):
                self.panels[""].axvline(shape["x0"], color=shape["line"]["color"], lw=0.8)
        if keys:
            handles = [_handle(key, self.theme) for key in keys]
            self.part.legend(handles=handles, loc="outside upper left", ncols=_across(len(keys)), frameon=False)

    def _make_panels(self) -> None:
        """Panels in the rows and columns that their domains span."""
        numbers = list(dict.fromkeys(trace.get("yaxis", "y")[1:] for trace in self.spec["data"]))
        numbers += [key[5:] for key in self.layout if key.startswith("yaxis") and key[5:] not in numbers]
        numbers = sorted(dict.fromkeys(numbers), key=lambda n: int(n or 1))
        lefts = {n: round(self.layout.get(f"xaxis{n}", {}).get("domain", (0.0, 1.0))[0], 4) for n in numbers}
        tops = {n: round(self.layout.get(f"yaxis{n}", {}).get("domain", (0.0, 1.0))[1], 4) for n in numbers}
        columns, rows = sorted(set(lefts.values())), sorted(set(tops.values()), reverse=True)
        heights = []
        for top in rows:
            n = next(number for number in numbers if tops[number] == top)
            low, high = self.layout.get(f"yaxis{n}", {}).get("domain", (0.0, 1.0))
            heights.append(max(high - low, 0.05))
        lattice = self.part.add_gridspec(len(rows), len(columns), height_ratios=heights)
        for n in numbers:
            leader = self.layout.get(f"xaxis{n}", {}).get("matches")
            shared = self.panels.get(leader[1:]) if leader else None
            place = lattice[rows.index(tops[n]), columns.index(lefts[n])]
            self.panels[n] = self.part.add_subplot(place, sharex=shared)

    # ---- what is drawn -----------------------------------------------------------------------------------------
    def _scatter(self, panel: Axes, trace: Spec) -> None:
        x, y = (_values(trace[side], self._categories(side, trace)) for side in "xy")
        if trace.get("fill") == "toself":
            _fill(panel, x, y, trace)
            return
        mode, pen, marker = trace.get("mode", "lines"), trace.get("line", {}), trace.get("marker", {})
        if "lines" in mode and pen.get("width", 1.4) > 0:
            color = _rgba(pen.get("color"))
            width = 0.75 * pen.get("width", 1.4)
            panel.plot(x, y, color=color, ls=_DASHES[pen.get("dash", "solid")], lw=width, solid_joinstyle="round")
        if "markers" in mode:
            if isinstance(marker.get("color"), list | Mapping):
                self._by_colour(panel, x, y, marker)
                return
            color = _rgba(marker.get("color", pen.get("color")))
            symbols = marker.get("symbol", "circle")
            each = [symbols] * x.size if isinstance(symbols, str) else list(symbols)
            for symbol in dict.fromkeys(each):
                here = np.array([one == symbol for one in each])
                shape, full = _MARKERS.get(symbol, ("o", True))
                area = (0.75 * marker.get("size", 6)) ** 2
                fill = (
                    {"c": [color]}
                    if shape in "x|"
                    else {"facecolors": [color] if full else "none", "edgecolors": [color]}
                )
                panel.scatter(x[here], y[here], s=area, marker=shape, linewidths=1.2, zorder=3, clip_on=False, **fill)

    def _by_colour(self, panel: Axes, x: Array, y: Array, marker: Spec) -> None:
        """Markers whose colour is a number."""
        area, scale = (0.75 * marker.get("size", 6)) ** 2, str(marker.get("colorscale", "Viridis")).lower()
        drawn = panel.scatter(x, y, c=unpacked(marker["color"]), s=area, cmap=scale, zorder=3)
        label = _without_markup(marker.get("colorbar", {}).get("title", {}).get("text", ""))
        self.part.colorbar(drawn, ax=panel, label=label, fraction=0.05, pad=0.02)

    def _bars(self, panel: Axes, trace: Spec) -> None:
        x, y = unpacked(trace["x"]), unpacked(trace["y"])
        step = float(np.median(np.diff(x))) if x.size > 1 else 1.0
        marker = trace.get("marker", {})
        width = step * (1.0 - self.layout.get("bargap", 0.2))
        panel.bar(x, y, width=width, color=_rgba(marker.get("color")), alpha=marker.get("opacity", 1.0))

    def _matrix(self, panel: Axes, trace: Spec) -> None:
        from matplotlib.colors import LinearSegmentedColormap

        scale = trace.get("colorscale")
        colors = "viridis" if scale is None or isinstance(scale, str) else LinearSegmentedColormap.from_list(
            "given", [(place, _rgba(color)) for place, color in scale]
        )  # fmt: skip
        z = np.array([unpacked(row) for row in trace["z"]])
        limits = {"vmin": trace.get("zmin"), "vmax": trace.get("zmax")}
        if all(isinstance(name, str) for name in trace["x"]):
            drawn = panel.imshow(z, cmap=colors, aspect="auto", **limits)
            panel.set_xticks(range(len(trace["x"])), trace["x"], rotation=60, ha="right", rotation_mode="anchor")
            panel.set_yticks(range(len(trace["y"])), trace["y"])
            panel.tick_params(length=0)
            if trace.get("texttemplate"):
                dark_cell = np.abs(z) > 0.7 * max(abs(trace.get("zmax", 1.0)), 1e-12)
                for i, j in np.ndindex(z.shape):
                    ink = "#ffffff" if dark_cell[i, j] else "#111111"
                    panel.text(j, i, trace["text"][i][j], ha="center", va="center", fontsize=6.5, color=ink)
        else:
            x, y = unpacked(trace["x"]), unpacked(trace["y"])
            drawn = panel.pcolormesh(x, y, z, cmap=colors, shading="nearest", rasterized=True, **limits)
        bar = trace.get("colorbar", {})
        label = _without_markup(bar.get("title", {}).get("text", ""))
        self.part.colorbar(drawn, ax=panel, label=label, ticks=bar.get("tickvals"), fraction=0.05, pad=0.02)

    # ---- around it ---------------------------------------------------------------------------------------------
    def _categories(self, side: str, trace: Spec) -> Sequence[str] | None:
        axis = self.layout.get(f"{side}axis{trace.get(f'{side}axis', side)[1:]}", {})
        names: Sequence[str] | None = axis.get("categoryarray")
        return names

    def _axis(self, panel: Axes, side: str, axis: Spec) -> None:
        from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, MultipleLocator, NullFormatter

        its = panel.xaxis if side == "x" else panel.yaxis
        pictured = bool(panel.images)
        log = axis.get("type") == "log"
        if log:
            (panel.set_xscale if side == "x" else panel.set_yscale)("log")
            low, high = sorted(panel.get_xlim() if side == "x" else panel.get_ylim())
            if side == "x" and high < 1e4 * low:  # within four decades: 0.2 0.5 1 2 5, as people read them
                its.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 300.0 * low else (1.0,)))
                its.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            its.set_minor_formatter(NullFormatter())
        elif "tickvals" in axis:
            its.set_ticks(axis["tickvals"], labels=axis.get("ticktext"))
        elif "dtick" in axis:
            its.set_major_locator(MultipleLocator(axis["dtick"], offset=axis.get("tick0", 0)))
        elif "categoryarray" in axis:
            its.set_ticks(range(len(axis["categoryarray"])), labels=axis["categoryarray"])
        elif not pictured:
            its.set_major_locator(MaxNLocator(nbins=axis.get("nticks", 6), steps=[1, 2, 2.5, 5, 10]))
        label = _without_markup(axis.get("title", {}).get("text", ""))
        if label:
            (panel.set_xlabel if side == "x" else panel.set_ylabel)(label)
        if axis.get("showticklabels") is False:
            panel.tick_params(**{f"label{'bottom' if side == 'x' else 'left'}": False})
        ends = axis.get("range")
        if ends is not None:
            low, high = (10.0**end for end in ends) if log else ends
            (panel.set_xlim if side == "x" else panel.set_ylim)(low, high)
        elif side == "x" and not pictured:
            panel.margins(x=0.01)
        if axis.get("zeroline"):
            (panel.axvline if side == "x" else panel.axhline)(0.0, color=axis.get("zerolinecolor", "#444"), lw=0.8)
        if not pictured and side == "y":
            panel.grid(True, zorder=0)
            panel.set_axisbelow(True)
            for edge in ("top", "right"):
                panel.spines[edge].set_visible(False)

    def _texts(self) -> None:
        """Headings of panels, and what is written within them."""
        for note in self.layout.get("annotations", ()):
            text = _without_markup(note["text"])
            if note.get("xref") == "paper":
                panel = self._below(note["x"], note["y"])
                if panel is not None:
                    panel.set_title(text, loc="left", fontweight="bold")
                continue
            panel = self.panels[str(note.get("yref", "y")).split(" ")[0][1:]]
            if str(note.get("xref", "")).endswith(" domain"):
                ink = note["font"].get("color")
                where = {"transform": panel.transAxes, "ha": "left", "va": "top", "fontsize": "small", "color": ink}
                panel.text(note["x"], note["y"], text, **where)
                continue
            panel.text(note["x"], note["y"], text, ha="center", va="center", fontsize=7)

    def _below(self, x: float, y: float) -> Axes | None:
        """The panel whose upper left corner is there."""
        for number, panel in self.panels.items():
            left = self.layout.get(f"xaxis{number}", {}).get("domain", (0.0, 1.0))[0]
            top = self.layout.get(f"yaxis{number}", {}).get("domain", (0.0, 1.0))[1]
            if abs(left - x) < 1e-3 and abs(top - y) < 1e-3:
                return panel
        return None


def _across(count: int) -> int:
    """Columns of a legend."""
    return count if count <= 4 else -(-count // (-(-count // 4)))


def _without_markup(text: str) -> str:
    return _TAG.sub("", text.replace("<br>", " ")).replace("$", r"\$")


def _rgba(color: str | None) -> str | tuple[float, ...] | None:
    """matplotlib's form of a colour; plotly writes a translucent one as rgba(r,g,b,a)."""
    if color is None or not color.startswith("rgb"):
        return color
    parts = [float(part) for part in color[color.index("(") + 1 : -1].split(",")]
    return (*(part / 255.0 for part in parts[:3]), *(parts[3:] or [1.0]))


def _values(row: Row, categories: Sequence[str] | None) -> Array:
    """A trace's numbers; names become places along their axis."""
    if not isinstance(row, Mapping) and len(row) and isinstance(row[0], str):
        order = list(categories or dict.fromkeys(row))
        return np.array([order.index(name) for name in row], dtype=np.float64)
    return unpacked(row)


def _fill(panel: Axes, x: Array, y: Array, trace: Spec) -> None:
    """Closed shapes, parted by gaps."""
    cuts = np.flatnonzero(~(np.isfinite(x) & np.isfinite(y)))
    color = _rgba(trace.get("fillcolor"))
    for part in np.split(np.arange(x.size), cuts):
        inside = part[np.isfinite(x[part]) & np.isfinite(y[part])]
        if inside.size > 2:
            panel.fill(x[inside], y[inside], facecolor=color, lw=0, zorder=1)
    pen = trace.get("line", {})
    if pen.get("width", 0) > 0:
        panel.plot(x, y, color=_rgba(pen.get("color")), lw=0.75 * pen["width"])


def _handle(key: Key, theme: Theme) -> Artist:
    """An entry of the legend."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    color = _rgba(coloured(key.color, theme))
    if key.style in ("band", "bar"):
        return Patch(facecolor=color, label=key.words)
    if key.style in _MARKERS:
        shape, full = _MARKERS[key.style]
        face = color if full else "none"
        return Line2D([], [], ls="", marker=shape, color=color, markerfacecolor=face, label=key.words, markersize=5)
    return Line2D([], [], color=color, ls=_DASHES[key.style], lw=1.3, label=key.words)
