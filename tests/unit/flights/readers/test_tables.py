"""Large tables of numbers are parsed at once, to the same bits; whatever is odd is left to the way cell by cell."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.flights.readers.tables import NumberRows, column, rows_of, texts


def _text(mark: str = ",", *, end: str = "\n") -> str:
    """A header and 400 rows of numbers in every way in which logs write them."""
    generator = np.random.default_rng(3)
    values = generator.standard_normal((400, 4)) * 10.0 ** generator.integers(-300, 300, (400, 4))
    forms = ("{!r}", "{:.6f}", "{:.17e}", "{:+.3g}")
    rows = [mark.join(form.format(float(v)) for form, v in zip(forms, row, strict=True)) for row in values]
    return end.join([mark.join("abcd"), *rows, ""])


@pytest.mark.parametrize(("mark", "end"), [(",", "\n"), (";", "\r\n"), ("\t", "\n"), (", ", "\n")])
def test_numbers_at_once_are_those_of_the_cells_to_the_last_bit(mark: str, end: str) -> None:
    text = _text(mark, end=end)
    once = NumberRows.of(text)
    assert once is not None
    cells = rows_of(text, where="log.csv")
    assert [line.strip() for line in once.head] == [mark.join("abcd")]
    assert list(once) == cells[1:]
    assert (once[7], once[3:5]) == (cells[8], cells[4:6])
    for index in range(4):
        kept = column(once, index, name="a", where="log.csv", lines=range(2, 402))
        assert kept.tobytes() == column(cells[1:], index, name="a", where="log.csv", lines=range(2, 402)).tobytes()


@pytest.mark.parametrize(
    "odd",
    [
        "",
        "1,2,3",
        "1,2,3,4,5",
        "1,2,,4",
        "1,2,nan,4",
        "1,2,1_0,4",
        "1,2,3e,4",
        "1,2,0x1,4",
        "1,2,3 4",
        '1,2,"3",4',
        "# x",
    ],
)
def test_what_is_odd_is_read_cell_by_cell(odd: str) -> None:
    lines = _text().split("\n")
    assert NumberRows.of("\n".join(lines)) is not None
    assert NumberRows.of("\n".join([*lines[:200], odd, *lines[200:]])) is None


def test_a_column_that_no_row_reaches_is_blank() -> None:
    """Found by fuzzing: a header with more names than its rows of numbers have."""
    rows = NumberRows.of("time,a,b\n0,1\n1,2\n")
    assert rows is not None
    assert texts(rows, 2) == ["", ""]
    assert np.isnan(column(rows, 2, name="b", where="log.csv", lines=range(2, 4))).all()
    assert texts(rows, 1) == ["1", "2"]
