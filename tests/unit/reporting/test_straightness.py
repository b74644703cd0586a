"""Whether a law is shown to be better than another on many flights, and that the report can say no."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.control.analysis.straightness import Path, nearer
from swashplate.reporting.straightness import _against


def path(*drift: float) -> Path:
    return Path(*[np.array(drift)] * 5)


def test_flights_are_compared_one_by_one_and_one_that_does_not_arrive_is_the_furthest() -> None:
    nan = float("nan")
    one, other = path(0.1, -0.3, nan, 1.0, nan), path(-0.2, 0.1, 5.0, nan, nan)
    assert nearer(one, other) == (2, 4)
    assert nearer(other, one) == (2, 4)


@pytest.mark.parametrize(
    ("wins", "tone"), [(60, "good"), (38, "good"), (37, "caution"), (25, "caution"), (0, "caution")]
)
def test_a_law_that_wins_by_chance_is_not_called_better(wins: int, tone: str) -> None:
    """Of 60 tosses two standard deviations are 7.7 beyond 30."""
    words, found = _against("without", wins, 60)
    assert found == tone
    assert ("not shown to be better" in words) == (tone == "caution")
