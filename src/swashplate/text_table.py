"""Tables as plain text: what results print. No number is broken: a table too wide for the terminal is stacked."""

from __future__ import annotations

import shutil
import sys
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from swashplate.visible import visible

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions
    from rich.text import Text

_GAP = "  "
_FOLDED = 16
"""Characters that a column of words may be folded to."""
_EMPTY = ("", "-")
"""Cells that say nothing: a column of them is left out before anything is stacked."""
Numbered = list[tuple[int, int]]
"""Columns by place, with their widths."""


def screen_width() -> int | None:
    """Columns of the terminal; None for a pipe or a file, where any line fits."""
    try:
        return shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    except ValueError:  # a closed stream
        return None


@dataclass(frozen=True)
class TextTable:
    """Columns of text under their headings.

    Attributes:
        head: of the columns.
        rows: cells.
        left: columns of words, from the left; the others are numbers, from the right.
        keys: so many columns in front say what a row is, and stand again where the others are stacked.
        title: a line above it.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    left: Sequence[int] = (0,)
    keys: int = 1
    title: str = ""

    def lines(self, width: int | None) -> Iterator[tuple[bool, str]]:
        """Its lines, and whether each is a heading, within `width` columns (None: however wide)."""
        if self.title:
            yield from ((False, line) for line in self.title.split("\n"))
        shown = replace(self, head=_visible(self.head), rows=[_visible(row) for row in self.rows])
        for number, block in enumerate(shown._blocks(width)):
            if number:
                yield False, ""
            for k, row in enumerate((shown.head, *shown.rows)):
                for line in shown._row(row, block):
                    yield k == 0, line

    def text(self, width: int | None) -> str:
        """The same as one text."""
        return "\n".join(line for _, line in self.lines(width))

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        from rich.text import Text

        for heading, line in self.lines(options.max_width):
            yield Text(line, style="bold" if heading else "", no_wrap=True, overflow="ignore")

    def _blocks(self, width: int | None) -> list[Numbered]:
        natural = [max(map(len, column)) for column in zip(self.head, *self.rows, strict=True)]
        whole = list(enumerate(natural))
        if width is None or _total(whole) <= width:
            return [whole]
        whole = [(i, w) for i, w in whole if i < self.keys or any(row[i] not in _EMPTY for row in self.rows)]
        if _total(whole) <= width:
            return [whole]
        words = {place for place in self.left if place >= self.keys}
        least = [(i, min(w, max(_FOLDED, len(self.head[i]))) if i in words else w) for i, w in whole]
        keys, rest = least[: self.keys], least[self.keys :]
        blocks: list[Numbered] = [[]]
        for column in rest:
            if blocks[-1] and _total([*keys, *blocks[-1], column]) > width:
                blocks.append([])
            blocks[-1].append(column)
        return [_grown([*keys, *block], natural, width) for block in blocks]

    def _row(self, row: Sequence[str], block: Numbered) -> Iterator[str]:
        cells = [textwrap.wrap(row[i], w) or [""] if len(row[i]) > w else [row[i]] for i, w in block]
        for part in range(max(map(len, cells))):
            line = (
                cell[part].ljust(w) if i in self.left and part < len(cell)
                else cell[part].rjust(w) if part < len(cell)
                else " " * w
                for cell, (i, w) in zip(cells, block, strict=True)
            )  # fmt: skip
            yield _GAP.join(line).rstrip()


def _visible(row: Sequence[str]) -> list[str]:
    return [visible(cell) for cell in row]


def _total(block: Numbered) -> int:
    return sum(width for _, width in block) + len(_GAP) * (len(block) - 1)


def _grown(block: Numbered, natural: Sequence[int], width: int) -> Numbered:
    """What of the width is left goes to the columns that were folded, the last one first."""
    grown = list(block)
    for at, (i, least) in reversed(list(enumerate(block))):
        grown[at] = (i, least + max(0, min(width - _total(grown), natural[i] - least)))
    return grown


def text_table(head: Sequence[str], rows: Sequence[Sequence[str]], *, left: Sequence[int] = (0,), keys: int = 1) -> str:
    """A `TextTable` as text, as wide as the screen has room."""
    return TextTable(head, rows, left, keys).text(screen_width())


def text_columns(
    head: Iterable[str],
    rows: Iterable[Iterable[str]],
    *,
    left: int = 1,
    words: Iterable[int] = (),
    keys: int = 1,
    title: str | None = None,
) -> TextTable:
    """Text cells as a table; the first `left` columns and those of `words` are words, the others numbers.

    Where it is too wide the first `keys` columns stand again before the rest.
    """
    return TextTable(tuple(head), [tuple(row) for row in rows], (*range(left), *words), keys, title or "")
