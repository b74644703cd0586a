"""`CaseComparison`: responses, models or fits side by side, as one object that prints, plots and makes a page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from swashplate.reporting.case_parts import CaseParts
from swashplate.reporting.structure import Block, Points, Report, Section
from swashplate.shown import Shown
from swashplate.text_table import text_table


@dataclass(frozen=True, repr=False)
class CaseComparison(Shown):
    """Cases side by side, each against the first.

    Attributes:
        what: "responses", "models" or "results".
        names: of the cases, in their order.
        parts: tables, figures, remarks and numbers.
    """

    what: str
    names: tuple[str, ...]
    parts: CaseParts

    def to_document(self) -> dict[str, object]:
        """The numbers as JSON types."""
        told = {"remarks": list(self.parts.told)}
        return {"what": self.what, "cases": list(self.names), **_plain(self.parts.document), **told}

    def page(self, *, title: str | None = None) -> Report:
        """What `sp.report` writes."""
        blocks: tuple[Block, ...] = (*self.parts.tables, *self.parts.figures)
        remarks = (Section("remarks", "What to know", (Points(self.parts.told),)),) if self.parts.told else ()
        return Report(
            title=title or f"{self.what.capitalize()} of {len(self.names)} cases",
            banners=(),
            summary=(("Cases", ", ".join(self.names), "plain"), ("Against", self.names[0], "plain")),
            picture=None,
            sections=(*remarks, Section("cases", "Side by side", blocks)),
        )

    def __repr__(self) -> str:
        parts = []
        for table in self.parts.tables:
            words = [k for k in range(len(table.columns)) if not any(row[k].number for row in table.rows)]
            body = text_table(table.columns, [[cell.words for cell in row] for row in table.rows], left=words)
            parts.append("\n".join([table.caption, body, *([table.note] if table.note else [])]))
        return "\n\n".join([*parts, *(["\n".join(f"! {text}" for text in self.parts.told)] if self.parts.told else [])])


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return value
