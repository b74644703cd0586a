"""Figures of flights: channels over time, several flights over each other, spectra and spectrograms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights import spectrum as spectra
from swashplate.flights.flight import Flight
from swashplate.flights.inspect import Inspection
from swashplate.flights.schema import channel
from swashplate.reporting.structure import Cell, Figure, Key, Section, Text, tabulate
from swashplate.reporting.theme import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    FigurePart,
    axis,
    axis_number,
    base_layout,
    kept,
    line,
    numbers,
    over_frequency,
    quantity,
    stacked,
    unit_words,
)

_COLORS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, BLACK)
_MOST_PANELS = 12
_MOST_POINTS = 4000
_PANEL = 120
_LONGEST = 14
"""Characters; longer lists of names stand in the key only."""
_GAP = 5.0
"""Usual steps; a longer one is a gap, which no line bridges."""
_COLUMNS, _ROWS = 300, 160
"""Points that a spectrogram has at most."""
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


def over_time(
    flights: Sequence[Flight], *, channels: Sequence[str] | None = None, shifts: Sequence[float] | None = None
) -> Figure:
    """Channels over time, those that belong together in one panel; several flights over each other, a colour each.

    Args:
        flights: one or several.
        channels: one panel each, in this order; the usual groups that the flights have where None.
        shifts: added to the time of each flight [s].

    Raises:
        FlightError: a channel that no flight has, or flights without channels.
    """
    panels = _panels(flights, channels)
    single = len(flights) == 1
    layout = stacked([_title(flights, names) for names in panels], height=_PANEL)
    layout["annotations"] = notes = []
    traces, keys = [], {}
    for i, names in enumerate(panels):
        for j, name in enumerate(names):
            if single and len(names) > 1:
                notes.append(_beside(name, i, j))
            for k, flight in enumerate(flights):
                if name not in flight:
                    continue
                color = _COLORS[(j if single else k) % len(_COLORS)]
                legend = name if single else label(flight, k)
                if not single:
                    keys[legend] = Key(legend, color)
                time, values = _line(flight, name)
                offset = shifts[k] if shifts else 0.0
                traces.append(line(time + offset, values, name=legend, color=color, axis=_number(i)))
    if notes:
        layout["margin"] = {**layout["margin"], "r": 12 + 7 * max(len(note["text"]) for note in notes)}
    return Figure(
        "flight",
        {"data": traces, "layout": layout},
        "Channels over time; where a log has a gap, the line has one.",
        f"{', '.join(name for names in panels for name in names)} against time.",
        keys=tuple(keys.values()),
    )


def _beside(name: str, panel: int, place: int) -> FigurePart:
    """A line's name in its colour, to the right of its panel."""
    return {
        "text": name,
        "xref": f"x{_number(panel)} domain",
        "yref": f"y{_number(panel)} domain",
        "x": 1.005,
        "y": 1.0 - 0.2 * place,
        "xanchor": "left",
        "yanchor": "top",
        "showarrow": False,
        "font": {"size": 11, "color": _COLORS[place % len(_COLORS)]},
    }


def label(flight: Flight, place: int) -> str:
    """What a flight is called in a key."""
    return flight.provenance.source or f"flight {place + 1}"


def _number(place: int) -> str:
    return axis_number(place)


def _panels(flights: Sequence[Flight], channels: Sequence[str] | None) -> list[tuple[str, ...]]:
    """Which channels stand in which panel."""
    every = tuple(dict.fromkeys(name for flight in flights for name in flight.channels))
    if channels is not None:
        for name in channels:
            if name not in every:
                flights[0].stream_of(name)
        panels: list[tuple[str, ...]] = [(name,) for name in channels]
    else:
        groups = (tuple(name for name in group if name in every) for group in _TOGETHER)
        panels = [group for group in groups if group] or [(name,) for name in every]
        if len(flights) > 1:
            panels = [(name,) for group in panels for name in group]
    if not panels:
        raise FlightError("there is nothing to draw: no channels.", where=flights[0].provenance.source or None)
    return panels[:_MOST_PANELS]


def unit_of(flight: Flight, name: str) -> str:
    """The unit that a channel is shown in; "" where neither schema nor log knows it."""
    return channel(name).shown_unit or str(flight[name].attrs.get("units", ""))


def _title(flights: Sequence[Flight], names: Sequence[str]) -> str:
    unit = next((unit_of(flight, names[0]) for flight in flights if names[0] in flight), "")
    joined = ", ".join(names)
    return quantity(joined if len(names) == 1 or len(joined) < _LONGEST else names[0].split("_")[0], unit)


def _line(flight: Flight, name: str) -> tuple[Array, Array]:
    """Time and shown values of a channel with its peaks, NaN where the log has a gap."""
    time = flight.time(name)
    values = flight.values(name) * channel(name).shown_factor
    chosen = kept(values, limit=_MOST_POINTS)
    steps = np.diff(time)
    if steps.size:
        breaks = np.flatnonzero(steps > _GAP * np.median(steps))
        chosen = np.unique(np.concatenate([chosen, breaks, breaks + 1]))
        ends = np.searchsorted(chosen, breaks) + 1
        return np.insert(time[chosen], ends, time[breaks]), np.insert(values[chosen], ends, np.nan)
    return time[chosen], values[chosen]


# ---- over frequency --------------------------------------------------------------------------------------------
def spectrum(flights: Sequence[Flight], *, channels: Sequence[str] | None = None) -> Figure:
    """Power spectral density of channels, as `flights.spectrum` computes it.

    Raises:
        FlightError: a channel that no flight has, or one with too few samples.
    """
    panels = [name for names in _panels(flights, channels) for name in names][:_MOST_PANELS]
    return of_spectra(
        [{label(f, k): spectra.spectrum(f, name) for k, f in enumerate(flights) if name in f} for name in panels],
        [label(f, k) for k, f in enumerate(flights)],
    )


def of_spectra(panels: Sequence[Mapping[str, spectra.Spectrum]], names: Sequence[str]) -> Figure:
    """Densities over frequency, a panel a channel.

    Args:
        panels: spectra of one channel, by the name of their flight.
        names: of all flights, in the order of their colours.
    """
    drawn = [next(iter(panel.values())) for panel in panels]
    lines = [f"{name}: {curve}" if len(names) > 1 else str(curve) for panel in panels for name, curve in panel.items()]
    titles = [f"{one.channel} [({unit_words(one.unit) or '1'})²/Hz]" for one in drawn]
    layout = over_frequency(titles, height=_PANEL + 20, unit="Hz")
    colors = {name: _COLORS[k % len(_COLORS)] for k, name in enumerate(names)}
    traces = []
    for i, panel in enumerate(panels):
        layout[f"yaxis{_number(i)}"] |= {"type": "log", "exponentformat": "power"}
        for name, curve in panel.items():
            hover = f"{curve.channel}<br>%{{x:.4g}} Hz, %{{y:.3g}}"
            over, density = curve.frequency[1:], curve.density[1:]
            traces.append(line(over, density, name=name, color=colors[name], axis=_number(i), hover=hover))
    return Figure(
        "spectrum",
        {"data": traces, "layout": layout},
        "Power spectral density, one-sided, after Welch; of a log with gaps its longest unbroken piece.",
        f"Power spectra of {', '.join(one.channel for one in drawn)}. {'; '.join(lines)}.",
        keys=tuple(Key(name, color) for name, color in colors.items()) if len(names) > 1 else (),
    )


def spectrogram(flight: Flight, *, channels: Sequence[str] | None = None) -> Figure:
    """Power over time and frequency, one panel a channel; dB below the channel's strongest line.

    Raises:
        FlightError: a channel that the flight has not, or one with too few samples.
    """
    names = [name for group in _panels([flight], channels) for name in group][:_MOST_PANELS]
    return of_spectrograms([spectra.spectrogram(flight, name, frames=_COLUMNS) for name in names])


def of_spectrograms(panels: Sequence[spectra.Spectrogram]) -> Figure:
    """Power over time and frequency, one panel each; dB below the strongest line."""
    names = [measured.channel for measured in panels]
    layout = stacked([f"{name}: frequency [Hz]" for name in names], height=_PANEL + 60)
    layout["margin"] = {**layout["margin"], "r": 70}
    traces: list[FigurePart] = []
    for i, (name, measured) in enumerate(zip(names, panels, strict=True)):
        thin = max(1, -(-measured.frequency.size // _ROWS))
        rows = [measured.density[k : k + thin].max(axis=0) for k in range(0, measured.frequency.size, thin)]
        level = 10.0 * np.log10(np.maximum(np.array(rows), 1e-30))
        level -= level.max()
        traces.append(
            {
                "type": "heatmap",
                "x": numbers(measured.time),
                "y": numbers(measured.frequency[::thin]),
                "z": [numbers(np.round(row, 1)) for row in level],
                "zmin": -60,
                "zmax": 0,
                "colorscale": "Viridis",
                "xaxis": f"x{_number(i)}",
                "yaxis": f"y{_number(i)}",
                "colorbar": {
                    "title": {"text": "power [dB]"},
                    "thickness": 10,
                    "len": 1.0 / len(names),
                    "y": 1.0 - (i + 0.5) / len(names),
                },
                "hovertemplate": f"{name}<br>%{{x:.2f}} s, %{{y:.1f}} Hz: %{{z:.0f}} dB<extra></extra>",
            }
        )
    return Figure(
        "spectrogram",
        {"data": traces, "layout": layout},
        "Power over time and frequency, in dB below the strongest; of a log with gaps its longest unbroken piece.",
        f"Spectrograms of {', '.join(names)}.",
    )


# ---- as notebooks show them ------------------------------------------------------------------------------------
def section_of_flight(flight: Flight, *, channels: Sequence[str] | None = None) -> Section:
    """Streams and channels with their units, and the channels over time."""
    rows = []
    for name in flight.channels:
        values, known = flight[name], channel(name)
        unit = str(values.attrs.get("units", "")) or known.unit
        rate = f"{flight.rate(name):.1f}" if values.size > 1 else "-"
        size = Cell(str(values.size), number=True)
        rows.append((name, unit, rate, size, known.description))
    notes = (*flight.provenance.damage, *flight.provenance.notes)
    table = tabulate("Channels", ("channel", "unit", "rate [Hz]", "samples", "what"), rows)
    figures = (over_time([flight], channels=channels),) if flight.channels else ()
    title = f"Flight {flight.provenance.source or '(unnamed)'}: {flight.duration:.1f} s"
    return Section("flight", title, (*(Text(note, tone="caution") for note in notes), *figures, table))


def section_of_inspection(inspection: Inspection) -> Section:
    """Problems, what was recorded when, and the channels."""
    head, *rows = inspection.channel_rows()
    table = tabulate("Channels", head, rows)
    problems = tuple(Text(problem, tone="caution") for problem in inspection.problems)
    title = f"{inspection.source or '(unnamed)'}: {inspection.duration:.1f} s"
    return Section("inspection", title, (*problems, _recorded(inspection), table))


def _recorded(inspection: Inspection) -> Figure:
    """From when to when each stream was recorded, and the sweeps in it."""
    rows = [(s.name, s.start, s.stop, GREY) for s in inspection.streams if np.isfinite(s.start)]
    rows += [(f"sweep of {s.channel}", s.start, s.stop, BLUE) for s in inspection.sweeps]
    names = list(dict.fromkeys(name for name, *_ in rows)) or ["nothing"]
    layout = base_layout(70 + 26 * len(names), left=120)
    layout["xaxis"] = axis("time [s]")
    layout["yaxis"] = axis(
        "", type="category", categoryarray=names[::-1], categoryorder="array", range=[-0.6, len(names) - 0.4]
    )
    traces = [
        {
            "type": "scatter",
            "mode": "lines",
            "x": [start, stop],
            "y": [name, name],
            "name": name,
            "line": {"color": color, "width": 8},
            "hovertemplate": f"{name}<br>%{{x:.2f}} s<extra></extra>",
        }
        for name, start, stop, color in rows
    ]
    return Figure(
        "recorded",
        {"data": traces, "layout": layout},
        "What was recorded when, and the frequency sweeps found in it.",
        f"Streams {', '.join(s.name for s in inspection.streams)} over time, with {len(inspection.sweeps)} sweeps.",
        keys=(Key("recorded", GREY, "bar"), *((Key("frequency sweep", BLUE, "bar"),) if inspection.sweeps else ())),
    )
