"""Where a table of text has its header and its data, and which of its rows are whole.

    "firmwareType","Betaflight"        settings: other widths than the table's
    # made by hand                     comments
    time,p,mixer_roll                  names; in a comment too ("# timestamp tx ty tz"), where no other line has them
    s,rad/s,1                          units, where a line says them
    0.000,0.00346,0.00251              data

A row that is longer or shorter than the header says that the columns have changed, or that a line is torn. No cell is
ever read under a name that may not be its own: from a change on nothing is read, a torn line is left out, and both are
told with their share of the rows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights import epoch, units
from swashplate.flights.readers import tables
from swashplate.flights.readers.clocked import Remarks, share

Rows = Sequence[Sequence[str]]

_NUMERIC = frozenset("0123456789-+.")  # with these begins no name


class ColumnTable(Protocol):
    """Columns by number, wherever they come from."""

    @property
    def where(self) -> str:
        """The file."""

    @property
    def header(self) -> Sequence[str]:
        """The cells that name the columns, () where there are none."""

    @property
    def units(self) -> Sequence[str]:
        """What a row of units says, () where there is none."""

    @property
    def lines(self) -> Sequence[int]:
        """What the file calls each row, for messages."""

    @property
    def remarks(self) -> Remarks:
        """What was left out."""

    @property
    def width(self) -> int:
        """How many columns there are."""

    @property
    def aliases(self) -> Mapping[str, int]:
        """Columns by other names than the header's."""

    def __len__(self) -> int: ...

    def numbers(self, index: int, *, name: str) -> Array: ...

    def texts(self, index: int) -> list[str]: ...

    def first(self, index: int) -> str: ...


@dataclass(frozen=True)
class DelimitedTable:
    """A table of text, with rows that fit its header.

    Attributes:
        where, header, units, lines, remarks: as in `ColumnTable`.
        rows: cells of the data.
        preface: the rows before the header.
    """

    where: str
    header: Sequence[str]
    units: Sequence[str]
    rows: Rows
    lines: Sequence[int]
    preface: Rows = ()
    remarks: Remarks = field(default_factory=Remarks)

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def aliases(self) -> Mapping[str, int]:
        return {}

    @property
    def width(self) -> int:
        return len(self.header) or max(map(len, self.rows[:1]), default=0)

    def numbers(self, index: int, *, name: str) -> Array:
        """A column as numbers, NaN where it is blank; a FlightError where a cell is none."""
        return tables.column(self.rows, index, name=name, where=self.where, lines=self.lines)

    def texts(self, index: int) -> list[str]:
        """A column as it stands in the file."""
        return tables.texts(self.rows, index)

    def first(self, index: int) -> str:
        """The column's first cell that is not blank; "" where all are."""
        return next((row[index] for row in self.rows if index < len(row) and row[index]), "")


@dataclass(frozen=True)
class _Head:
    """Row numbers: `names` (−1 for none), `units` (−1), the first of `data`; the header's cells."""

    data: int
    names: int = -1
    units: int = -1
    cells: Sequence[str] = ()


def read_table(text: str, *, where: str, mapping: Mapping[str, Any]) -> DelimitedTable:
    """The table in a text.

    Args:
        mapping: may say `delimiter`, and `header = false` where the first row is data.

    Raises:
        FlightError: where there is no table, or its first rows do not fit its header.
    """
    delimiter = mapping.get("delimiter")
    if delimiter is not None and not (isinstance(delimiter, str) and len(delimiter) == 1):
        raise FlightError(f"delimiter = {delimiter!r} in the mapping is not one character.", where=where)
    headed = mapping.get("header", True) is not False
    remarks = Remarks()
    quick = tables.NumberRows.of(text, delimiter=delimiter)
    if quick is not None:
        top = tables.rows_of("\n".join(quick.head), where=where, delimiter=quick.mark)
        head = _head([*top, *quick[:2]], headed=headed)
        width = quick.numbers.shape[1]
        if (
            head.data == len(top)
            and (head.cells or not headed)
            and (not head.cells or len(_trimmed(head.cells)) <= width <= len(head.cells))
        ):
            return _table_with(
                head, top, quick, range(len(top) + 1, len(top) + 1 + len(quick)), where, remarks, quick.commas
            )
    rows = tables.rows_of(text, where=where, delimiter=delimiter)
    head = _head(rows, headed=headed)
    if head.names < 0 and head.data == len(rows):
        raise FlightError("holds no table.", where=where, hint="Export it again.")
    if headed and not head.cells:
        raise FlightError(
            "the first line holds numbers, expected names.",
            where=where,
            hint="Add a header such as 'time [s],phi [deg]', or use a mapping file with header = false.",
        )
    data = rows[head.data :]
    commas = tables.with_points(data)
    low, high = len(_trimmed(head.cells)), len(head.cells)
    if not head.cells:
        low = high = max(map(len, data[:1]), default=0)
    again = [list(head.cells), *([rows[head.units]] if head.units >= 0 else [])]
    kept, lines = even_rows(
        data, range(head.data + 1, len(rows) + 1), low=low, high=high, again=again, where=where, remarks=remarks
    )
    return _table_with(head, rows[: head.data], kept, lines, where, remarks, commas)


def _table_with(
    head: _Head, top: Rows, rows: Rows, lines: Sequence[int], where: str, remarks: Remarks, commas: bool
) -> DelimitedTable:
    of_head = (head.names, head.units)
    preface = [row for i, row in enumerate(top) if any(row) and not _is_comment(row) and i not in of_head]
    if commas:
        remarks.notes.append("decimals are written with commas")
    given = top[head.units] if head.units >= 0 else ()
    return DelimitedTable(where, head.cells, given, rows, lines, preface, remarks)


def _is_comment(row: Sequence[str]) -> bool:
    return bool(row) and row[0].startswith("#")


def _trimmed(row: Sequence[str]) -> Sequence[str]:
    """A row without the blanks at its end: a separator may end each line."""
    end = len(row)
    while end and not row[end - 1]:
        end -= 1
    return row[:end]


def _is_datum(cell: str) -> bool:
    return tables.is_number(cell) or epoch.is_time(cell)


def _is_data(row: Sequence[str]) -> bool:
    """Whether most of a row's cells are numbers or times; of a line of settings ("looptime",125) half are at most."""
    filled = [cell for cell in row if cell]
    return 2 * sum(map(_is_datum, filled)) > len(filled)


def _is_units(row: Sequence[str]) -> bool:
    """Whether half of a row's cells, or more, are units, and not all of them are numbers ("1" is a unit too)."""
    filled = [cell.strip("[]()") for cell in row if cell]
    return (
        2 * sum(map(units.is_known, filled)) >= len(filled) and not all(map(tables.is_number, filled)) and bool(filled)
    )


def _names(row: Sequence[str], data: Sequence[str]) -> bool:
    """Whether a row can be the names of the columns of a row of data: as wide, and no number in it."""
    width = len(_trimmed(row))
    return len(_trimmed(data)) <= len(row) and width <= len(data) and not any(map(tables.is_number, row)) and width > 0


def _uncommented(row: Sequence[str]) -> list[str]:
    first = row[0].lstrip("#").strip()
    return [*([first] if first else []), *row[1:]]


def _head(rows: Rows, *, headed: bool) -> _Head:
    """Where names, units and data stand: names directly above the first data that are as wide."""
    real = [i for i, row in enumerate(rows) if any(row) and not _is_comment(row)]
    if not headed or not real:
        return _Head(real[0] if real else len(rows))
    for k, i in enumerate(real):
        if not _is_data(rows[i]):
            continue
        above = real[:k]
        given = (
            above.pop() if len(above) > 1 and _is_units(rows[above[-1]]) and _names(rows[above[-2]], rows[i]) else -1
        )
        if above and _names(rows[above[-1]], rows[i]):
            # The same names may have stood before, above a torn row: the table begins there.
            first = next(j for j in above if list(rows[j]) == list(rows[above[-1]]))
            if first == above[-1]:
                return _Head(i, first, given, rows[first])
            at = real.index(first) + 1
            return _Head(real[at + (given >= 0)], first, real[at] if given >= 0 else -1, rows[first])
        after = rows[real[k + 1]] if k + 1 < len(real) else rows[i]
        if not above and len(after) == len(rows[i]) and _is_data(after):
            commented = [_uncommented(row) for row in rows[:i] if _is_comment(row)]
            cells = next((row for row in reversed(commented) if _names(row, rows[i])), ())
            return _Head(i, -1, -1, cells)
    # No data fit any names: the first row is the header, and what follows is told row by row.
    return _Head(real[0] + 1, real[0], -1, rows[real[0]])


def even_rows(
    rows: Rows,
    lines: Sequence[int],
    *,
    low: int,
    high: int,
    where: str,
    remarks: Remarks,
    again: Sequence[Sequence[str]] = (),
) -> tuple[Rows, Sequence[int]]:
    """The rows that fit the header, and their lines.

    Args:
        rows, lines: the data with their line numbers.
        low, high: fewest and most cells of a row; blank cells at its end do not count.
        again: the header's own rows: where they stand again in the middle, nothing is lost.
        remarks: takes what was left out.

    Raises:
        FlightError: where the first rows do not fit.
    """
    kept, kept_lines, torn = list[Sequence[str]](), list[int](), list[int]()
    real = [i for i, row in enumerate(rows) if any(row) and not _is_comment(row)]
    heads = {head[0]: list(head) for head in again if head}
    repeats = {i for i in real if rows[i][0] in heads and list(rows[i]) == heads[rows[i][0]]}
    data = [i for i in real if i not in repeats] if repeats else real

    def fits(i: int) -> bool:
        return low <= len(rows[i]) and (len(rows[i]) <= high or len(_trimmed(rows[i])) <= high)

    end = len(data)
    for k, i in enumerate(data):
        if fits(i) and not _names_again(rows[i]):
            kept.append(rows[i])
            kept_lines.append(lines[i])
        elif not fits(i) and (k + 1 == len(data) or (fits(data[k + 1]) and not _names_again(rows[data[k + 1]]))):
            torn.append(i)
        else:
            end = k
            break
    cells = {i: max(len(_trimmed(rows[i])), min(len(rows[i]), high)) for i in (*torn[:1], *data[end : end + 1])}
    wanted = f"{high}" if low == high else f"{low} to {high}"
    if not kept and cells:
        i = min(cells)
        raise FlightError(
            f"line {lines[i]} has {_cells(cells[i])}, expected {wanted}, as the header has.",
            where=where,
            hint="Correct the header or the rows: a name or a cell is missing, or a cell holds a separator.",
        )
    if torn:
        first = torn[0]
        remarks.damage.append(
            f"{share(len(torn), len(data), 'rows')} are lost: they are torn (line {lines[first]} has "
            f"{_cells(cells[first])}, the header {wanted})"
        )
    if end < len(data):
        i = data[end]
        why = f"{_cells(cells[i])}, the header {wanted}" if not fits(i) else "other names"
        remarks.damage.append(
            f"{share(len(data) - end, len(data), 'rows')} are lost: line {lines[i]} has {why}, so the columns have "
            "changed there, and only the rows before it were read"
        )
    if repeats:
        many = "1 line" if len(repeats) == 1 else f"{len(repeats)} lines, the first"
        remarks.notes.append(f"the header stands again in {many} ({lines[min(repeats)]}): passed over")
    return kept, kept_lines


def _cells(count: int) -> str:
    return f"{count} cell{'s' * (count != 1)}"


def _names_again(row: Sequence[str]) -> bool:
    """Whether a row holds names where data should stand: two cells or more, and no number or time among them."""
    if row[0][:1] in _NUMERIC or _is_datum(row[0]):
        return False
    filled = [cell for cell in row if cell]
    return len(filled) > 1 and not any(map(_is_datum, filled))
