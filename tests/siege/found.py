"""What a campaign found, in the form of a section of docs/proof.md."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]


@dataclass
class Found:
    """A table, and what should not have been.

    Attributes:
        title, text, columns, rows: of the section.
        bad: one line for each thing that should not have happened; none is a pass.
    """

    title: str
    text: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]
    bad: list[str] = field(default_factory=list)

    def to_document(self) -> dict[str, Any]:
        told = "" if not self.bad else " First: " + "; ".join(self.bad[:5]) + "."
        return {
            "title": self.title,
            "text": self.text + told,
            "columns": list(self.columns),
            "rows": [list(row) for row in self.rows],
            "passed": not self.bad,
        }


_told = [0.0]


def progress(text: str) -> bool:
    """A line on the screen, every half minute; whether it was said now."""
    if time.monotonic() - _told[0] <= 30.0:
        return False
    _told[0] = time.monotonic()
    print(text, file=sys.stderr, flush=True)
    return True
