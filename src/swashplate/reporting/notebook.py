"""Results as notebooks show them: a heading, a table, the figure, and what is to be warned of."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING

from swashplate.flights.flight import Flight
from swashplate.flights.schema import channel
from swashplate.identification.responses.frequency_response import TWO_PI, FrequencyResponse
from swashplate.reporting.paper_figures import (
    plot_derivatives,
    plot_flight,
    plot_responses,
    plot_trim_curve,
    plot_validation,
)
from swashplate.simulation.derivatives_over_speed import Derivatives
from swashplate.simulation.trim_curve import TrimCurve
from swashplate.validation.validation import PREDICTORS, Validation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DPI = 110


def html_of_flight(flight: Flight) -> str:
    """Streams and channels with their units, and the usual groups over time."""
    rows = []
    for name in flight.channels:
        values, known = flight[name], channel(name)
        unit = str(values.attrs.get("units", "")) or known.unit
        rate = f"{flight.rate(name):.1f}" if values.size > 1 else "-"
        rows.append((name, unit, rate, str(values.size), known.description))
    title = f"Flight {flight.provenance.source or '(unnamed)'}: {flight.duration:.1f} s"
    figure = plot_flight(flight) if flight.channels else None
    notes = (*flight.provenance.damage, *flight.provenance.notes)
    return _page(title, ("channel", "unit", "rate [Hz]", "samples", "what"), rows, figure, notes)


def html_of_responses(response: FrequencyResponse) -> str:
    """Coherent bands of every pair, and Bode plots of those that have one."""
    rows = []
    for output in response.outputs:
        for name in response.inputs:
            band = response.band(output, name)
            ends = "none" if band is None else f"{band[0] / TWO_PI:.3g} - {band[1] / TWO_PI:.3g}"
            rows.append((f"{output} / {name}", ends))
    title = f"Frequency responses ({response.method}): {response.omega.size} lines"
    warned = (*response.problems, *response.warnings)
    return _page(title, ("output / input", "coherent band [Hz]"), rows, plot_responses(response), warned)


def html_of_validation(validation: Validation) -> str:
    """Verdict per axis, and the fit of every predictor."""
    rows = [(axis.axis, axis.level, axis.words) for axis in validation.verdict]
    title = f"Validation of {validation.vehicle.name} beside {', '.join(PREDICTORS[1:])}"
    figure = plot_validation(validation) if validation.scores else None
    return _page(title, ("axis", "verdict", "why"), rows, figure, ())


def html_of_trim_curve(curve: TrimCurve) -> str:
    """Inputs, attitude and power at each speed."""
    columns = curve.columns()
    rows = [[f"{value:.3f}" for value in row] for row in zip(*columns.values(), strict=True)]
    return _page(f"Trims of {curve.vehicle.card.title}", list(columns), rows, plot_trim_curve(curve), curve.remarks)


def html_of_derivatives(derivatives: Derivatives) -> str:
    """The table at the first trim, and the pitching moment's derivatives where there are several."""
    head, rows = derivatives.rows(derivatives.tables[0])
    title = f"Derivatives of {derivatives.vehicle.card.title} at {derivatives.trims[0].speed:g} m/s"
    figure = plot_derivatives(derivatives) if len(derivatives.trims) > 1 else None
    return _page(title, head, rows, figure, ())


def _page(
    title: str, head: Sequence[str], rows: Iterable[Sequence[str]], figure: Figure | None, warned: Iterable[str]
) -> str:
    cells = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
    heads = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    words = "".join(f"<p><b>!</b> {escape(text)}</p>" for text in warned)
    return (
        f"<div><p><b>{escape(title)}</b></p>{words}<table><thead><tr>{heads}</tr></thead><tbody>{cells}</tbody></table>"
        f"{'' if figure is None else _picture(figure, title)}</div>"
    )


def _picture(figure: Figure, title: str) -> str:
    drawn = io.BytesIO()
    figure.savefig(drawn, format="png", dpi=_DPI)
    text = base64.b64encode(drawn.getvalue()).decode("ascii")
    return f'<img alt="{escape(title, quote=True)}" src="data:image/png;base64,{text}">'
