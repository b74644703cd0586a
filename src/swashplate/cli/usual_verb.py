"""Groups whose most used verb need not be typed: `swash bench RECORDS` is `swash bench evaluate RECORDS`."""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path
from typing import Any

from typer.core import TyperGroup


def usual(verb: str) -> type[TyperGroup]:
    """A group that takes `verb` where the first word is none of its verbs, nor like one, nor an option."""

    class Usual(TyperGroup):
        def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
            first = args[0] if args else "-"
            mistyped = get_close_matches(first, list(self.commands)) and not Path(first).exists()
            theirs = first.startswith("-") or first in self.commands or mistyped
            return super().parse_args(ctx, args if theirs else [verb, *args])

    return Usual
