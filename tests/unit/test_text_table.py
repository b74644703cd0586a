"""Tables as text: within the screen's width no number is broken and nothing is lost."""

import re

import pytest

from swashplate.text_table import TextTable, screen_width, text_table

HEAD = ("name", "unit", "a long heading", "another one", "third", "remark")
ROWS = [
    (f"row_{i}", "m/s", f"{-1234.5678 - i:.4f}", f"{i * 0.1:.5f}", f"{i}", "words that go on " * i) for i in range(4)
]
WIDE = TextTable(HEAD, ROWS, (0, 1, 5))


def test_what_fits_stays_as_it_is() -> None:
    lines = WIDE.text(None).split("\n")
    assert len(lines) == 5
    assert WIDE.text(max(map(len, lines)) + 2) == WIDE.text(None)


@pytest.mark.parametrize("width", [30, 44, 60, 80])
def test_a_narrow_one_keeps_every_number_whole(width: int) -> None:
    text = WIDE.text(width)
    assert max(map(len, text.split("\n"))) <= width
    for row in ROWS:
        assert all(re.search(rf"(?<!\S){re.escape(cell)}(?!\S)", text) for cell in row[:5])
    assert text.count("words") == sum(row[5].count("words") for row in ROWS)


def test_stacked_columns_say_again_what_the_rows_are() -> None:
    blocks = TextTable(HEAD[:5], [row[:5] for row in ROWS], (0, 1), keys=2).text(36).split("\n\n")
    assert len(blocks) > 1
    assert all(block.startswith("name   unit  ") and block.count("row_") == len(ROWS) for block in blocks)


def test_columns_that_say_nothing_go_first() -> None:
    table = TextTable(("name", "value", "a heading over nothing"), [("a", "1.0", "-"), ("b", "2.0", "")])
    assert "nothing" in table.text(40)
    assert table.text(20) == "name  value\na       1.0\nb       2.0"


def test_a_pipe_takes_any_line_and_a_terminal_has_a_width(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "30")
    monkeypatch.setattr("sys.stdout.isatty", lambda: False)
    assert screen_width() is None
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert screen_width() == 30
    assert max(map(len, text_table(HEAD[:5], [row[:5] for row in ROWS], left=(0, 1)).split("\n"))) <= 30
