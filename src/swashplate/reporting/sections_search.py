"""The section on a search for the structure of a linear model."""

from __future__ import annotations

from swashplate.identification.frequency.search_result import StructureSearch
from swashplate.reporting.structure import Cell, Points, Section, tabulate


def search_section(search: StructureSearch) -> Section:
    """The structures that were tried, and why one was picked."""
    head, *rows = search.rows()
    cells = tuple(
        tuple(
            Cell(f"{text} (picked)" if c is search.pick and k == 0 else text, number=0 < k < len(row) - 1)
            for k, text in enumerate(row)
        )
        for c, row in zip(search.tried, rows, strict=True)
    )
    why = Points(tuple(text.strip() for text in search.reasons), title="Why this one")
    return Section(
        "structures", "Which structures were tried?", (why, tabulate("Structures", head, cells)), folded=True
    )
