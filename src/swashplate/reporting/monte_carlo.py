"""Many flights of one controller as a page: how far they went, which limits they broke, and the worst of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict

import numpy as np

from swashplate.control.draws.spread import SHOWN, Spread
from swashplate.flights.flight import Flight
from swashplate.flights.schema import ATTITUDE, POSITION
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.flight_page import flight_panels
from swashplate.reporting.structure import Cell, Figure, Key, Points, Report, Row, Section, Table, Text, tabulate
from swashplate.reporting.theme import MODEL, VERMILION, FigurePart, axis_number, grid, line
from swashplate.reporting.versions import card_hash
from swashplate.reporting.words import counted

_BINS = 24


def compose_monte_carlo(
    vehicle: Vehicle,
    spread: Spread,
    worst: Flight,
    *,
    title: str,
    late: str,
    drawn: Mapping[str, float],
    remarks: Sequence[str] = (),
) -> Report:
    """The report's structure.

    Args:
        vehicle: what flew.
        spread: of all flights.
        worst: the flight with the number `spread.worst`.
        title: heading.
        late: how late commands were, in words.
        drawn: the worst aircraft's numbers, those that were drawn.
        remarks: what may surprise.
    """
    lost = spread.lost
    losses = f"{lost} of {counted(spread.flights, 'flight')} lost" if lost else f"none of {spread.flights} lost"
    when = float(spread.lost_after[spread.worst])
    ending = f"lost after {when:.2f} s" if math.isfinite(when) else "not lost, furthest from its place"
    numbers = [f"{name} = {value:.5g}" for name, value in drawn.items()]
    return Report(
        title=title,
        banners=(("bad", f"LOST: {losses}; {_by(spread)}"),) if lost else (),
        summary=(
            ("Lost", f"{losses} (limits: {spread.limits.summary_text()})", "bad" if lost else "good"),
            ("Worst", f"number {spread.worst}, {ending}", "plain"),
            ("Commands are late by", late, "plain"),
        ),
        picture=None,
        sections=(
            Section("flights", "How far they went", (_table(spread), _figure(spread), *map(Text, remarks))),
            Section(
                "worst",
                f"The worst flight, number {spread.worst}",
                (
                    flight_panels(worst, (*POSITION, *ATTITUDE, "p", "q", "r"), identifier="worst", caption=_WORST),
                    flight_panels(worst, vehicle.input_names, identifier="commands", caption="What its actuators got."),
                    *((Points(tuple(numbers), "Its own numbers"),) if numbers else ()),
                ),
            ),
            Section("made", "Made from", (Points((f"model: {vehicle.card.title} ({card_hash(vehicle.card)})",)),)),
        ),
    )


_WORST = "The flight that went furthest beyond a limit; where none was lost, furthest from its place."


def _by(spread: Spread) -> str:
    return ", ".join(f"{name}: {count}" for name, count in spread.lost_by.items() if count)


def _table(spread: Spread) -> Table:
    limits, figures, counts = asdict(spread.limits), spread.figures, spread.lost_by
    rows: list[Row] = []
    for name, values in figures.items():
        key = name.split(",")[0]
        judged = name != "place, rms [m]"
        bound = limits[key] * SHOWN[key][1] if judged else math.inf
        beyond = counts[key] if judged else 0
        rows.append(
            (
                name,
                *(Cell(f"{v:.4g}", True, "bad" if v > bound else "plain") for v in values),
                f"{bound:.4g}" if math.isfinite(bound) else "none",
                Cell(str(beyond) if judged else "", True, "bad" if beyond else "plain"),
            )
        )
    return tabulate(
        "Percentiles over all flights, lost ones too; beyond its limit a flight is lost.",
        ("figure", *(f"{p:g} %" for p in spread.percentiles), "limit", "flights beyond"),
        tuple(rows),
        note="An infinite figure is of a flight that diverged.",
    )


def _figure(spread: Spread) -> Figure:
    """How many flights went how far, by limit; the limit dashed."""
    limits = asdict(spread.limits)
    layout: FigurePart = grid(
        [f"{n} [{u}]" for n, (u, _) in SHOWN.items()],
        columns=2,
        height=190,
        x_title="largest of a flight",
        y_title="flights [-]",
    )
    traces: list[FigurePart] = []
    for i, (name, (_, factor)) in enumerate(SHOWN.items()):
        axis = axis_number(i)
        values, bound = factor * spread.values[name], factor * limits[name]
        finite = values[np.isfinite(values)]
        counts, edges = np.histogram(finite, bins=_BINS) if finite.size else (np.zeros(1, int), np.array([0.0, 1.0]))
        x, y = np.repeat(edges, 2)[1:-1], np.repeat(counts, 2).astype(float)
        traces.append(line(x, y, name=name, color=MODEL, axis=axis))
        if math.isfinite(bound):
            traces.append(line((bound, bound), (0.0, float(counts.max())), name="limit", color=VERMILION, dash="dash",
                               axis=axis))  # fmt: skip
    diverged = int(np.sum(~np.isfinite(spread.values["place"])))
    left_out = f" {counted(diverged, 'flight')} that diverged have no place here." if diverged else ""
    return Figure(
        "flights-spread",
        {"data": traces, "layout": layout},
        f"Number of flights over the largest that each reached.{left_out}",
        "Histograms of the largest lean, rate, distance, height error and heading error of every flight.",
        keys=(Key("flights", MODEL), Key("limit", VERMILION, "dash")),
    )
