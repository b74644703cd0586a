"""A page about one vehicle over speed: trim curves, root locus, and derivatives by contributor."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from swashplate.errors import SwashError
from swashplate.models.conventional.derivative_table import (
    COLUMNS,
    ROWS,
    DerivativeTable,
    factor_to_feet,
    split_name,
    unit,
)
from swashplate.models.doubts import shaft_power
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.html import write_page
from swashplate.reporting.structure import Block, Figure, Key, Points, Report, Section
from swashplate.reporting.theme import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    VERMILION,
    axis,
    base_layout,
    grid,
    line,
    numbers,
    unit_words,
)
from swashplate.reporting.versions import date, versions
from swashplate.simulation.linearize import linearize
from swashplate.simulation.modes import Mode
from swashplate.simulation.trim import Trim

_PART_COLORS = {
    "main_rotor": BLUE,
    "tail_rotor": VERMILION,
    "tailplane": GREEN,
    "fin": ORANGE,
    "fuselage": PURPLE,
}
_PITCHES = (
    " theta0: collective, B1 and A1: longitudinal and lateral cyclic, theta0T: tail rotor, each as blade pitch; phi "
    "and theta: roll and pitch attitude; a1 and b1: the disc's tilt aft and right."
)
_SLOW = 6.0
"""rad/s: modes within this are drawn once more by themselves."""
_WIDE = 860
"""px: below this width the derivatives' small panels scroll."""


def speed_page(
    vehicle: Vehicle,
    trims: Sequence[Trim],
    *,
    path: str | os.PathLike[str],
    tables: Sequence[DerivativeTable] = (),
    remarks: Sequence[str] = (),
    imperial: bool = False,
) -> Path:
    """Write one self-contained HTML page.

    Args:
        vehicle: whose trims they are.
        trims: at two speeds or more.
        path: where to write.
        tables: derivatives at the same speeds (none: no such section).
        imperial: derivatives in feet.
        remarks: what may not be believed.

    Raises:
        SwashError: where there are fewer than two speeds, or the place cannot be written to.
    """
    if len(trims) < 2:
        raise SwashError("a plot over speed needs a range of speeds.", channel="--speed", hint='Give one, e.g. "0-15".')
    sections = [
        Section("speed", "Trim over speed", (_controls(vehicle, trims),)),
        Section("modes", "Modes over speed", _loci(vehicle, trims)),
    ]
    if tables:
        figures: tuple[Block, ...] = tuple(_derivatives(trims, tables, row, imperial=imperial) for row in ROWS)
        sections.append(Section("derivatives", "Derivatives by contributor", figures))
    if remarks:
        sections.append(Section("doubts", "Where the equations do not hold", (Points(tuple(remarks)),)))
    first, last = trims[0].speed, trims[-1].speed
    report = Report(
        title=f"{'Trim and derivatives' if tables else 'Trim'} from {first:g} to {last:g} m/s: {vehicle.card.title}",
        banners=(("caution", "Some of these speeds lie outside what the equations cover; see the last section."),)
        if remarks
        else (),
        summary=(("Where to trust it", vehicle.card.trust or "the card does not say", "plain"),),
        picture=None,
        sections=tuple(sections),
        made=f"swashplate {versions()['swashplate']}, {date()}",
    )
    return write_page(path, report)


def _controls(vehicle: Vehicle, trims: Sequence[Trim]) -> Figure:
    speeds = [at.speed for at in trims]
    angular = dict(zip(vehicle.state_names, vehicle.state_units, strict=True))
    angular |= dict(zip(vehicle.input_names, vehicle.input_units, strict=True))
    flapping = [name for name in ("a1", "b1") if name in vehicle.state_names]
    panels = {}
    for name in (*vehicle.input_names, "phi", "theta", *flapping):
        values = np.array([{**at.states(), **at.commands()}[name] for at in trims])
        in_degrees = angular[name] == "rad"
        panels[f"{name} [deg]" if in_degrees else name] = np.degrees(values) if in_degrees else values
    power = [shaft_power(vehicle, at.state, at.inputs, at.environment) for at in trims]
    if all(value is not None for value in power):
        panels["shaft power [kW]"] = np.array(power, dtype=np.float64) / 1000.0
    layout = grid(list(panels), columns=3, height=170, x_title="speed [m/s]")
    traces = []
    for i, (title, values) in enumerate(panels.items()):
        number = "" if i == 0 else str(i + 1)
        hover = f"{title}<br>%{{x:.1f}} m/s, %{{y:.3f}}"
        traces.append(line(speeds, values, name=title, color=BLUE, axis=number, hover=hover))
    return Figure(
        "trim-curves",
        {"data": traces, "layout": layout},
        int(layout["height"]),
        f"Controls, attitude and power that hold each speed.{_PITCHES if flapping else ''}",
        f"Trim curves of {', '.join(panels)} from {speeds[0]:g} to {speeds[-1]:g} m/s.",
    )


def _loci(vehicle: Vehicle, trims: Sequence[Trim]) -> tuple[Figure, ...]:
    """All eigenvalues, and by themselves those that a pilot or an autopilot lives with."""
    found = [(at.speed, mode) for at in trims for mode in linearize(vehicle, at).modes() if mode.frequency > 0.0]
    slow = [(speed, mode) for speed, mode in found if mode.frequency < _SLOW]
    over = f"from {trims[0].speed:g} to {trims[-1].speed:g} m/s"
    figures = [_locus(found, "root-locus", "Eigenvalues over speed. Right of the vertical line a motion grows.", over)]
    if 0 < len(slow) < len(found):
        caption = f"The same within {_SLOW:g} rad/s: the slow motions of the fuselage. Point at one for its states."
        figures.append(_locus(slow, "slow-locus", caption, over))
    return tuple(figures)


def _locus(found: Sequence[tuple[float, Mode]], identifier: str, caption: str, over: str) -> Figure:
    layout = base_layout(420)
    layout["xaxis"], layout["yaxis"] = axis("real part [1/s]"), axis("imaginary part [rad/s]")
    layout["shapes"] = [{"type": "line", "x0": 0, "x1": 0, "yref": "paper", "y0": 0, "y1": 1, "line": {"color": BLACK}}]
    points = [
        (speed, mode, sign * mode.eigenvalue.imag)
        for speed, mode in found
        for sign in ((1.0, -1.0) if mode.eigenvalue.imag else (1.0,))
    ]
    trace = {
        "type": "scatter",
        "mode": "markers",
        "x": numbers([mode.eigenvalue.real for _, mode, _ in points]),
        "y": numbers([imag for _, _, imag in points]),
        "text": [_mode_words(mode) for _, mode, _ in points],
        "marker": {
            "color": numbers([speed for speed, _, _ in points]),
            "colorscale": "Viridis",
            "size": 7,
            "colorbar": {"title": {"text": "m/s"}, "thickness": 12},
        },
        "hovertemplate": "%{x:.3f} %{y:+.3f}j at %{marker.color:.1f} m/s<br>%{text}<extra></extra>",
    }
    return Figure(
        identifier, {"data": [trace], "layout": layout}, 420, caption, f"Root locus {over} in the complex plane."
    )


def _mode_words(mode: Mode) -> str:
    states = ", ".join(name for name, share in mode.states if share > _TAKES_PART)
    damping = f"damping {mode.damping:.2f}, " if mode.eigenvalue.imag else f"time constant {mode.time_constant:.2f} s, "
    return f"{damping}states {states}"


def _derivatives(trims: Sequence[Trim], tables: Sequence[DerivativeTable], row: str, *, imperial: bool) -> Figure:
    speeds = [at.speed for at in trims]
    names = [row + column for column in COLUMNS]
    titles = [f"{name} [{unit_words(unit(name, imperial=imperial))}]" for name in names]
    layout = grid(titles, columns=5, height=150, x_title="speed [m/s]", gap=0.06)
    traces = []
    parts = [part for part in tables[0].parts if part in _PART_COLORS]
    for i, name in enumerate(names):
        place = split_name(name)
        factor = factor_to_feet(*place) if imperial else 1.0
        number = "" if i == 0 else str(i + 1)
        total = [factor * table[name] for table in tables]
        hover = f"{name}<br>%{{x:.1f}} m/s, %{{y:.4g}}"
        traces.append(line(speeds, total, name=f"{name} total", color=BLACK, width=2.0, axis=number, hover=hover))
        for part in parts:
            values = [factor * float(table.parts[part][place]) for table in tables]
            if max(map(abs, values)) > _SEEN * max(map(abs, total)) + 1e-12:
                seen = f"{name} of the {part.replace('_', ' ')}<br>%{{x:.1f}} m/s, %{{y:.4g}}"
                traces.append(
                    line(speeds, values, name=part, color=_PART_COLORS[part], dash="dash", axis=number, hover=seen)
                )
    keys = (Key("total", BLACK), *(Key(part.replace("_", " "), _PART_COLORS[part], "dash") for part in parts))
    per = "mass" if row in "XYZ" else "moment of inertia"
    return Figure(
        f"derivatives-{row}",
        {"data": traces, "layout": layout},
        int(layout["height"]),
        f"{row}: {_ROW_WORDS[row]} per {per}, by motion and control, and what contributes to it.",
        f"Derivatives of {row} over speed, split by contributor.",
        keys=keys,
        min_width=_WIDE,
    )


_ROW_WORDS = {
    "X": "force ahead",
    "Y": "force to the right",
    "Z": "force down",
    "L": "rolling moment",
    "M": "pitching moment",
    "N": "yawing moment",
}
_TAKES_PART, _SEEN = 0.1, 1e-3
"""Shares of a mode and of a derivative below which a state and a contributor are left out."""
