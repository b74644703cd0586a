"""Mappings that a person has made on the page, kept by the columns of their tables: the next log opens by itself."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import platformdirs

from swashplate.atomic import write_text
from swashplate.errors import SwashError
from swashplate.flights.readers.source import Source, open_source
from swashplate.flights.readers.table_guess import mapping_text, table_in
from swashplate.flights.readers.table_layout import ColumnTable

_LINES = 400
"""Lines of a text from which its columns are known."""


def folder() -> Path:
    """Where they are kept."""
    return Path(platformdirs.user_config_dir("swashplate", appauthor=False)) / "mappings"


def keep(table: ColumnTable, mapping: Mapping[str, Any]) -> Path:
    """Keep a mapping for tables with these columns; returns its file.

    Raises:
        OSError: where the folder cannot be written to.
    """
    place = folder()
    place.mkdir(parents=True, exist_ok=True, mode=0o700)
    return write_text(place / f"{_print_of(table)}.toml", mapping_text(mapping))


def kept(path: Path) -> Path | None:
    """The mapping for a log's columns, None where none is kept or the file is no table."""
    if not path.is_file() or not folder().is_dir() or not any(folder().glob("*.toml")):
        return None
    try:
        source = open_source(path)
        if source.text is not None:  # a long table is not read for its head
            source = Source(path, "\n".join(source.text.split("\n", _LINES)[:_LINES]).encode())
        table = _headed(source)
    except SwashError:
        return None
    if table is None:
        return None
    place = folder() / f"{_print_of(table)}.toml"
    return place if place.is_file() else None


def _headed(source: Source) -> ColumnTable | None:
    try:
        return table_in(source, {})
    except SwashError:
        return table_in(source, {"header": False})


def _print_of(table: ColumnTable) -> str:
    """What tells one layout of columns from another: names, units beside them, and how many."""
    said = "\x1f".join([str(table.width), *table.header, "\x1e", *table.units])
    return hashlib.sha256(said.encode()).hexdigest()[:24]
