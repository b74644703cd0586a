"""Tables as plain text: what results print."""

from __future__ import annotations

from collections.abc import Sequence

_GAP = "  "


def text_table(head: Sequence[str], rows: Sequence[Sequence[str]], *, left: Sequence[int] = (0,)) -> str:
    """Columns of text under their headings.

    Args:
        head: of the columns.
        rows: cells.
        left: columns of words, from the left; the others are numbers, from the right.
    """
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    lines = []
    for row in (head, *rows):
        cells = [
            cell.ljust(width) if place in left else cell.rjust(width)
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append(_GAP.join(cells).rstrip())
    return "\n".join(lines)
