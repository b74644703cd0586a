"""Where a table has its header and data, and that no cell is ever read under a name that may not be its own."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.errors import FlightError
from swashplate.flights.readers.table_layout import DelimitedTable, read_table

ROWS = [f"{k / 100:.2f},{k},{2 * k}" for k in range(50)]
HEAD = "time [s],p,q"


def _table(lines, **mapping) -> DelimitedTable:
    return read_table("\n".join([*lines, ""]), where="log.csv", mapping=mapping)


def _columns(table: DelimitedTable):
    return [table.numbers(i, name="x").tolist() for i in range(table.width)]


# ---- where the header is ---------------------------------------------------------------------------------------------
LAYOUTS = {
    "plain": [HEAD],
    "blank lines": ["", HEAD, ""],
    "comments": ["# made by hand", HEAD, "# p of the roll axis"],
    "units below": [HEAD, "s,rad/s,rad/s"],
    "units in brackets": [HEAD, "[s],[rad/s],[rad/s]"],
    "a unit that nobody knows": [HEAD, "s,rad/s,furlong"],
    "a commented header": [f"# {HEAD}"],
    "a commented header without a space": [f"#{HEAD}", "# a remark"],
    "settings": ["firmware,Betaflight", "looptime,125", "looptime,250", HEAD],
    "a setting of many numbers": ["gains,45,80,30,90", HEAD],
    "quoted settings": ['"rollPID","45,80,30"', '"pitchPID","47,84,34"', HEAD],
}


@pytest.mark.parametrize("top", LAYOUTS.values(), ids=LAYOUTS)
@pytest.mark.parametrize("odd", [False, True])
def test_the_header_is_found(top, odd) -> None:
    """In both ways of reading: all numbers at once, and cell by cell where one is blank."""
    rows = [*ROWS[:-1], ROWS[-1].rpartition(",")[0] + ","] if odd else ROWS
    table = _table([*top, *rows])
    assert list(table.header) == ["time [s]", "p", "q"]
    assert bool(table.units) == (len(top) > 1 and top[1].strip("[").startswith("s"))
    assert len(table) == 50
    assert _columns(table)[1] == list(range(50))
    assert np.isnan(_columns(table)[2][-1]) == odd
    assert table.remarks.damage == []


def test_what_stands_before_the_header_is_kept() -> None:
    table = _table(LAYOUTS["settings"] + ROWS)
    assert [list(row) for row in table.preface] == [
        ["firmware", "Betaflight"],
        ["looptime", "125"],
        ["looptime", "250"],
    ]


@pytest.mark.parametrize("mark", [";", "\t"])
def test_decimal_commas_are_told_from_commas_that_separate(mark: str) -> None:
    rows = [row.replace(",", mark).replace(".", ",") for row in ROWS]
    table = _table([HEAD.replace(" [s]", "").replace(",", mark), *rows])
    assert _columns(table)[0] == pytest.approx(np.arange(50) / 100)
    assert table.remarks.notes == ["decimals are written with commas"]
    assert not _table([HEAD, *ROWS]).remarks.notes


def test_without_names_the_first_line_is_refused_unless_the_mapping_says_so() -> None:
    with pytest.raises(FlightError, match=r"first line holds numbers.*header = false"):
        _table(ROWS)
    assert len(_table(ROWS, header=False)) == 50


# ---- which rows are whole --------------------------------------------------------------------------------------------
def _longer(row: str) -> str:
    return row + ",9"


def _shorter(row: str) -> str:
    return row.rpartition(",")[0]


@pytest.mark.parametrize(("change", "cells"), [(_longer, 4), (_shorter, 2)])
def test_from_where_the_columns_change_nothing_is_read(change, cells: int) -> None:
    table = _table([HEAD, *ROWS[:30], *map(change, ROWS[30:])])
    assert len(table) == 30
    assert table.remarks.damage == [
        f"20 of 50 rows (40 %) are lost: line 32 has {cells} cells, the header 3, so the columns have changed there, "
        "and only the rows before it were read"
    ]


@pytest.mark.parametrize("change", [_longer, _shorter])
@pytest.mark.parametrize("place", [7, 49])
def test_a_torn_line_costs_itself(change, place: int) -> None:
    """In the middle, and where the power was cut."""
    rows = [*ROWS[:place], change(ROWS[place]), *ROWS[place + 1 :]]
    table = _table([HEAD, *rows])
    assert len(table) == 49
    assert f"1 of 50 rows (2 %) are lost: they are torn (line {place + 2} has" in table.remarks.damage[0]
    assert table.lines[place - 1] == place + 1
    if place < 49:
        assert table.lines[place] == place + 3


def test_columns_that_change_back_are_not_trusted_again() -> None:
    """One sensor more, then another one less: the header's width again, and other columns."""
    table = _table([HEAD, *ROWS[:20], *map(_longer, ROWS[20:30]), *ROWS[30:]])
    assert len(table) == 20
    assert "30 of 50 rows (60 %) are lost" in table.remarks.damage[0]


@pytest.mark.parametrize("change", [_longer, _shorter])
def test_a_header_that_fits_no_row_is_refused(change) -> None:
    with pytest.raises(FlightError, match=r"line 2 has \d cells, expected 3, as the header has"):
        _table([HEAD, *map(change, ROWS)])


def test_the_same_header_again_loses_nothing_and_another_one_ends_the_table() -> None:
    table = _table([HEAD, *ROWS[:30], HEAD, *ROWS[30:]])
    assert len(table) == 50
    assert table.remarks.damage == []
    assert table.remarks.notes == ["the header stands again in 1 line (32): passed over"]
    assert table.lines[29:31] == [31, 33]
    table = _table([HEAD, *ROWS[:30], "time [s],q,p", *ROWS[30:]])
    assert len(table) == 30
    assert "line 32 has other names" in table.remarks.damage[0]


def test_separators_at_the_end_of_lines_are_no_cells() -> None:
    assert len(_table([HEAD + ",", *[row + "," for row in ROWS]])) == 50
    assert len(_table([HEAD, *[row + ",," for row in ROWS]])) == 50
    assert _table([HEAD + ",", *[row + "," for row in ROWS]]).remarks.damage == []


def test_good_tables_lose_nothing() -> None:
    for top in LAYOUTS.values():
        assert _table([*top, *ROWS]).remarks.damage == []
