"""What an object shows of itself: a title, words, figures and a table; and the verbs behind its methods.

The figures are those of its report. `plot` draws one with matplotlib, `explore` with plotly, `html_of` shows all of it
in a notebook.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from swashplate.control.analysis.ardupilot_gains import Suggestion
from swashplate.errors import SwashError
from swashplate.flights.flight import Flight
from swashplate.identification.core.result import Result
from swashplate.identification.responses.frequency_response import TWO_PI, FrequencyResponse
from swashplate.registry import nearest
from swashplate.reporting.figures import bode_matrix
from swashplate.reporting.figures.sections import own_section
from swashplate.reporting.figures.still import still
from swashplate.reporting.figures.themes import Frequency, Theme
from swashplate.reporting.report import structure_of
from swashplate.reporting.sections_responses import gains_section
from swashplate.reporting.structure import Figure, Report, Section, Text, tabulate
from swashplate.reporting.theme import FigurePart
from swashplate.shown import Shown
from swashplate.validation.validation import Validation

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Still
    from plotly.graph_objects import Figure as Drawn


from swashplate.extras import library
from swashplate.reporting.figures.themes import checked, coloured, in_unit
from swashplate.reporting.structure import Key

_PLAIN_MARKERS = {"line": "line-ns-open"}


def interactive(figure: Figure, *, theme: str = "light", frequency: str = "Hz", title: str = "") -> Drawn:
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


def _entry(key: Key) -> FigurePart:
    """A trace without points, whose entry in the legend is the key."""
    entry: FigurePart = {"type": "scatter", "x": [None], "y": [None], "name": key.words, "showlegend": True}
    if key.style in ("solid", "dash", "dot", "dashdot"):
        return entry | {"mode": "lines", "line": {"color": key.color, "dash": key.style, "width": 2}}
    symbol = "square" if key.style in ("band", "bar") else _PLAIN_MARKERS.get(key.style, key.style)
    return entry | {"mode": "markers", "marker": {"color": key.color, "symbol": symbol, "size": 11}}


def section_of(shown: Shown, **choice: Any) -> Section:
    """What an object shows; the first figure is the main one.

    Raises:
        SwashError: an object that shows nothing.
    """
    if (section := own_section(shown, **choice)) is not None:
        return section
    return _of_report(structure_of(shown, modes={}) if _has_modes(shown) else structure_of(shown), shown)


def section_of_gains(suggestion: Suggestion) -> Section:
    """One loop's gains, as in a report."""
    return gains_section([suggestion])


def _has_modes(shown: Shown) -> bool:
    """Whether its report would look for modes at hover, which a figure does not wait for."""
    return isinstance(shown, Validation) or (isinstance(shown, Result) and hasattr(shown.solution, "card"))


def _of_report(page: Report, shown: Shown) -> Section:
    """The figures of an object's report, and its words."""
    banners = tuple(Text(text, tone=tone) for tone, text in page.banners)
    picture = (page.picture,) if page.picture else ()
    rest = tuple(block for section in page.sections for block in section.blocks if isinstance(block, Figure))
    if isinstance(shown, Result) and shown.targets:
        rest = tuple(sorted(rest, key=lambda figure: figure.identifier != "fitted-responses"))
    if isinstance(shown, Result):
        warnings = (*shown.problems, *shown.warnings)
        columns = [(head, cells) for head, cells in shown.columns() if any(cells)]
        rows = zip(*(cells for _, cells in columns), strict=True)
        estimates = tabulate("Estimates", tuple(head for head, _ in columns), rows)
        title = f"{shown.name} by {shown.method}: {shown.state}"
        return Section(
            "result", title, (*(Text(text, tone="caution") for text in warnings), *picture, *rest, estimates)
        )
    summary = tabulate("Summary", ("", ""), tuple((label, text) for label, text, _ in page.summary))
    return Section("shown", page.title, (*banners, *picture, *rest, summary))


def section_of_responses(responses: FrequencyResponse, *, pairs: Sequence[tuple[str, str]] | None = None) -> Section:
    """Coherent bands of every pair, and Bode plots of those that have one."""
    rows = []
    for output in responses.outputs:
        for name in responses.inputs:
            band = responses.band(output, name)
            ends = "none" if band is None else f"{band[0] / TWO_PI:.3g} - {band[1] / TWO_PI:.3g}"
            rows.append((f"{output} / {name}", ends))
    warnings = tuple(Text(text, tone="caution") for text in (*responses.problems, *responses.warnings))
    table = tabulate("Where they may be used", ("output / input", "coherent band [Hz]"), rows)
    title = f"Frequency responses ({responses.method}): {responses.omega.size} lines"
    return Section("responses", title, (*warnings, bode_matrix.of_responses(responses, pairs), table))


# ---- the verbs behind the methods ------------------------------------------------------------------------------
def figures_of(shown: Shown, **choice: Any) -> dict[str, Figure]:
    """The figures that an object has, by name, the main one first."""
    return {block.identifier: block for block in section_of(shown, **choice).blocks if isinstance(block, Figure)}


def figure_names(shown: Shown) -> tuple[str, ...]:
    """Names of the figures that an object has, the main one first."""
    return tuple(figures_of(shown))


def _chosen(shown: Shown, name: str | None, **choice: Any) -> Figure:
    """A figure by its name, the main one where None.

    Raises:
        SwashError: a name that it has not, or an object without figures.
    """
    figures = figures_of(shown, **choice)
    if not figures:
        raise SwashError("has nothing to draw.", channel=type(shown).__name__)
    if name is None:
        return next(iter(figures.values()))
    if name not in figures:
        raise SwashError(
            f"is no figure of it; there are {', '.join(figures)}.",
            channel=name,
            hint=nearest(name, figures) or None,
        )
    return figures[name]


def _title(shown: Shown) -> str:
    name = shown.provenance.source if isinstance(shown, Flight) else section_of(shown).title
    return str(name)


def plot(
    shown: Shown, figure: str | None = None, *, theme: Theme = "paper", frequency: Frequency = "Hz", **choice: Any
) -> Still:
    """One figure of an object, with matplotlib; see `swashplate.shown.Shown.plot`."""
    title = "" if theme == "paper" and not isinstance(shown, Flight) else _title(shown)
    return still([_chosen(shown, figure, **choice)], theme=theme, frequency=frequency, title=title)


def explore(
    shown: Shown, figure: str | None = None, *, theme: Theme = "light", frequency: Frequency = "Hz", **choice: Any
) -> Drawn:
    """One figure of an object, with plotly; see `swashplate.shown.Shown.explore`."""
    return interactive(_chosen(shown, figure, **choice), theme=theme, frequency=frequency, title=_title(shown))
