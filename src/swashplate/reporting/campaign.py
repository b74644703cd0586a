"""A campaign as a page: how its figures are spread, how sure their quantiles are, the worst rows, what failed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.reporting.structure import Block, Cell, Figure, Key, Report, Section, Table, Text, tabulate
from swashplate.reporting.theme import FLIGHT, MODEL, VERMILION, FigurePart, axis_number, grid, line
from swashplate.reporting.words import counted

_BINS = 40
_POINTS = 24
_DIGITS = tuple("+-.0123456789")


class WorstRow(NamedTuple):
    """One row of a campaign: its number, its task's seed, how bad it was in the shown unit, and what shows it again."""

    number: int
    seed: int
    value: float
    command: str


@dataclass(frozen=True)
class FailedTask:
    """A task that was given up: its rows, its seed, what it was about, and what was said at each try."""

    first: int
    count: int
    seed: int
    of: str
    tries: tuple[str, ...]


@dataclass(frozen=True)
class Shape:
    """How a figure is spread over the rows.

    Attributes:
        name, unit: of the figure. values: of all rows in that unit, infinite where one diverged, NaN where none is.
        quantiles: value, and the ends of its interval, each.
    """

    name: str
    unit: str
    values: Array
    quantiles: Sequence[tuple[float, float, float]]


def compose_campaign(
    title: str,
    *,
    standing: str,
    rows: str,
    summary: Sequence[tuple[str, str, str]],
    careful: Sequence[str],
    shares: Sequence[float],
    shapes: Sequence[Shape],
    worst: Sequence[WorstRow],
    worst_by: str,
    folder: str,
    tables: Sequence[tuple[str, tuple[str, ...], tuple[tuple[str, ...], ...]]],
    failed: Sequence[FailedTask],
    refused: Sequence[str] = (),
) -> Report:
    """The report's structure.

    Args:
        title: heading. standing: how far the campaign is, in words. rows: what a row is ("flight").
        summary, careful: of its kind. shares: of the quantiles (0 to 1). shapes: of what is shown.
        worst: rows, the worst first. worst_by: by what, with its unit. folder: of the campaign.
        tables: of its kind: caption, headings, cells.
        failed: tasks that were given up. refused: results that are not what was computed, each in words.
    """
    count = max((len(shape.values) for shape in shapes), default=0)
    lost = sum(task.count for task in failed)
    banners = [("bad", f"{counted(lost, rows)} could not be computed and are in no figure below")] if failed else []
    sections = [
        Section(f"table-{k}", caption, (_text_table(caption, head, cells),))
        for k, (caption, head, cells) in enumerate(tables)
    ]
    if shapes:
        blocks: tuple[Block, ...] = (_quantiles(shapes, shares, rows), _spread(shapes, rows))
        sections.append(Section("spread", "How they are spread", blocks))
        sections.append(Section("convergence", "Whether there were enough", (_convergence(shapes, shares, rows),)))
    if worst:
        sections.append(Section("worst", f"The worst by {worst_by}", (_worst(worst, rows, worst_by),)))
    if failed:
        sections.append(Section("failed", "What failed", (_failed(failed, folder),)))
    return Report(
        title=title,
        banners=(*banners, *(("bad", text) for text in refused), *(("caution", text) for text in careful)),
        summary=(("Standing", standing, "plain"), (f"{rows.capitalize()}s", f"{count:,}", "plain"), *summary),
        picture=None,
        sections=tuple(sections),
    )


def _label(shape: Shape) -> str:
    return f"{shape.name} [{shape.unit}]" if shape.unit else shape.name


def _text_table(caption: str, head: tuple[str, ...], cells: tuple[tuple[str, ...], ...]) -> Block:
    return tabulate(
        caption,
        head,
        tuple(tuple(Cell(text, number=k > 0 and text[:1] in _DIGITS) for k, text in enumerate(row)) for row in cells),
    )


def _quantiles(shapes: Sequence[Shape], shares: Sequence[float], rows: str) -> Table:
    cells = []
    for shape in shapes:
        row = [_label(shape)]
        for at, low, high in shape.quantiles:
            row += [f"{at:.4g}", Cell(f"{low:.4g} to {high:.4g}", True, "quiet")]
        cells.append(tuple(row))
    names = tuple(heading for share in shares for heading in (f"{100 * share:g} %", "95 % interval"))
    return tabulate(
        f"Quantiles over all {rows}s, each with its interval.",
        ("figure", *names),
        tuple(cells),
        note="Intervals are by order statistics and assume no distribution; an infinite end means that there "
        f"were too few {rows}s for it, or that some diverged.",
    )


def _spread(shapes: Sequence[Shape], rows: str) -> Figure:
    layout: FigurePart = grid(
        [_label(shape) for shape in shapes], columns=2, height=190, x_title="value", y_title=f"{rows}s [-]"
    )
    traces: list[FigurePart] = []
    diverged = 0
    for k, shape in enumerate(shapes):
        axis = axis_number(k)
        finite = shape.values[np.isfinite(shape.values)]
        diverged = max(diverged, int(np.sum(np.isinf(shape.values))))
        counts, edges = np.histogram(finite, bins=_BINS) if finite.size else (np.zeros(1, int), np.array([0.0, 1.0]))
        x, y = np.repeat(edges, 2)[1:-1], np.repeat(counts, 2).astype(float)
        traces.append(line(x, y, name=shape.name, color=MODEL, axis=axis))
        for at, _, _ in shape.quantiles:
            if math.isfinite(at):
                traces.append(line((at, at), (0.0, float(counts.max())), name="quantile", color=VERMILION, dash="dash",
                                   axis=axis))  # fmt: skip
    left_out = f" {counted(diverged, rows)} without a finite value have no place here." if diverged else ""
    return Figure(
        "campaign-spread",
        {"data": traces, "layout": layout},
        f"Number of {rows}s over the value.{left_out}",
        f"Histograms of {', '.join(shape.name for shape in shapes)} over all {rows}s.",
        keys=(Key(f"{rows}s", MODEL), Key("quantiles of the table", VERMILION, "dash")),
    )


def _convergence(shapes: Sequence[Shape], shares: Sequence[float], rows: str) -> Figure:
    layout: FigurePart = grid(
        [_label(shape) for shape in shapes], columns=2, height=190, x_title=f"{rows}s [-]", y_title="quantile"
    )
    for name in [name for name in layout if name.startswith("xaxis")]:
        layout[name] = {**layout[name], "type": "log"}
    traces: list[FigurePart] = []
    for k, shape in enumerate(shapes):
        axis = axis_number(k)
        values = shape.values[~np.isnan(shape.values)]
        if not values.size:
            continue
        counts = np.unique(np.geomspace(min(10, values.size), values.size, _POINTS).astype(int))
        for share, (_, low, high) in zip(shares, shape.quantiles, strict=True):
            quantiles = np.array([np.quantile(values[:n], share, method="inverted_cdf") for n in counts])
            quantiles = np.where(np.isfinite(quantiles), quantiles, np.nan)
            traces.append(line(counts, quantiles, name=f"{100 * share:g} %", color=MODEL, axis=axis,
                               hover=f"{100 * share:g} %<br>%{{x:.0f}}, %{{y:.4g}}"))  # fmt: skip
            ends = np.array([low, high])
            ends = np.where(np.isfinite(ends), ends, np.nan)
            traces.append(line((counts[-1], counts[-1]), ends, name="interval", color=FLIGHT, width=3.0, axis=axis))
    return Figure(
        "campaign-convergence",
        {"data": traces, "layout": layout},
        f"Quantiles of the first {rows}s, by their number: while a line still moves, more are needed. The bar at its "
        "end is the 95 % interval of all.",
        f"Running quantiles over the number of {rows}s.",
        keys=(Key("quantiles of the table", MODEL), Key("95 % interval", FLIGHT)),
    )


def _worst(worst: Sequence[WorstRow], rows: str, by: str) -> Table:
    cells = tuple((str(row.number), f"{row.value:.5g}", str(row.seed), row.command) for row in worst)
    return tabulate(
        f"The {rows}s to look at first.",
        ("number", by, "seed of its task", "to see it again"),
        cells,
        note="A seed belongs to a whole task: to get a row again, compute all rows of its task.",
    )


def _failed(failed: Sequence[FailedTask], folder: str) -> Block:
    if not failed:
        return Text("None.")
    cells = tuple(
        (
            f"{task.first} to {task.first + task.count - 1}" if task.count > 1 else str(task.first),
            str(task.seed),
            task.of,
            str(len(task.tries)),
            task.tries[-1] if task.tries else "",
        )
        for task in failed
    )
    return tabulate(
        "Tasks that were given up.",
        ("rows", "seed", "of", "tries", "the last said"),
        cells,
        note=f"`swash campaign resume {folder} --retry-failed` tries them again.",
    )
