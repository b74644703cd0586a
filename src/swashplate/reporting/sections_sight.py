"""Sections on what the data can tell (correlation, blind directions, excitation) and on the eigenvalues at hover."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from swashplate.identification.core.result import Result
from swashplate.identification.time.feedback import AxisExcitation
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.figures_fit import correlation_matrix, eigenvalues
from swashplate.reporting.structure import Block, Cell, Points, Row, Section, Table, Text, tabulate
from swashplate.reporting.words import value_words
from swashplate.simulation.linearize import Mode

_SLOW = 1e-6


def sight(fit: Result[Vehicle, object]) -> Section:
    """What the data can and cannot tell."""
    blocks: list[Block] = [_excitation(axes)] if (axes := getattr(fit.details, "excitation", ())) else []
    if fit.directions:
        blocks.append(
            Points(
                tuple(d.words for d in fit.directions),
                title="Combinations of parameters that these flights hardly see, worst first",
                ordered=True,
            )
        )
    else:
        blocks.append(Text("There is no combination of the free parameters that these flights do not see."))
    if len(fit.names) > 1:
        blocks.append(correlation_matrix(fit.names, fit.correlation))
    return Section("sight", "What could these flights tell?", tuple(blocks), folded=True)


def _excitation(axes: Sequence[AxisExcitation]) -> Table:
    """What moved each axis; records are named where there are several."""
    records = {a.record for a in axes}
    columns = ("axis", "verdict", "finding", "command", "explained", "coherence", "phase", "power")
    rows = tuple(
        (
            a.axis,
            Cell(
                "independent excitation" if a.identifiable else "not identifiable",
                tone="good" if a.identifiable else "bad",
            ),
            a.words,
            a.command,
            _share(a.explained),
            value_words(round(a.coherence, 2)),
            f"{math.degrees(a.phase):.0f}°" if math.isfinite(a.phase) else "–",
            value_words(float(f"{a.power:.2g}")),
            *((a.record,) if len(records) > 1 else ()),
        )
        for a in axes
    )
    return tabulate(
        "Excitation and feedback per axis",
        (*columns, "record") if len(records) > 1 else columns,
        rows,
        note="Explained: share of the command that past motion explains. A command that past motion explains almost "
        "wholly is a controller's answer: the record then shows the controller, not the aircraft. Coherence and "
        "phase: largest between command and motion in the band. Power: standard deviation of the command.",
    )


def _share(value: float) -> str:
    return f"{100.0 * value:.0f} %" if math.isfinite(value) else "–"


def hover(modes: Mapping[str, Sequence[Mode]], problems: Sequence[str] = ()) -> Section | None:
    """Eigenvalues of the published and the identified vehicle at hover; None where there is nothing to say.

    Args:
        modes: by vehicle, "published" and "identified".
        problems: why a vehicle has none.
    """
    blocks: list[Block] = [Text(problem, tone="caution") for problem in problems]
    if modes:
        blocks.append(eigenvalues(modes))
        blocks.append(
            tabulate(
                "Modes at hover",
                (
                    "mode",
                    "vehicle",
                    "eigenvalue [1/s]",
                    "ω [rad/s]",
                    "f [Hz]",
                    "damping",
                    "time constant [s]",
                    "behaviour",
                ),
                tuple(
                    _row(mode, label, place)
                    for label, group in modes.items()
                    for place, mode in enumerate((m for m in group if m.frequency > _SLOW), start=1)
                ),
                note="Modes at the origin (position, heading and whatever hover does not hold) are left out: "
                + ", ".join(f"{sum(m.frequency <= _SLOW for m in group)} {label}" for label, group in modes.items())
                + ". The states named take part most. Quadratic terms have no slope at hover.",
            )
        )
    return Section("hover", "Which motions of its own has it at hover?", tuple(blocks), folded=True) if blocks else None


def _row(mode: Mode, label: str, place: int) -> Row:
    value = mode.eigenvalue
    text = f"{value.real:+.3f}" + (f" ± {value.imag:.3f}j" if value.imag > 0.0 else "")
    grows = value.real > _SLOW
    return (
        f"{place}. {', '.join(name for name, share in mode.states if share > 0.1) or mode.states[0][0]}",
        label,
        text,
        f"{mode.frequency:.2f}",
        f"{mode.frequency / (2.0 * math.pi):.2f}",
        f"{mode.damping:+.3f}",
        f"{mode.time_constant:.3g}" if math.isfinite(mode.time_constant) else "–",
        Cell("grows" if grows else "dies out", tone="bad" if grows else "plain"),
    )
