"""The commit that this code is of: what a wheel was built from, or where a checkout stands. Without the package's own
imports, for the build too."""

from __future__ import annotations

import re
from pathlib import Path

BUILT = "commit.txt"
"""Beside this file in a wheel."""


def commit() -> str:
    """Twelve digits, with words where a checkout may hold more than that commit; "" where nothing says it."""
    here = Path(__file__).parent
    try:
        return (here / BUILT).read_text(encoding="ascii").strip()
    except (OSError, UnicodeError):
        at = commit_of(here.parent.parent)
        return f"{at} or later (a checkout)" if at else ""


def commit_of(checkout: Path) -> str:
    """Twelve digits of the commit that a git checkout stands at, "" where it is none."""
    place = checkout / ".git"
    try:
        if place.is_file():  # one of several work trees
            place = checkout / place.read_text(encoding="utf-8").removeprefix("gitdir:").strip()
        shared = place / "commondir"
        common = place / shared.read_text(encoding="utf-8").strip() if shared.is_file() else place
        head = (place / "HEAD").read_text(encoding="utf-8").strip()
        if head.startswith("ref: "):
            name = head.removeprefix("ref: ")
            loose = [folder / name for folder in (place, common) if (folder / name).is_file()]
            packed = (common / "packed-refs").read_text(encoding="utf-8") if not loose else ""
            line = re.search(rf"^(\w+) {re.escape(name)}$", packed, re.MULTILINE)
            head = loose[0].read_text(encoding="utf-8").strip() if loose else line[1] if line else ""
    except (OSError, UnicodeError):
        return ""
    return head[:12] if re.fullmatch(r"[0-9a-f]{40,64}", head) else ""
