"""The bench's report: every fit as the paper shows its own, what was checked, and the card that came out."""

from __future__ import annotations

import os
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from swashplate.bench.result import Bench, BenchCheck, BenchResult, Curve
from swashplate.reporting.html import write_page
from swashplate.reporting.structure import Block, Cell, Figure, Key, Points, Report, Section, Text, tabulate
from swashplate.reporting.terms import first_screen
from swashplate.reporting.theme import BLACK, GREY, FigurePart, axis, base_layout, dots, line, style, unit_words
from swashplate.reporting.versions import card_hash, versions
from swashplate.reporting.words import counted, listed, sigma_words, value_words

_HEIGHT = 300
_MANY = 200  # samples, from which a line is clearer than markers


def bench_report(bench: Bench, *, path: str | os.PathLike[str]) -> Path:
    """Write one self-contained HTML file about a bench.

    Args:
        bench: result of `evaluate`.
        path: where to write; the folder is made where it is missing.

    Raises:
        SwashError: a place that cannot be written to.
    """
    return write_page(path, compose_bench(bench))


def compose_bench(bench: Bench) -> Report:
    """The structure of a bench's report."""
    files = list(dict.fromkeys(name for result in bench.details.results for name in result.records))
    doubts = [(result, check) for result in bench.details.results for check in result.checks if not check.good]
    apart = [check for check in bench.details.disagreements if not check.good]
    measured = (
        "No parameter of the card."
        if not bench.names
        else f"{counted(len(bench.names), 'parameter')} by {counted(len(bench.details.results), 'procedure')}."
    )
    kept = f"Published, for want of a record: {listed(bench.details.kept, most=30)}." if bench.details.kept else "None."
    card: tuple[Section, ...] = (_card(bench),) if bench.names else ()
    keeping = (("Kept", kept, "caution" if bench.details.kept else "good"),) if bench.names else ()
    agreement = " ".join(c.text for c in bench.details.disagreements) or "No parameter was measured in two ways."
    summary = (
        ("Records", f"{counted(len(files), 'file')}: {listed(files, most=5)}.", "plain"),
        ("Measured", measured, "plain"),
        *keeping,
        ("Checks", _doubts(doubts), "caution" if doubts else "good"),
        ("Agreement", agreement, "caution" if apart else "plain"),
    )
    sections = (*card, *(_procedure(result, bench) for result in bench.details.results), _provenance(bench))
    picture, sections = first_screen(sections, summary, of="swashplate")
    return Report(
        title=f"{bench.model.card.vehicle} on the test bench" if bench.names else "On the test bench",
        banners=(),
        summary=summary,
        picture=picture,
        sections=sections,
    )


def _doubts(doubts: Sequence[tuple[BenchResult, BenchCheck]]) -> str:
    if not doubts:
        return "Nothing was found that spoils a measurement."
    names = dict.fromkeys(result.title for result, _ in doubts)
    return f"{counted(len(doubts), 'check')} raised a doubt, in: {listed(names)}."


def _card(bench: Bench) -> Section:
    rows = []
    for name in (*bench.names, *bench.details.kept):
        new, old = bench.model.card.parameters[name], bench.start.card.parameters[name]
        measured = name in bench.names
        source = new.source if measured else "published value kept: no record"
        change = (new.value - old.value) / new.sigma if measured and new.sigma else None
        rows.append(
            (
                name,
                unit_words(new.unit),
                value_words(old.value),
                Cell(value_words(new.value, new.sigma) if measured else "–", number=True, strong=measured),
                sigma_words(new.sigma) if measured else "–",
                f"{change:+.1f}" if change is not None else "–",
                Cell(source, tone="plain" if measured else "quiet"),
            )
        )
    note = (
        "σ: from the scatter of the measurements about the formula, and from the bounds of the numbers that a "
        "procedure takes as known. Errors of the sensor's calibration and of the CG's position are not included. "
        "Correlations are on the card."
    )
    columns = ("parameter", "unit", "published", "measured", "σ", "change / σ", "source")
    return Section("card", "The card", (tabulate("Published and measured values", columns, rows, note=note),))


def _procedure(result: BenchResult, bench: Bench) -> Section:
    blocks: list[Block] = [Text(f"Formula: {result.source}. Records: {', '.join(result.records)}.")]
    blocks += _figures(result)
    units = {n: unit_words(bench.model.card.parameters[n].unit) for n in result.names}
    rows = [
        (n, units[n], value_words(float(v), float(s)),
         sigma_words(float(s)))
        for n, v, s in zip(result.names, result.values, result.sigma, strict=True)
    ]  # fmt: skip
    rows += [
        (f"{f.name} (not on the card)", unit_words(f.unit),
         value_words(f.value, f.sigma), sigma_words(f.sigma))
        for f in result.findings
    ]  # fmt: skip
    if rows:
        blocks.append(tabulate(f"{result.title}: result", ("quantity", "unit", "value", "σ"), rows))
    blocks += [tabulate(rows.title, rows.columns, rows.rows) for rows in result.tables]
    doubts = [check.text for check in result.checks if not check.good]
    if doubts:
        blocks += [Text(text, tone="caution") for text in doubts]
    if result.left_out:
        blocks.append(Points(result.left_out, title="Points left out"))
    blocks.append(Points(tuple(c.text for c in result.checks if c.good), title="Checked"))
    return Section(result.procedure, result.title, tuple(blocks), folded=True)


def _figures(result: BenchResult) -> list[Figure]:
    """One figure for each title; curves of one title share it."""
    figures = []
    for number, (_, group) in enumerate(groupby(result.curves, key=lambda curve: curve.title)):
        figures.append(_figure(f"{result.procedure}-{number}", list(group)))
    return figures


def _figure(identifier: str, curves: Sequence[Curve]) -> Figure:
    first = curves[0]
    traces: list[FigurePart] = []
    keys = []
    if len(curves) == 1:
        keys.append(Key("measured", *((GREY, "solid") if first.x.size > _MANY else (BLACK, "circle"))))
    for number, curve in enumerate(curves):
        color, dash = style(number)
        name = curve.name or "fit"
        if curve.x.size > _MANY:
            traces.append(line(curve.x, curve.y, name=f"{name}, measured", color=GREY, width=1.0))
        else:
            marker = {"color": color if len(curves) > 1 else BLACK, "size": 6}
            traces.append(dots(curve.x, curve.y, marker, name=f"{name}, measured"))
        if curve.line_x.size:
            traces.append(line(curve.line_x, curve.line_y, name=name, color=color, dash=dash, width=1.8))
            keys.append(Key(name, color, dash))
        if curve.out_x.size:
            traces.append(dots(curve.out_x, curve.out_y, {"color": GREY, "symbol": "x", "size": 8}, name="left out"))
            keys.append(Key("left out", GREY, "x"))
    layout = base_layout(_HEIGHT)
    layout["xaxis"], layout["yaxis"] = axis(first.x_title), axis(first.y_title)
    return Figure(
        identifier=identifier,
        spec={"data": traces, "layout": layout},
        caption=f"{first.title}: measured (markers or thin grey) and fitted.",
        alt=f"{first.title}: {first.y_title} against {first.x_title}, measured and fitted.",
        keys=tuple(keys),
    )


def _provenance(bench: Bench) -> Section:
    lines = [f"{name} {version}" for name, version in versions().items()]
    cards = {"published": bench.start.card, "measured": bench.model.card}
    lines += [f"{name} card SHA-256 {card_hash(card)}" for name, card in cards.items()]
    return Section("made-with", "How was this made?", (Points(tuple(lines)),), folded=True)
