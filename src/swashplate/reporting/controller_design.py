"""A designed controller as a page: what it is told, its margins at every speed, how far it will stray."""

from __future__ import annotations

import math
from collections.abc import Sequence

from swashplate.control.lqg.analysis import Analysis
from swashplate.control.lqg.controller import Lqg
from swashplate.reporting.structure import Points, Report, Section, Table, tabulate
from swashplate.reporting.versions import card_hash
from swashplate.reporting.words import mode_words


def compose_design(
    made: Lqg,
    speeds: Sequence[float],
    analyses: Sequence[Analysis],
    spread: Sequence[tuple[str, str, str]],
    *,
    title: str | None,
    late: str,
    fast: str = "",
) -> Report:
    """The report's structure.

    Args:
        made: the controller.
        speeds, analyses: of its trims.
        spread: at the first: of every state its name, how far it strays, how well it is known.
        title: heading.
        late: how late commands are taken to be, in words.
        fast: loops that are faster than that asks for, in words; "" for none.
    """
    plan, card = made.plan, made.vehicle.card
    slowest = max((a.modes[0] for a in analyses), key=lambda mode: mode.real)
    least = min(a.margins.least_delay for a in analyses)
    sensors = ", ".join(map(str, plan.sensors)) or "the states themselves"
    return Report(
        title=title or f"{'LQG' if plan.sensors else 'LQR'} controller of {card.title}",
        banners=(
            ("caution", "Results of linear models at the trims, not of a flight: `swash control check` flies it."),
        ),
        summary=(
            ("Told", f"{sensors}, {plan.rate:g} steps a second", "plain"),
            ("Commands are late by", late, "plain"),
            *((("Loops that are fast for that", fast, "caution"),) if fast else ()),
            ("Modes", f"least stable {mode_words(slowest)}", "plain"),
            ("Delay margin", _milliseconds(least), "plain"),
        ),
        picture=None,
        sections=(
            Section("margins", "Margins", (_margins(speeds, analyses),)),
            Section("spread", "In gusts as assumed", (_spread(speeds[0], spread),)),
            Section("made", "Made from", (Points((f"model: {card.title} ({card_hash(card)})",)),)),
        ),
    )


def _milliseconds(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms" if math.isfinite(seconds) else "any"


def _margins(speeds: Sequence[float], analyses: Sequence[Analysis]) -> Table:
    rows = []
    for speed, analysis in zip(speeds, analyses, strict=True):
        for a in analysis.margins.axes:
            cells = (f"{a.gain:.3g}", f"{math.degrees(a.phase):.3g}", f"{a.crossover:.3g}", _milliseconds(a.delay))
            rows.append((f"{a.name} at {speed:g} m/s", *cells))
    columns = ("loop at", "gain", "phase [deg]", "crossover [rad/s]", "delay")
    return tabulate("Margins of each loop with the others closed.", columns, rows)


def _spread(speed: float, rows: Sequence[tuple[str, str, str]]) -> Table:
    cells = tuple((name, strays, known) for name, strays, known in rows)
    return tabulate(f"Standard deviations at {speed:g} m/s.", ("state", "strays", "known to"), cells)
