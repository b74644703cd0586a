"""A page about one vehicle over speed: trim curves, root locus, and derivatives by contributor."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from swashplate.atomic import write_text
from swashplate.errors import SwashError
from swashplate.reporting.html import render
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
)
from swashplate.reporting.versions import date, versions
from swashplate.simulation.linearize import linearize
from swashplate.simulation.trim import Trim
from swashplate.vehicles.derivatives import COLUMNS, DerivativeTable, split_name, unit
from swashplate.vehicles.vehicle import Vehicle

_PART_COLORS = {
    "main_rotor": BLUE,
    "tail_rotor": VERMILION,
    "tailplane": GREEN,
    "fin": ORANGE,
    "fuselage": PURPLE,
}
_PITCHES = (
    " theta0: collective, B1 and A1: longitudinal and lateral cyclic, theta0T: tail rotor, each as blade pitch; phi "
    "and theta: roll and pitch attitude."
)
_SHOWN = ("Xu", "Zw", "Mu", "Mw", "Mq", "Mp", "Yv", "Lv", "Lp", "Lq", "Nv", "Nr")


def speed_page(
    vehicle: Vehicle,
    trims: Sequence[Trim],
    *,
    path: str | os.PathLike[str],
    tables: Sequence[DerivativeTable] = (),
    remarks: Sequence[str] = (),
) -> Path:
    """Write one self-contained HTML page.

    Args:
        vehicle: whose trims they are.
        trims: at two speeds or more.
        path: where to write.
        tables: derivatives at the same speeds (none: no such section).
        remarks: what may not be believed.

    Raises:
        SwashError: where there are fewer than two speeds, or the place cannot be written to.
    """
    if len(trims) < 2:
        raise SwashError("a plot over speed needs a range of speeds.", channel="--speed", hint='Give one, e.g. "0-15".')
    blocks: list[Block] = [_controls(vehicle, trims), _locus(vehicle, trims)]
    sections = [Section("speed", "Over speed", tuple(blocks))]
    if tables:
        sections.append(Section("derivatives", "Derivatives by contributor", (_derivatives(trims, tables),)))
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
    target = Path(path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        return write_text(target, render(report))
    except OSError as error:
        raise SwashError(
            f"cannot be written: {error.strerror or error}.", where=target, hint="Choose another place."
        ) from None


def _controls(vehicle: Vehicle, trims: Sequence[Trim]) -> Figure:
    speeds = [at.speed for at in trims]
    angular = vehicle.name != "coax"
    names = [*vehicle.input_names, "phi", "theta"]
    layout = grid(
        [f"{name} [deg]" if angular or name in ("phi", "theta") else name for name in names],
        columns=3,
        height=170,
        x_title="speed [m/s]",
    )
    traces = []
    for i, name in enumerate(names):
        values = np.array([{**at.states(), **at.commands()}[name] for at in trims])
        shown = np.degrees(values) if angular or name in ("phi", "theta") else values
        number = "" if i == 0 else str(i + 1)
        hover = f"{name}<br>%{{x:.1f}} m/s, %{{y:.3f}}"
        traces.append(line(speeds, shown, name=name, color=BLUE, axis=number, hover=hover))
    return Figure(
        "trim-curves",
        {"data": traces, "layout": layout},
        int(layout["height"]),
        f"Controls and attitude that hold each speed.{_PITCHES if 'theta0T' in names else ''}",
        f"Trim curves of {', '.join(names)} from {speeds[0]:g} to {speeds[-1]:g} m/s.",
    )


def _locus(vehicle: Vehicle, trims: Sequence[Trim]) -> Figure:
    layout = base_layout(420)
    layout["xaxis"], layout["yaxis"] = axis("real part [1/s]"), axis("imaginary part [rad/s]")
    layout["shapes"] = [{"type": "line", "x0": 0, "x1": 0, "yref": "paper", "y0": 0, "y1": 1, "line": {"color": BLACK}}]
    real, imag, color = [], [], []
    for at in trims:
        for value in np.linalg.eigvals(linearize(vehicle, at).A):
            if abs(value) > 1e-6:
                real.append(value.real)
                imag.append(value.imag)
                color.append(at.speed)
    trace = {
        "type": "scatter",
        "mode": "markers",
        "x": numbers(real),
        "y": numbers(imag),
        "marker": {
            "color": numbers(color),
            "colorscale": "Viridis",
            "size": 7,
            "colorbar": {"title": {"text": "m/s"}, "thickness": 12},
        },
        "hovertemplate": "%{x:.3f} %{y:+.3f}j at %{marker.color:.1f} m/s<extra></extra>",
    }
    return Figure(
        "root-locus",
        {"data": [trace], "layout": layout},
        420,
        "Eigenvalues over speed. Right of the vertical line a motion grows.",
        f"Root locus from {trims[0].speed:g} to {trims[-1].speed:g} m/s in the complex plane.",
    )


def _derivatives(trims: Sequence[Trim], tables: Sequence[DerivativeTable]) -> Figure:
    speeds = [at.speed for at in trims]
    layout = grid([f"{name} [{unit(name)}]" for name in _SHOWN], columns=3, height=170, x_title="speed [m/s]")
    traces = []
    parts = [part for part in tables[0].parts if part in _PART_COLORS]
    for i, name in enumerate(_SHOWN):
        row, column = split_name(name)
        number = "" if i == 0 else str(i + 1)
        hover = f"{name}<br>%{{x:.1f}} m/s, %{{y:.4g}}"
        total = [table[name] for table in tables]
        traces.append(line(speeds, total, name=f"{name} total", color=BLACK, width=2.0, axis=number, hover=hover))
        for part in parts:
            values = [float(table.parts[part][row, column]) for table in tables]
            if max(map(abs, values)) > 1e-6:
                traces.append(
                    line(speeds, values, name=part, color=_PART_COLORS[part], dash="dash", axis=number, hover=part)
                )
    keys = (Key("total", BLACK), *(Key(part.replace("_", " "), _PART_COLORS[part], "dash") for part in parts))
    return Figure(
        "derivatives-over-speed",
        {"data": traces, "layout": layout},
        int(layout["height"]),
        "Derivatives (force per mass, moment per inertia) and what contributes to them.",
        f"Twelve of {6 * len(COLUMNS)} derivatives over speed, split by contributor.",
        keys=keys,
    )
