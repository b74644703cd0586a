"""A page about one vehicle over speed: trim curves, root locus, and derivatives by contributor."""

from __future__ import annotations

from collections.abc import Sequence

from swashplate.errors import SwashError
from swashplate.models.conventional.derivative_table import COLUMNS, ROWS, split_name
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.structure import Block, Figure, Key, Points, Report, Section
from swashplate.reporting.theme import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    VERMILION,
    FigurePart,
    axis,
    axis_number,
    base_layout,
    grid,
    line,
    numbers,
    unit_words,
)
from swashplate.simulation.derivatives_over_speed import Derivatives
from swashplate.simulation.linearize import Mode, linearize
from swashplate.simulation.trim import Trim
from swashplate.simulation.trim_curve import TrimCurve

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
_FEW = 15
_STILL, _NOTHING = 1e-3, 1e-6
"""Of a value, and of its unit: a quantity that moves less over speed does not fill its panel."""
_WIDE = 860
"""px: below this width the derivatives' small panels scroll."""


def compose_speeds(over_speed: TrimCurve | Derivatives, *, title: str | None = None) -> Report:
    """The page's structure: trims and modes over speed, and derivatives where they were asked for.

    Raises:
        SwashError: where there are fewer than two speeds.
    """
    vehicle, trims = over_speed.vehicle, over_speed.trims
    tables, imperial = (over_speed.tables, over_speed.imperial) if isinstance(over_speed, Derivatives) else ((), False)
    remarks = TrimCurve(vehicle, trims).remarks
    if len(trims) < 2:
        raise SwashError("a plot over speed needs a range of speeds.", channel="--speed", hint='Give one, e.g. "0-15".')
    sections = [
        Section("speed", "Trim over speed", (controls(TrimCurve(vehicle, tuple(trims))),)),
        Section("modes", "Modes over speed", _loci(vehicle, trims)),
    ]
    if tables:
        figures: tuple[Block, ...] = tuple(
            by_contributor(Derivatives(vehicle, tuple(trims), tuple(tables), imperial), row) for row in ROWS
        )
        sections.append(
            Section("derivatives", "Which part of the helicopter makes which derivative?", figures, folded=True)
        )
    if remarks:
        sections.append(Section("doubts", "Where the equations do not hold", (Points(tuple(remarks)),)))
    first, last = trims[0].speed, trims[-1].speed
    return Report(
        title=title
        or f"{'Trim and derivatives' if tables else 'Trim'} from {first:g} to {last:g} m/s: {vehicle.card.title}",
        banners=(("caution", "Some of these speeds lie outside what the equations cover; see the last section."),)
        if remarks
        else (),
        summary=(("Where to trust it", vehicle.card.trust or "the card does not say", "plain"),),
        picture=None,
        sections=tuple(sections),
    )


def controls(curve: TrimCurve) -> Figure:
    """Inputs, attitude, flapping and power that hold each speed."""
    columns = {head.replace("[1]", "[-]"): values for head, values in curve.columns().items()}
    speeds = columns.pop("speed [m/s]")
    flapping = any(head.startswith(("a1 ", "b1 ")) for head in columns)
    layout = grid(list(columns), columns=3, height=170, x_title="speed [m/s]")
    traces = []
    for i, (title, values) in enumerate(columns.items()):
        number = axis_number(i)
        hover = f"{title}<br>%{{x:.1f}} m/s, %{{y:.3f}}"
        middle = 0.5 * (min(values) + max(values))
        least = max(_STILL * abs(middle), _NOTHING)
        if max(values) - min(values) < least:  # rounding is no trend
            layout[f"yaxis{number}"]["range"] = [middle - least, middle + least]
        traces.append(line(speeds, values, name=title, color=BLUE, axis=number, hover=hover) | _marked(speeds))
    return Figure(
        "trim-curves",
        {"data": traces, "layout": layout},
        f"Controls, attitude and power that hold each speed.{_PITCHES if flapping else ''}",
        f"Trim curves of {', '.join(columns)} from {speeds[0]:g} to {speeds[-1]:g} m/s.",
    )


def _marked(speeds: Sequence[float]) -> FigurePart:
    """Few speeds are marked, so that one speed is seen at all."""
    return {"mode": "lines+markers", "marker": {"size": 5}} if len(speeds) < _FEW else {}


def _loci(vehicle: Vehicle, trims: Sequence[Trim]) -> tuple[Figure, ...]:
    """All eigenvalues, and by themselves those that a pilot or an autopilot lives with."""
    modes = [(at.speed, mode) for at in trims for mode in linearize(vehicle, at).modes() if mode.frequency > 0.0]
    slow = [(speed, mode) for speed, mode in modes if mode.frequency < _SLOW]
    over = f"from {trims[0].speed:g} to {trims[-1].speed:g} m/s"
    figures = [_locus(modes, "root-locus", "Eigenvalues over speed. Right of the vertical line a motion grows.", over)]
    if 0 < len(slow) < len(modes):
        caption = f"The same within {_SLOW:g} rad/s: the slow motions of the fuselage. Point at one for its states."
        figures.append(_locus(slow, "slow-locus", caption, over))
    return tuple(figures)


def _locus(modes: Sequence[tuple[float, Mode]], identifier: str, caption: str, over: str) -> Figure:
    layout = base_layout(420)
    layout["xaxis"], layout["yaxis"] = axis("real part [1/s]"), axis("imaginary part [rad/s]")
    layout["shapes"] = [{"type": "line", "x0": 0, "x1": 0, "yref": "paper", "y0": 0, "y1": 1, "line": {"color": BLACK}}]
    points = [
        (speed, mode, sign * mode.eigenvalue.imag)
        for speed, mode in modes
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
            "colorbar": {"title": {"text": "speed [m/s]"}, "thickness": 12},
        },
        "hovertemplate": "%{x:.3f} %{y:+.3f}j at %{marker.color:.1f} m/s<br>%{text}<extra></extra>",
    }
    return Figure(identifier, {"data": [trace], "layout": layout}, caption, f"Root locus {over} in the complex plane.")


def _mode_words(mode: Mode) -> str:
    states = ", ".join(name for name, share in mode.states if share > _TAKES_PART)
    damping = f"damping {mode.damping:.2f}, " if mode.eigenvalue.imag else f"time constant {mode.time_constant:.2f} s, "
    return f"{damping}states {states}"


def by_contributor(derivatives: Derivatives, row: str) -> Figure:
    """The derivatives of one force or moment over speed: the total, and what contributes to it.

    Raises:
        SwashError: where `row` is none of X, Y, Z, L, M, N.
    """
    if row not in ROWS:
        raise SwashError(f"is '{row}', expected one of {', '.join(ROWS)}.", channel="row")
    speeds, tables = [at.speed for at in derivatives.trims], derivatives.tables
    names = [row + column for column in COLUMNS]
    titles = [f"{name} [{unit_words(derivatives.unit(name))}]" for name in names]
    layout = grid(titles, columns=5, height=150, x_title="speed [m/s]", gap=0.06)
    traces = []
    parts = [part for part in tables[0].parts if part in _PART_COLORS]
    for i, name in enumerate(names):
        place = split_name(name)
        factor = derivatives.factor(name)
        number = axis_number(i)
        total = [factor * table[name] for table in tables]
        hover = f"{name}<br>%{{x:.1f}} m/s, %{{y:.4g}}"
        traces.append(
            line(speeds, total, name=f"{name} total", color=BLACK, width=2.0, axis=number, hover=hover)
            | _marked(speeds)
        )
        for part in parts:
            values = [factor * float(table.parts[part][place]) for table in tables]
            if max(map(abs, values)) > _SEEN * max(map(abs, total)) + 1e-12:
                hover_text = f"{name} of the {part.replace('_', ' ')}<br>%{{x:.1f}} m/s, %{{y:.4g}}"
                traces.append(
                    line(
                        speeds, values, name=part, color=_PART_COLORS[part], dash="dash", axis=number, hover=hover_text
                    )
                )
    keys = (Key("total", BLACK), *(Key(part.replace("_", " "), _PART_COLORS[part], "dash") for part in parts))
    per = "mass" if row in "XYZ" else "moment of inertia"
    return Figure(
        f"derivatives-{row}",
        {"data": traces, "layout": layout},
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
