"""Rows of cells from text with separators, and numbers from cells, with the place of what does not parse.

Decimals may be written with a comma where something else separates the cells: a table in which some cell has such a
comma and none has a point is read so.
"""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError

_SAMPLE = 40  # lines by which separator and decimals are told
_WITH_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
_WITH_POINT = re.compile(r"[+-]?(?:\d+\.\d*|\.\d+)(?:[eE][+-]?\d+)?")
_NO_VALUE = frozenset(("", "na", "n/a", "#n/a", "null", "none", "-", "--"))


def separator(text: str) -> str:
    """The separator of some lines: of comma, semicolon and tab the one of which most lines have equally many.

    Of two that are as regular it is the one that the lines have most of, and a space where there is none of them.
    Decimals written with a comma are thereby told from commas that separate.
    """
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    counts = {mark: Counter(n for line in lines if (n := line.count(mark))) for mark in ",;\t"}
    regular = {mark: max(widths.values()) for mark, widths in counts.items() if widths}
    return max(regular, key=lambda mark: (regular[mark], text.count(mark))) if regular else " "


def rows_of(text: str, *, where: str, delimiter: str | None = None) -> list[list[str]]:
    """Cells by line, stripped of spaces; empty lines stay as empty rows.

    Args:
        delimiter: the separator; found in the first lines where None. A space stands for any number of them.
    """
    chosen = delimiter or separator("\n".join(text.split("\n", _SAMPLE)[:_SAMPLE]))
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


_OF_NUMBERS = b"0123456789+-.eE,;\t \n"
_MOST_HEAD = 100
"""Lines: a table of numbers that begins later is read cell by cell."""


@dataclass(frozen=True)
class NumberRows(Sequence[list[str]]):
    """Rows of nothing but numbers, as many in each: parsed at once, split into cells only where one is asked for.

    Attributes:
        head: the lines before the first row.
        lines: the rows as they stand in the file, decimals with points.
        mark: the separator.
        numbers: shape (rows, columns).
        commas: whether the file has its decimals with commas.
    """

    head: list[str]
    lines: list[str]
    mark: str
    numbers: Array
    commas: bool = False

    @staticmethod
    def of(text: str, *, delimiter: str | None = None) -> NumberRows | None:
        """The rows of a text; None where a cell is blank or no number, or a row is longer than another.

        Python's own numbers are meant, to the last bit (numpy's C parser rounds as `float` does); what is None is read
        by `rows_of`, which says what is wrong and where.
        """
        begin, head = 0, list[str]()
        while len(head) < _MOST_HEAD and (end := text.find("\n", begin)) >= 0:
            if _bare_numbers(text[begin:end].removesuffix("\r")):
                break
            head.append(text[begin:end])
            begin = end + 1
        body = text[begin:].replace("\r\n", "\n").rstrip("\n")
        mark = delimiter or separator("\n".join(text.split("\n", _SAMPLE)[:_SAMPLE]))
        if mark not in tuple(",;\t") or not _bare_numbers(body):
            return None
        commas = mark != "," and "," in body
        if commas and "." in body:
            return None
        lines = (body.replace(",", ".") if commas else body).split("\n")
        try:
            numbers = np.loadtxt(lines, delimiter=mark, comments=None, ndmin=2)
        except ValueError:
            return None
        if len(numbers) < len(lines):  # numpy passes over blank lines
            return None
        return NumberRows(head, lines, mark, numbers, commas)

    def __len__(self) -> int:
        return len(self.lines)

    @overload
    def __getitem__(self, index: int) -> list[str]: ...
    @overload
    def __getitem__(self, index: slice) -> list[list[str]]: ...
    def __getitem__(self, index: int | slice) -> list[str] | list[list[str]]:
        if isinstance(index, slice):
            return [self._cells(line) for line in self.lines[index]]
        return self._cells(self.lines[index])

    def _cells(self, line: str) -> list[str]:
        return [cell.strip() for cell in line.split(self.mark)]

    def texts(self, index: int) -> list[str]:
        """One column as it stands in the file, blank where the rows end before; nothing to its right is split."""
        if index >= self.numbers.shape[1]:
            return [""] * len(self.lines)
        return [line.split(self.mark, index + 1)[index].strip() for line in self.lines]


def _bare_numbers(text: str) -> bool:
    """Whether a text has no character that is not a number's, a separator or a line end, and is not empty."""
    return bool(text) and text.isascii() and not text.encode().translate(None, _OF_NUMBERS)


def texts(rows: Sequence[Sequence[str]], index: int) -> list[str]:
    """One column's cells as text, blank where a row has none."""
    if isinstance(rows, NumberRows):
        return rows.texts(index)
    return [row[index] if index < len(row) else "" for row in rows]


def with_points(rows: Sequence[list[str]]) -> bool:
    """Writes decimals with points where the table has commas, in place; whether it has."""
    cells = [cell for row in rows[:_SAMPLE] for cell in row]
    commas = any(_WITH_COMMA.fullmatch(cell) for cell in cells)
    if not commas or any(_WITH_POINT.fullmatch(cell) for cell in cells):
        return False
    for row in rows:
        for i, cell in enumerate(row):
            if "," in cell and _WITH_COMMA.fullmatch(cell):
                row[i] = cell.replace(",", ".")
            elif "." in cell and _WITH_POINT.fullmatch(cell):
                row[i] = f"{cell} (with a point)"  # a thousand, or a decimal after all: no number that is known
    return True


def number(cell: str) -> float:
    """A cell as a number, NaN where it is blank or says that there is no value.

    Raises:
        ValueError: where it is neither.
    """
    if "_" in cell:
        raise ValueError(cell)  # Python reads 1_0 as ten; no log means that
    return float("nan") if cell.lower() in _NO_VALUE else float(cell)


def is_number(cell: str) -> bool:
    """Whether a cell holds a number, with point or comma."""
    if _WITH_COMMA.fullmatch(cell):
        return True
    try:
        return bool(cell) and number(cell) == number(cell)
    except ValueError:
        return False


def column(rows: Sequence[Sequence[str]], index: int, *, name: str, where: str, lines: Sequence[int]) -> Array:
    """One column as numbers, shape (n,); blank or missing cells are NaN.

    Args:
        lines: line number of each row in the file, for the error.

    Raises:
        FlightError: where cells are no numbers, naming the first one's line and how many there are.
    """
    if isinstance(rows, NumberRows) and index < rows.numbers.shape[1]:
        return rows.numbers[:, index].copy()
    cells = texts(rows, index)
    try:
        if "_" not in "".join(cells):  # see `number`
            return np.fromiter(map(float, cells), dtype=np.float64, count=len(cells))
    except ValueError:  # a blank, or what is no number: which one is told below
        pass
    values, wrong = np.empty(len(cells)), list[int]()
    for i, cell in enumerate(cells):
        try:
            values[i] = number(cell)
        except ValueError:
            wrong.append(i)
    if wrong:
        more = f" ({len(wrong)} of {len(cells)} cells are none)" if len(wrong) > 1 else ""
        raise FlightError(
            f"'{cells[wrong[0]][:40]}' in line {lines[wrong[0]]} is not a number{more}.",
            where=where,
            channel=name,
            hint="Correct the cell; decimals are written with a point, or with a comma in all cells.",
        )
    return values
