"""The benchmark that runs this code and an older one in turn judges the share that is left, and can say no."""

from __future__ import annotations

from typing import Any

import pytest
from benchmarks.beside_revision import as_section


def _runs(processor: float, clock: float) -> list[dict[str, float]]:
    return [{"processor": processor * share, "clock": clock * share, "peak_gib": 0.1} for share in (1.0, 1.1, 5.0)]


def _judged(what: str, this: tuple[float, float]) -> dict[str, Any]:
    return as_section({(what, "former"): _runs(20.0, 10.0), (what, "this"): _runs(*this)}, "abc")


@pytest.mark.parametrize(
    ("what", "this", "met"),
    [
        ("control design, cold", (9.9, 30.0), True),
        ("control design, cold", (10.1, 1.0), False),
        ("identify, cold", (99.0, 2.9), True),
        ("identify, cold", (1.0, 3.0), False),
    ],
)
def test_the_share_that_is_left_is_judged_by_what_was_asked(what: str, this: tuple[float, float], *, met: bool) -> None:
    found = _judged(what, this)
    (row,) = found["rows"]
    assert found["passed"] is met
    assert row[6] is met
    assert row[4] == pytest.approx(this[what.startswith("identify")] / (10.0 if what.startswith("identify") else 20.0))


def test_what_nothing_was_asked_of_is_told_without_a_verdict() -> None:
    found = _judged("validate, warm", (100.0, 100.0))
    assert found["rows"][0][5:7] == [None, None]
    assert found["passed"]
