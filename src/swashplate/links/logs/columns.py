"""The columns of a table on the page: what each may be, and the mapping that a person makes of them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import SwashError
from swashplate.flights import units
from swashplate.flights.readers.read import read as read_log
from swashplate.flights.readers.source import open_source
from swashplate.flights.readers.table_guess import Guess, guessed, mapping_of, mapping_text
from swashplate.flights.readers.table_layout import ColumnTable
from swashplate.flights.schema import CHANNELS
from swashplate.links.logs.bins import extremes
from swashplate.links.logs.kept_mappings import keep
from swashplate.links.logs.opened import Opened

_POINTS = 120
"""Bins of a column's small curve."""
_MOST = 300
_FAULT = re.compile(r"\(\d+\) ")
Row = tuple[int, str, str, float, float]
"""A column's index, its channel ("" for none), unit, factor and offset."""


def columns_of(opened: Opened) -> dict[str, Any]:
    """The table of a file with its guesses, and the channels and units that there are.

    Raises:
        SwashError: where the file is no table.
    """
    table, chosen = _table(opened)
    kept = opened.read_mapping().get("channels", {})
    if kept:
        chosen = [_as_kept(guess, kept) for guess in chosen]
    return {
        "columns": [_column(table, guess) for guess in chosen[:_MOST]],
        "rows": len(table),
        "timed": any(guess.channel == "time" for guess in chosen),
        "rate": opened.read_mapping().get("rate"),
        "channels": [
            {"name": name, "unit": known.unit, "about": known.description} for name, known in CHANNELS.items()
        ],
        "units": {name: list(entry) for name, entry in units.known().items()},
        "problem": opened.problem,
    }


def apply_columns(opened: Opened, rows: Sequence[Row], rate: float) -> dict[str, Any]:
    """Read a log with a mapping, and keep it for the next log with the same columns; else every fault of it.

    Args:
        rows: what each column is. rate: [Hz], 0 where a column is the time.

    Raises:
        SwashError: where the file is no table.
    """
    table, guesses = _table(opened)
    names = {guess.index: guess.name for guess in guesses}
    chosen = [Guess(i, names.get(i, ""), name, unit, factor, offset) for i, name, unit, factor, offset in rows]
    twice = {guess.channel for guess in chosen if [g.channel for g in chosen].count(guess.channel) > 1}
    if twice:
        return {"faults": [f"{name}: two columns are this channel; it can be one." for name in sorted(twice)]}
    mapping = mapping_of(chosen, rate=rate or None, headed=bool(table.header))
    try:
        read_log(opened.path, mapping=mapping)
    except SwashError as error:
        return {"faults": _faults(error)}
    path = keep(table, mapping)
    opened.load(opened.read.with_mapping(str(path)))
    return {"faults": [opened.problem] if opened.problem else [], "text": mapping_text(mapping), "path": str(path)}


def _faults(error: SwashError) -> list[str]:
    """Each fault of a table for itself, and what to do."""
    head, *each = _FAULT.split(error.problem)
    place = f"{error.channel}: " if error.channel else ""
    listed = [text.strip() for text in each] if each else [f"{place}{head.strip()}"]
    return [*listed, *([error.hint] if error.hint else [])]


def _table(opened: Opened) -> tuple[ColumnTable, list[Guess]]:
    layout = guessed(open_source(opened.path))
    if layout is None:
        raise SwashError("is no table: its channels are known.", where=opened.read.file)
    return layout


def _as_kept(guess: Guess, kept: dict[str, Any]) -> Guess:
    """A column as the mapping has it that the log was read with."""
    for name, entry in kept.items():
        if entry.get("column") in (guess.name, guess.index + 1):
            unit, factor, offset = (entry.get("unit", ""), entry.get("factor", 1.0), entry.get("offset", 0.0))
            return Guess(guess.index, guess.name, name, unit, factor, offset, "the mapping")
    return Guess(guess.index, guess.name, "", guess.unit)


def _column(table: ColumnTable, guess: Guess) -> dict[str, Any]:
    values: Array | None = None
    try:
        values = table.numbers(guess.index, name=guess.name or str(guess.index + 1))
    except SwashError:
        first: list[str] = table.texts(guess.index)[:3]
    else:
        first = [f"{value:.6g}" for value in values[np.isfinite(values)][:3]]
    drawn = (
        np.zeros(0) if values is None else values[extremes(values, _POINTS)] if len(values) > 2 * _POINTS else values
    )
    return {
        "index": guess.index,
        "name": guess.name,
        "channel": guess.channel,
        "unit": units.usual(guess.unit),
        "factor": guess.factor,
        "offset": guess.offset,
        "why": guess.why,
        "first": first,
        "values": drawn,
    }
