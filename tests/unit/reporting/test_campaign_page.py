"""The page of a campaign: what is no number is laid out as words."""

from __future__ import annotations

from swashplate.reporting.campaign import compose_campaign
from swashplate.reporting.structure import Table


def test_words_in_a_table_are_words_and_may_be_long() -> None:
    """Figures stand to the right on one line: the reason why a log cannot be read ran out of the page there."""
    page = compose_campaign(
        "logs", standing="", rows="log", summary=(), careful=(), shares=(), shapes=(), worst=(), worst_by="",
        folder="out", tables=(("Logs", ("log", "why", "rows"), (("1.nc", "is damaged", "-3"),)),), failed=(),
    )  # fmt: skip
    (table,) = page.sections[0].blocks
    assert isinstance(table, Table)
    assert [cell.number for cell in table.rows[0]] == [False, False, True]
