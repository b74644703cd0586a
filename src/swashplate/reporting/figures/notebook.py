"""Results as notebooks show them: a heading, what is to be warned of, the main figure, a table."""

from __future__ import annotations

import base64
import io
from html import escape
from typing import Any

from swashplate.errors import MissingLibraryError
from swashplate.reporting.figures.still import still
from swashplate.reporting.figures.views import section_of
from swashplate.reporting.structure import Figure, Table, Text

_MOST_ROWS = 40
_DPI = 110


def html_of(shown: Any) -> str:
    """An object as HTML: text from files can only become text, and the picture is in the page."""
    section = section_of(shown)
    parts = [f"<p><b>{escape(section.title)}</b></p>"]
    figure = next((block for block in section.blocks if isinstance(block, Figure)), None)
    for block in section.blocks:
        if isinstance(block, Text):
            parts.append(
                f"<p><b>!</b> {escape(block.words)}</p>"
                if block.tone != "plain"
                else f"<pre>{escape(block.words)}</pre>"
            )
        elif isinstance(block, Table):
            parts.append(_table(block))
        elif block is figure:
            parts.append(_picture(block))
    return f"<div>{''.join(parts)}</div>"


def _table(table: Table) -> str:
    heads = "".join(f"<th>{escape(heading)}</th>" for heading in table.columns)
    rows = "".join(
        f"<tr>{''.join(f'<td>{escape(cell.words)}</td>' for cell in row)}</tr>" for row in table.rows[:_MOST_ROWS]
    )
    more = len(table.rows) - _MOST_ROWS
    left = f"<p>... and {more} more rows</p>" if more > 0 else ""
    return f"<table><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table>{left}"


def _picture(figure: Figure) -> str:
    drawn = io.BytesIO()
    try:
        still([figure], theme="light").savefig(drawn, format="png", dpi=_DPI)
    except MissingLibraryError as error:  # words and tables are worth showing without the picture
        return f"<p><b>!</b> {escape(str(error))}</p>"
    text = base64.b64encode(drawn.getvalue()).decode("ascii")
    return f'<img alt="{escape(figure.alt, quote=True)}" src="data:image/png;base64,{text}">'
