"""What a report is made of, before it is a page: sections of text, lists, tables and figures."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from swashplate.extras import version_of
from swashplate.reporting.versions import date

Spec = Mapping[str, Any]
"""A plotly figure as JSON types: `data` and `layout`."""


@dataclass(frozen=True)
class Text:
    """One paragraph; `tone` is "plain", "good", "caution" or "bad"."""

    kind: ClassVar[str] = "text"
    words: str
    tone: str = "plain"


@dataclass(frozen=True)
class Points:
    """A list of short statements."""

    kind: ClassVar[str] = "points"
    items: tuple[str, ...]
    title: str = ""
    ordered: bool = False


@dataclass(frozen=True)
class Cell:
    """One cell of a table.

    Attributes:
        words: what it shows.
        number: True for right-aligned figures.
        tone: "plain", "good", "caution", "bad" or "quiet"; never the only carrier of the meaning.
        strong: True where the cell is the best of its row.
        link: identifier on the page that it leads to ("" for none).
        anchor: identifier that other cells lead to ("" for none).
    """

    words: str
    number: bool = False
    tone: str = "plain"
    strong: bool = False
    link: str = ""
    anchor: str = ""


@dataclass(frozen=True)
class Table:
    """Rows under named columns; the first cell of a row is its heading.

    Attributes:
        caption: what the table says, also for those who do not see it.
        columns: headings.
        rows: cells, one per column.
        groups: headings above the headings, as (words, number of columns).
        note: how to read it.
    """

    kind: ClassVar[str] = "table"
    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    groups: tuple[tuple[str, int], ...] = ()
    note: str = ""

    def __post_init__(self) -> None:
        widths = {len(row) for row in self.rows} | {len(self.columns)}
        if len(widths) > 1 or (self.groups and sum(n for _, n in self.groups) != len(self.columns)):
            raise ValueError(f"table '{self.caption}' has rows of different lengths: {sorted(widths)}")


Row = tuple[Cell | str, ...]
_NUMBER = re.compile(r"[<>±+\-−–~ ]*(\d[\d.,]*(e[+-]?\d+)?(?![A-Za-z0-9_]|/[a-z])|∞|$)")


def tabulate(
    caption: str,
    columns: Iterable[str],
    rows: Iterable[Iterable[Cell | str]],
    *,
    groups: tuple[tuple[str, int], ...] = (),
    note: str = "",
) -> Table:
    """A table from its rows; a text that begins as a number does (1/s does not), or "–", stands at the right."""
    cells = tuple(
        tuple(Cell(c, bool(c and _NUMBER.match(c))) if isinstance(c, str) else c for c in row) for row in rows
    )
    return Table(caption, tuple(columns), cells, groups, note)


@dataclass(frozen=True)
class Key:
    """One entry of a figure's key: `style` is "solid", "dash", "dot", "band", "bar" or a marker's name."""

    words: str
    color: str
    style: str = "solid"


@dataclass(frozen=True)
class Figure:
    """A plot that a person can zoom.

    Attributes:
        identifier: unique on the page.
        spec: what plotly draws.
        caption: what to look at.
        alt: what is seen, for those who do not see it.
        keys: what the lines mean.
        min_width: below this width [px] the plot scrolls in its own box.
    """

    kind: ClassVar[str] = "figure"
    identifier: str
    spec: Spec
    caption: str
    alt: str
    keys: tuple[Key, ...] = ()
    min_width: int = 0

    @property
    def height(self) -> int:
        """Pixels."""
        return int(self.spec["layout"]["height"])


Block = Text | Points | Table | Figure


@dataclass(frozen=True)
class Section:
    """A part of the report; `folded` ones open on a click (and in print)."""

    identifier: str
    title: str
    blocks: tuple[Block, ...]
    folded: bool = False


@dataclass(frozen=True)
class Report:
    """A whole report.

    Attributes:
        title: heading of the page.
        banners: what must be seen before anything else, as (tone, words), most important first.
        summary: five lines, as (label, words, tone).
        picture: the one figure of the summary.
        sections: everything else.
        verdict: a line for each axis, beside the picture; None for none.
        made: when and by what, one line.
    """

    title: str
    banners: tuple[tuple[str, str], ...]
    summary: tuple[tuple[str, str, str], ...]
    picture: Figure | None
    sections: tuple[Section, ...]
    verdict: Table | None = None
    made: str = field(default_factory=lambda: f"swashplate {version_of('swashplate')}, {date()}")

    @property
    def figures(self) -> tuple[Figure, ...]:
        """Every figure in the order of the page."""
        pictures = (self.picture,) if self.picture else ()
        return pictures + tuple(b for section in self.sections for b in section.blocks if isinstance(b, Figure))

    def __post_init__(self) -> None:
        names = [section.identifier for section in self.sections] + [figure.identifier for figure in self.figures]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:  # a plot would be drawn over the section of its name
            raise ValueError(f"two parts of the report are called {', '.join(twice)}")
