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
from swashplate.reporting.figures.interactive import interactive
from swashplate.reporting.figures.of_flight import over_time
from swashplate.reporting.figures.sections import own_section
from swashplate.reporting.figures.still import still
from swashplate.reporting.figures.themes import Frequency, Theme
from swashplate.reporting.report import structure_of
from swashplate.reporting.sections_responses import gains_section
from swashplate.reporting.structure import Figure, Report, Section, Text, tabulate
from swashplate.validation.validation import Validation

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Still

    from swashplate.simulation.derivatives_over_speed import Derivatives


def section_of(shown: Any) -> Section:
    """What an object shows; the first figure is the main one.

    Raises:
        SwashError: an object that shows nothing.
    """
    if (section := own_section(shown)) is not None:
        return section
    return _of_report(structure_of(shown, modes={}) if _has_modes(shown) else structure_of(shown), shown)


def section_of_gains(suggestion: Suggestion) -> Section:
    """One loop's gains, as in a report."""
    return gains_section([suggestion])


def _has_modes(shown: Any) -> bool:
    """Whether its report would look for modes at hover, which a figure does not wait for."""
    return isinstance(shown, Validation) or (isinstance(shown, Result) and hasattr(shown.solution, "card"))


def _of_report(page: Report, shown: Any) -> Section:
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


def section_of_responses(responses: FrequencyResponse) -> Section:
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
    return Section("responses", title, (*warnings, bode_matrix.of_responses(responses), table))


# ---- the verbs behind the methods ------------------------------------------------------------------------------
def figures_of(shown: Any) -> dict[str, Figure]:
    """The figures that an object has, by name, the main one first."""
    return {block.identifier: block for block in section_of(shown).blocks if isinstance(block, Figure)}


def figure_names(shown: Any) -> tuple[str, ...]:
    """Names of the figures that an object has, the main one first."""
    return tuple(figures_of(shown))


def _chosen(shown: Any, name: str | None) -> Figure:
    """A figure by its name, the main one where None.

    Raises:
        SwashError: a name that it has not, or an object without figures.
    """
    figures = figures_of(shown)
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


def _title(shown: Any) -> str:
    name = shown.provenance.source if isinstance(shown, Flight) else section_of(shown).title
    return str(name)


def plot(shown: Any, figure: str | None = None, *, theme: Theme = "paper", frequency: Frequency = "Hz") -> Still:
    """One figure of an object, with matplotlib; see `swashplate.shown.Shown.plot`."""
    return still(
        [_chosen(shown, figure)], theme=theme, frequency=frequency, title="" if theme == "paper" else _title(shown)
    )


def explore(shown: Any, figure: str | None = None, *, theme: Theme = "light", frequency: Frequency = "Hz") -> Any:
    """One figure of an object, with plotly; see `swashplate.shown.Shown.explore`."""
    return interactive(_chosen(shown, figure), theme=theme, frequency=frequency, title=_title(shown))


def plot_flight(flight: Flight, *, channels: Sequence[str] | None = None, theme: Theme = "paper") -> Still:
    """Channels over time; see `Flight.plot`."""
    return still([over_time([flight], channels=channels)], theme=theme, title=flight.provenance.source)


def explore_flight(flight: Flight, *, channels: Sequence[str] | None = None, theme: Theme = "light") -> Any:
    """Channels over time, to zoom; see `Flight.explore`."""
    return interactive(over_time([flight], channels=channels), theme=theme, title=flight.provenance.source)


def plot_responses(
    response: FrequencyResponse,
    *,
    pairs: Sequence[tuple[str, str]] | None = None,
    theme: Theme = "paper",
    frequency: Frequency = "Hz",
) -> Still:
    """Bode diagrams; see `FrequencyResponse.plot`."""
    return still([bode_matrix.of_responses(response, pairs)], theme=theme, frequency=frequency)


def explore_responses(
    response: FrequencyResponse,
    *,
    pairs: Sequence[tuple[str, str]] | None = None,
    theme: Theme = "light",
    frequency: Frequency = "Hz",
) -> Any:
    """Bode diagrams, to zoom; see `FrequencyResponse.explore`."""
    return interactive(bode_matrix.of_responses(response, pairs), theme=theme, frequency=frequency)


def plot_derivatives(derivatives: Derivatives, *, row: str = "M", theme: Theme = "paper") -> Still:
    """Derivatives over speed by contributor; see `Derivatives.plot`."""
    from swashplate.reporting.speed_page import by_contributor

    return still([by_contributor(derivatives, row)], theme=theme)


def explore_derivatives(derivatives: Derivatives, *, row: str = "M", theme: Theme = "light") -> Any:
    """Derivatives over speed by contributor, to zoom; see `Derivatives.explore`."""
    from swashplate.reporting.speed_page import by_contributor

    return interactive(by_contributor(derivatives, row), theme=theme)
