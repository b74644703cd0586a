"""Rows of cells from text with separators, and numbers from cells, with the place of what does not parse."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError


def separator(text: str) -> str:
    """The separator of some lines: of comma, semicolon and tab the one of which every line has as many.

    Where none is so regular it is the one that the lines have most of, and a space where there is none of them.
    Decimals written with a comma are thereby told from commas that separate.
    """
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    counts = {mark: {line.count(mark) for line in lines} for mark in ",;\t"}
    regular = [mark for mark, found in counts.items() if len(found) == 1 and found != {0}]
    return max(regular or ",;\t", key=text.count) if any(mark in text for mark in ",;\t") else " "


def rows_of(text: str, *, where: str, delimiter: str | None = None) -> list[list[str]]:
    """Cells by line, stripped of spaces; empty lines stay as empty rows.

    Args:
        delimiter: the separator; found in the first lines where None. A space stands for any number of them.
    """
    chosen = delimiter or separator("\n".join(text.split("\n", 40)[:40]))
    if chosen == " ":
        return [line.split() for line in text.splitlines()]
    try:
        head, _, body = text.partition("\n")
        bare = _is_bare(body)  # then nothing but the separator and line ends is to be looked for: twice as fast
        rows = list(csv.reader(io.StringIO(f"{head}\n" if bare else text, newline=""), delimiter=chosen))
        stripped = [[cell.strip() for cell in row] for row in rows]
        return stripped + [line.split(chosen) if line else [] for line in body.splitlines()] if bare else stripped
    except (csv.Error, TypeError) as error:  # TypeError: a delimiter that is not one character
        raise FlightError(f"does not read as a table: {error}.", where=where, hint="Export it again.") from None


def _is_bare(text: str) -> bool:
    """Whether there is no space about any cell, as in a large table of numbers; a quoted line end counts as one."""
    return text.isascii() and not any(mark in text for mark in ' \t\v\f\x1c\x1d\x1e\x1f"')


def number(cell: str) -> float:
    """A cell as a number, NaN where it is blank.

    Raises:
        ValueError: where it is neither.
    """
    if "_" in cell:
        raise ValueError(cell)  # Python reads 1_0 as ten; no log means that
    return float(cell) if cell else float("nan")


def column(rows: Sequence[Sequence[str]], index: int, *, name: str, where: str, first_line: int) -> Array:
    """One column as numbers, shape (n,); blank or missing cells are NaN.

    Args:
        first_line: line number of the first row in the file, for the error.

    Raises:
        FlightError: where a cell is not a number, naming its line.
    """
    cells = [row[index] if index < len(row) else "" for row in rows]
    try:
        if "_" not in "".join(cells):  # see `number`
            return np.fromiter(map(float, cells), dtype=np.float64, count=len(cells))
    except ValueError:  # a blank, or what is no number: which one is told below
        pass
    values = np.empty(len(rows))
    for i, cell in enumerate(cells):
        try:
            values[i] = number(cell)
        except ValueError:
            raise FlightError(
                f"'{cell[:40]}' in line {first_line + i} is not a number.",
                where=where,
                channel=name,
                hint="Correct the cell; decimals are written with a point.",
            ) from None
    return values
