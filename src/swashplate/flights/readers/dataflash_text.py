"""DataFlash logs as text (`.log`): one message a line, described by FMT lines; numbers are in their units already."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from swashplate.flights.readers.dataflash import Messages, MessageTable

_TEXT_LETTERS = frozenset("nNZa")
_FREE_TEXT = "MSG"  # its last cell may hold commas


def is_dataflash_text(text: str | None) -> bool:
    """Whether the first lines hold an FMT line, as "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns"."""
    if text is None:
        return False
    return any(line.startswith("FMT,") and line.count(",") >= 5 for line in text[:8192].split("\n", 40)[:40])


def _table(columns: Sequence[str], letters: str, rows: list[list[str]], places: list[int]) -> tuple[MessageTable, int]:
    """The rows as columns, and how many rows were left out because a number does not parse."""
    kept: list[list[float | str]] = []
    where: list[int] = []
    for row, place in zip(rows, places, strict=True):
        try:
            kept.append([c if k in _TEXT_LETTERS else float(c) for c, k in zip(row, letters, strict=True)])
        except ValueError:
            continue
        where.append(place)
    arrays = {
        name: np.array([row[i] for row in kept], dtype=np.str_ if letters[i] in _TEXT_LETTERS else np.float64)
        for i, name in enumerate(columns)
    }
    return MessageTable(arrays, np.asarray(where, dtype=np.int64)), len(rows) - len(kept)


def messages(text: str) -> Messages:
    """Every message of the text whose line is whole.

    Flight modes may stand as words ("STABILIZE") where the binary log has a number: such a field reads as text.
    """
    formats: dict[str, tuple[str, list[str]]] = {}
    rows: dict[str, list[list[str]]] = {}
    places: dict[str, list[int]] = {}
    torn: list[int] = []
    lines = text.split("\n")
    for number, line in enumerate(lines):
        cells = [cell.strip() for cell in line.split(",")]
        name = cells[0]
        if name == "FMT":
            if len(cells) >= 6:
                formats.setdefault(cells[3], (cells[4], [cell for cell in cells[5:] if cell]))
            continue
        known = formats.get(name)
        if known is None:
            if any(cells):
                torn.append(number)
            continue
        letters, columns = known
        values = cells[1:]
        if name == _FREE_TEXT and len(values) > len(columns):
            values = [*values[: len(columns) - 1], ", ".join(values[len(columns) - 1 :])]
        if len(values) != len(columns) or len(letters) != len(columns):
            torn.append(number)
            continue
        rows.setdefault(name, []).append(values)
        places.setdefault(name, []).append(number)
    tables: dict[str, MessageTable] = {}
    unread = 0
    for name, texts in rows.items():
        letters, columns = formats[name]
        if "M" in letters:  # a mode: number in the binary log, often a word here
            letters = letters.replace("M", "N")
        tables[name], left_out = _table(columns, letters, texts, places[name])
        unread += left_out
    last = len(lines) - 1
    notes = ("the last line is unfinished: not read",) if torn and torn[-1] == last else ()
    torn = torn[: len(torn) - len(notes)]
    damage = []
    if torn:
        damage.append(f"{len(torn)} lines are no whole message (the first is line {torn[0] + 1}): they were skipped")
    if unread:
        damage.append(f"{unread} lines hold something else where a number should stand: they were skipped")
    return Messages({name: table for name, table in tables.items() if len(table)}, notes, tuple(damage))
