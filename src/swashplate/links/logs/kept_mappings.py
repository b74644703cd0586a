"""Mappings that a person has made, on the page or by `swash inspect --map`, kept by the columns of their tables.

The next log with the same columns opens by itself.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import platformdirs

from swashplate.atomic import write_text
from swashplate.errors import FlightError, SwashError
from swashplate.flights.readers.options import load_mapping
from swashplate.flights.readers.read import read
from swashplate.flights.readers.source import Source, open_source
from swashplate.flights.readers.table_guess import Guess, guessed, mapping_of, mapping_text, table_in
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


@dataclass(frozen=True)
class MappedTable:
    """What the columns of a table were taken for.

    Attributes:
        rows: of each column its name, channel, unit, factor, offset and what the guess rests on.
        text: the mapping, as the file that --mapping takes. path: where it is kept; None where `faults` forbid it.
        faults: all that is wrong with the table under this mapping.
    """

    rows: tuple[Guess, ...]
    text: str
    path: Path | None
    faults: tuple[str, ...]

    def __str__(self) -> str:
        lines = []
        for row in self.rows:
            scale = f" x {row.factor:g}" * (row.factor != 1.0) + f" {row.offset:+g}" * (row.offset != 0.0)
            meant = f"{row.channel}{f' [{row.unit}]' if row.unit else ''}{scale}" if row.channel else "not read"
            lines.append(f"  {row.name or row.index + 1} -> {meant}{f' ({row.why})' if row.why else ''}")
        if self.path is None:
            kept_at = "It does not read like this: correct it, and give it with --map --mapping FILE."
        else:
            kept_at = f"Kept in {self.path}: logs with these columns are read so. Correct it there, or give --mapping."
        return "\n".join(["columns:", *lines, "", self.text, kept_at])

    def to_document(self) -> dict[str, object]:
        """As plain JSON types."""
        return {
            "columns": [asdict(row) for row in self.rows],
            "mapping": self.text,
            "path": None if self.path is None else str(self.path),
            "faults": list(self.faults),
        }


def map_table(path: Path, given: Path | None = None) -> MappedTable:
    """Guess the columns of a table, and keep the mapping if the table reads with it.

    Args:
        given: a mapping file that is kept in the guesses' stead.

    Raises:
        FlightError: where the file is no table.
    """
    source = open_source(path)
    guess = guessed(source)
    if guess is None:
        raise FlightError("is no table: its channels are known.", where=path, channel="--map")
    table, rows = guess
    mapping = load_mapping(given) if given is not None else mapping_of(rows, headed=bool(table.header))
    text = mapping_text(mapping)
    try:
        read(path, mapping=mapping)
    except SwashError as error:
        return MappedTable(tuple(rows), text, None, (str(error),))
    return MappedTable(tuple(rows), text, keep(table, mapping), ())


def _headed(source: Source) -> ColumnTable | None:
    try:
        return table_in(source, {})
    except SwashError:
        return table_in(source, {"header": False})


def _print_of(table: ColumnTable) -> str:
    """What tells one layout of columns from another: names, units beside them, and how many."""
    said = "\x1f".join([str(table.width), *table.header, "\x1e", *table.units])
    return hashlib.sha256(said.encode()).hexdigest()[:24]
