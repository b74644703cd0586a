"""Whatever is done to a table's rows, no number is ever read under another name, and what is not read is told."""

from __future__ import annotations

import re
import tempfile
from contextlib import suppress
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from swashplate.errors import FlightError
from swashplate.flights.readers.read import read

NAMES = ("alpha", "beta", "gamma", "delta")
ROWS = 40


def _cells(row: int) -> list[str]:
    """Each number says its row and its column."""
    return [f"{row / 100:.2f}", *(f"{row}{column}" for column in range(1, len(NAMES) + 1))]


def _changed(row: int, change: str, place: int) -> list[str]:
    cells = _cells(row)
    at = 1 + place % len(NAMES)
    if change == "more":
        return [*cells[:at], "77777", *cells[at:]]
    if change == "less":
        return [*cells[:at], *cells[at + 1 :]]
    if change == "cut":
        return cells[:at]
    return ["time [s]", *NAMES] if change == "header" else ["", *[""] * place]


@settings(max_examples=150, deadline=None, derandomize=True)
@given(
    st.dictionaries(
        st.integers(0, ROWS - 1),
        st.tuples(st.sampled_from(["more", "less", "cut", "header", "blank"]), st.integers(0, 9)),
        max_size=8,
    ),
    st.integers(0, ROWS),
    st.sampled_from(",;\t"),
)  # fmt: skip
def test_no_number_is_read_under_another_name(changes: dict[int, tuple[str, int]], wider_from: int, mark: str) -> None:
    lines = [mark.join(["time [s]", *NAMES])]
    for row in range(ROWS):
        if row in changes:
            cells = _changed(row, *changes[row])
            lines.append(mark.join(cells))
            if changes[row][0] in ("header", "blank"):
                lines.append(mark.join(_cells(row)))
        else:
            lines.append(mark.join([*_cells(row), *(["5"] if row >= wider_from and wider_from > 30 else [])]))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        path.write_text("\n".join([*lines, ""]))
        with suppress(FlightError):
            flight = read(path)
            time = np.rint(100.0 * flight.time("alpha")).astype(int)
            for column, name in enumerate(NAMES, 1):
                assert flight.values(name).tolist() == [10 * row + column for row in time.tolist()]
            lost = sum(int(n) for text in flight.provenance.damage for n in re.findall(r"(\d+) of \d+ rows", text))
            assert time.size + lost == ROWS
