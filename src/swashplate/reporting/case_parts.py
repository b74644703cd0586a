"""Cases side by side: what tables, figures and JSON of their comparison are made of, whatever they are cases of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from swashplate.arrays import Array, Complex
from swashplate.identification.responses.frequency_response import TWO_PI, decibel, unwrapped_degrees
from swashplate.reporting.structure import Figure, Key, Table
from swashplate.reporting.theme import BLACK, BLUE, GREEN, ORANGE, PURPLE, VERMILION, grid, line, phase_ticks

STYLES = ((BLACK, "solid"), (BLUE, "dash"), (VERMILION, "dot"), (GREEN, "dashdot"), (PURPLE, "dash"), (ORANGE, "dot"))
MOST_PAIRS = 12
"""Bode diagrams in one figure."""


@dataclass(frozen=True)
class CaseParts:
    """One view of several cases.

    Attributes:
        tables, figures: what is shown.
        told: what a reader must know.
        document: the same numbers as JSON types.
    """

    tables: tuple[Table, ...] = ()
    figures: tuple[Figure, ...] = ()
    told: tuple[str, ...] = ()
    document: Mapping[str, Any] = field(default_factory=dict)

    def __add__(self, other: CaseParts) -> CaseParts:
        return CaseParts(
            (*self.tables, *other.tables),
            (*self.figures, *other.figures),
            (*self.told, *other.told),
            {**self.document, **other.document},
        )


Curve = tuple[Array, Complex]
"""Frequencies [rad/s] and a response at them."""


def bode_overlay(pairs: Mapping[tuple[str, str], Mapping[str, Curve]], *, whose: str = "") -> Figure:
    """Magnitude and phase of pairs (output, input), a line for each case that has it; phases by whole turns alike.

    `whose` they are is said below; cases by default.
    """
    shown = dict(list(pairs.items())[:MOST_PAIRS])
    names = list(dict.fromkeys(name for curves in shown.values() for name in curves))
    titles = [f"{o} / {i}, {what}" for o, i in shown for what in ("magnitude [dB]", "phase [deg]")]
    layout = grid(titles, columns=2, height=150, x_title="frequency [Hz]")
    layout["meta"] |= {"frequency": "Hz"}
    traces: list[dict[str, Any]] = []
    for row, curves in enumerate(shown.values()):
        numbers = ["" if 2 * row + k == 0 else str(2 * row + k + 1) for k in (0, 1)]
        phases: list[Array] = []
        for name, (omega, h) in curves.items():
            phase = unwrapped_degrees(h)
            if phases:
                first = next(iter(curves.values()))
                there = np.isfinite(phases[0])
                apart = phase - np.interp(omega, first[0][there], phases[0][there]) if there.any() else np.zeros(1)
                known = apart[np.isfinite(apart)]
                phase = phase - 360.0 * np.round(np.median(known) / 360.0) if known.size else phase
            phases.append(phase)
            color, dash = STYLES[names.index(name) % len(STYLES)]
            for number, values in zip(numbers, (np.asarray(decibel(h)), phase), strict=True):
                traces.append(line(omega / TWO_PI, values, name=name, color=color, dash=dash, axis=number))
        for number in numbers:
            layout[f"xaxis{number}"] |= {"type": "log", "matches": None if number == "" else "x"}
        layout[f"yaxis{numbers[1]}"] |= phase_ticks(np.concatenate(phases))
    left_out = len(pairs) - len(shown)
    more = f" {left_out} more pairs are not drawn." if left_out else ""
    return Figure(
        "overlay",
        {"data": traces, "layout": layout},
        f"{whose or f'Responses of {len(names)} cases'} over each other.{more}",
        f"Bode diagrams of {', '.join(f'{o} over {i}' for o, i in shown)} for {', '.join(names)}.",
        keys=tuple(Key(n, *STYLES[k % len(STYLES)]) for k, n in enumerate(names)),
    )


def common(columns: Sequence[Sequence[str]]) -> list[str]:
    """What all have, in the order of the first."""
    return [name for name in columns[0] if all(name in other for other in columns[1:])]
