"""What would disturb a screen is shown as its number, and JSON reads it back."""

from __future__ import annotations

import json
import sys
import unicodedata

from swashplate.text_table import text_table
from swashplate.visible import escaped, visible


def test_marks_of_direction_and_control_characters_are_numbers_and_all_else_is_itself() -> None:
    for code in range(sys.maxunicode + 1):
        letter = chr(code)
        kind, way = unicodedata.category(letter), unicodedata.bidirectional(letter)
        hidden = letter not in "\n\t" and (
            kind in ("Cc", "Zl", "Zp") or way in ("LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI")
            or unicodedata.name(letter, "") in ("LEFT-TO-RIGHT MARK", "RIGHT-TO-LEFT MARK", "ARABIC LETTER MARK")
        )  # fmt: skip
        shown = visible(letter)
        assert shown == (f"\\u{code:04x}" if hidden else letter)
        if hidden:
            assert json.loads(f'"{shown}"') == letter


def test_any_text_can_be_escaped_for_json() -> None:
    text = "aä\u202e中😀\udcff"
    assert escaped(text).isascii()
    assert json.loads(f'"{escaped(text)}"') == text


def test_cells_of_tables_are_shown_so_and_stay_under_their_headings() -> None:
    lines = text_table(("name", "value"), [("a\u202eb\x1b[8m", "1"), ("c", "22")]).splitlines()
    assert lines[1].startswith("a\\u202eb\\u001b[8m")
    assert len({len(line) for line in lines}) == 1
