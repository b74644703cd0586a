"""How far a command is, as lines on standard error that another program reads (the live page, of what it started)."""

from __future__ import annotations

import json
import os
from typing import Any, NamedTuple

SWITCH = "SWASHPLATE_PROGRESS"
"""Environment variable; with the value "lines" commands tell their progress this way, quiet or not."""
_MARK = "swash-progress "


class Told(NamedTuple):
    """What is being done, how much of it is done, and out of how much; None where that is not known."""

    what: str
    done: float
    total: float | None


def wanted() -> bool:
    """Whether whoever started this process asked for lines."""
    return os.environ.get(SWITCH) == "lines"


def line(told: Told) -> str:
    """A line, without its break."""
    return _MARK + json.dumps(told)


def parse(text: str) -> Told | None:
    """What a line tells, or None where it is something else."""
    if not text.startswith(_MARK):
        return None
    try:
        entries: Any = json.loads(text[len(_MARK) :])
        what, done, total = entries
        return Told(str(what), float(done), None if total is None else float(total))
    except (TypeError, ValueError):
        return None
