"""Figures for papers and notebooks: flights, responses, validations, trims and derivatives, as matplotlib figures.

Nothing of pyplot's global state is touched: `figure.savefig("a.pdf")` writes PDF, SVG or PNG by its suffix.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from swashplate.errors import FlightError, SwashError
from swashplate.flights.flight import Flight
from swashplate.flights.schema import channel
from swashplate.identification.responses.frequency_response import (
    LEAST_COHERENCE,
    TWO_PI,
    FrequencyResponse,
    decibel,
    unwrapped_degrees,
)
from swashplate.models.conventional.derivative_table import COLUMNS, ROWS, split_name
from swashplate.reporting.downsample import kept
from swashplate.reporting.pictures import blank_figure, score_figure, tidy
from swashplate.reporting.theme import BLACK, BLUE, GREY, VERMILION, unit_words
from swashplate.simulation.derivatives_over_speed import Derivatives
from swashplate.simulation.trim_curve import TrimCurve
from swashplate.validation.validation import Validation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MOST_PANELS = 12
_MOST_POINTS = 4000
_LONGEST_LABEL = 14
"""Characters; longer names stand in the legend only."""
_COLORS = (BLUE, VERMILION, "#009E73", "#E69F00", "#CC79A7", "#56B4E9", BLACK)
_TOGETHER = (
    ("phi", "theta"),
    ("psi",),
    ("p", "q", "r"),
    ("u", "v", "w"),
    ("x", "y", "z"),
    ("ax", "ay", "az"),
    ("servo_roll", "servo_pitch"),
    ("motor_lower", "motor_upper"),
    ("mixer_roll", "mixer_pitch", "mixer_yaw", "mixer_collective"),
)
"""Channels that are read side by side share a panel."""


def plot_flight(flight: Flight, *, channels: Sequence[str] | None = None) -> Figure:
    """Channels over time, those that belong together in one panel; gaps stay open.

    Args:
        flight: whose.
        channels: one panel each, in this order; the usual groups that the flight has where None.

    Raises:
        FlightError: a channel that the flight has not, or a flight without channels.
    """
    panels = _panels(flight, channels)
    figure = blank_figure(7.2, 1.35 * len(panels) + 0.6)
    axes: Any = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for panel, names in zip(axes, panels, strict=True):
        for name, color in zip(names, _COLORS, strict=False):
            time, values = _line(flight, name)
            panel.plot(time, values, color=color, lw=0.9, label=name)
        panel.set_ylabel(_axis(flight, names))
        panel.margins(x=0.01)
        tidy(panel)
        if len(names) > 1:
            panel.legend(
                loc="lower right",
                bbox_to_anchor=(1.0, 0.98),
                ncols=len(names),
                frameon=False,
                fontsize=8,
                borderaxespad=0.0,
            )
    axes[-1].set_xlabel("time [s]")
    if flight.provenance.source:
        figure.suptitle(flight.provenance.source, fontsize=10, x=0.02, ha="left")
    return figure


def _panels(flight: Flight, channels: Sequence[str] | None) -> list[tuple[str, ...]]:
    if channels is not None:
        for name in channels:
            flight.stream_of(name)
        panels: list[tuple[str, ...]] = [(name,) for name in channels]
    else:
        groups = (tuple(name for name in group if name in flight) for group in _TOGETHER)
        panels = [group for group in groups if group] or [(name,) for name in flight.channels]
    if not panels:
        raise FlightError("there is nothing to draw: no channels.", where=flight.provenance.source or None)
    return panels[:_MOST_PANELS]


def _line(flight: Flight, name: str) -> tuple[Any, Any]:
    """Time and shown values of a channel with its peaks, NaN where the log has a gap."""
    time = flight.time(name)
    values = flight.values(name) * channel(name).shown_factor
    chosen = kept(values, limit=_MOST_POINTS)
    steps = np.diff(time)
    if steps.size:
        breaks = np.flatnonzero(steps > 5.0 * np.median(steps))
        chosen = np.unique(np.concatenate([chosen, breaks, breaks + 1]))
        ends = np.searchsorted(chosen, breaks) + 1
        return np.insert(time[chosen], ends, time[breaks]), np.insert(values[chosen], ends, np.nan)
    return time[chosen], values[chosen]


def _axis(flight: Flight, names: Sequence[str]) -> str:
    unit = channel(names[0]).shown_unit or str(flight[names[0]].attrs.get("units", ""))
    words = unit_words(unit)
    joined = ", ".join(names)
    what = joined if len(names) == 1 or len(joined) < _LONGEST_LABEL else names[0].split("_")[0]
    return f"{what} [{words}]" if words else what


def plot_responses(response: FrequencyResponse, *, pairs: Sequence[tuple[str, str]] | None = None) -> Figure:
    """Bode plots with coherence: magnitude and phase with random errors, one column a pair.

    Args:
        response: whose.
        pairs: (output, input); where None those with a coherent band, at most four.

    Raises:
        SwashError: a channel that is not in the responses.
    """
    every = [(output, name) for output in response.outputs for name in response.inputs]
    chosen = pairs or [pair for pair in every if response.band(*pair) is not None][:4] or every[:1]
    figure = blank_figure(max(4.2, 3.0 * len(chosen) + 0.8), 5.4)
    axes: Any = figure.subplots(3, len(chosen), sharex=True, squeeze=False, height_ratios=(3, 3, 1.6))
    hertz = response.omega / TWO_PI
    for (magnitude, phase, coherent), (output, name) in zip(axes.T, chosen, strict=True):
        h, coherence, error = response.pair(output, name)
        good = np.where(coherence >= LEAST_COHERENCE, 1.0, np.nan)
        spread = 20.0 * np.log10(1.0 + np.nan_to_num(error))
        for panel, values, wide in (
            (magnitude, np.asarray(decibel(h)), spread),
            (phase, unwrapped_degrees(h), np.degrees(np.nan_to_num(error))),
        ):
            panel.plot(hertz, values, color=GREY, lw=0.8, label=f"coherence below {LEAST_COHERENCE:g}")
            panel.plot(hertz, values * good, color=BLUE, lw=1.4, label="coherent")
            panel.fill_between(hertz, values * good - wide, values * good + wide, color=BLUE, alpha=0.2, lw=0)
        coherent.plot(hertz, coherence, color=BLUE, lw=1.0)
        coherent.axhline(LEAST_COHERENCE, color=GREY, lw=0.8, ls="--")
        coherent.set(xscale="log", ylim=(0.0, 1.02), xlabel="frequency [Hz]")
        magnitude.set_title(f"{output} / {name}", fontsize=10)
        for panel in (magnitude, phase, coherent):
            tidy(panel)
    axes[0, 0].set_ylabel("magnitude [dB]")
    axes[1, 0].set_ylabel("phase [deg]")
    axes[2, 0].set_ylabel("coherence")
    axes[0, 0].legend(frameon=False, fontsize=8)
    return figure


def plot_validation(validation: Validation) -> Figure:
    """Fit of every predictor on every channel, at the middle horizon."""
    return score_figure(validation)


def plot_trim_curve(curve: TrimCurve) -> Figure:
    """Inputs, attitude, flapping and power that hold each speed; bars at a single speed."""
    columns = curve.columns()
    speeds = columns.pop("speed [m/s]")
    return _small_panels(columns, speeds, {head: head for head in columns})


def plot_derivatives(derivatives: Derivatives, *, row: str = "M") -> Figure:
    """The derivatives of one force or moment over speed: the total and what contributes to it.

    Raises:
        SwashError: where `row` is none of X, Y, Z, L, M, N.
    """
    if row not in ROWS:
        raise SwashError(f"is '{row}', expected one of {', '.join(ROWS)}.", channel="row")
    speeds = [at.speed for at in derivatives.trims]
    columns, titles, parts = {}, {}, {}
    for name in (row + column for column in COLUMNS):
        factor = derivatives.factor(name)
        columns[name] = [factor * table[name] for table in derivatives.tables]
        titles[name] = f"{name} [{unit_words(derivatives.unit(name))}]"
        place = split_name(name)
        parts[name] = {
            part.replace("_", " "): [factor * float(table.parts[part][place]) for table in derivatives.tables]
            for part in derivatives.tables[0].parts
        }
    return _small_panels(columns, speeds, titles, parts)


def _small_panels(
    columns: Mapping[str, Sequence[float]],
    speeds: Sequence[float],
    titles: Mapping[str, str],
    parts: Mapping[str, Mapping[str, Sequence[float]]] | None = None,
) -> Figure:
    """One small panel a quantity over speed, three or more in a row."""
    across = 3 if len(columns) <= 9 else 5
    down = -(-len(columns) // across)
    figure = blank_figure(2.3 * across + 0.4, 1.7 * down + 0.7)
    axes: Any = figure.subplots(down, across, squeeze=False, sharex=True)
    mark = "o" if len(speeds) < 15 else None
    for panel, (name, values) in zip(axes.flat, columns.items(), strict=False):
        for (part, shares), color in zip((parts or {}).get(name, {}).items(), _COLORS, strict=False):
            panel.plot(speeds, shares, color=color, lw=1.0, ls="--", label=part)
        panel.plot(speeds, values, color=BLACK if parts else BLUE, lw=1.5, marker=mark, ms=3, label="total")
        panel.set_title(titles[name], fontsize=9)
        tidy(panel)
    for panel in axes.flat[len(columns) :]:
        panel.set_visible(False)
    for column in range(across):
        shown = [panel for panel in axes[:, column] if panel.get_visible()]
        shown[-1].set_xlabel("speed [m/s]", fontsize=9)
        shown[-1].tick_params(labelbottom=True)
    if parts:
        handles = axes.flat[0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside lower center", ncols=len(handles[0]), frameon=False, fontsize=8)
    return figure
