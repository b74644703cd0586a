"""Series of many lengths share compiled code, and the samples too many change nothing."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from swashplate.simulation.compilation import lengthened, shared_length


@given(st.integers(1, 10**7))
def test_a_shared_length_holds_the_series_and_at_most_a_third_more(n: int) -> None:
    length = shared_length(n)
    assert n <= length
    assert length <= max(64, np.ceil(1.5 * n))
    assert shared_length(length) == length


def test_there_are_few_of_them() -> None:
    assert len({shared_length(n) for n in range(500, 6001)}) == 8


def test_the_last_row_is_repeated() -> None:
    rows = np.array([[1.0, 2.0], [3.0, 4.0]])
    assert lengthened(rows, 4).tolist() == [[1.0, 2.0], [3.0, 4.0], [3.0, 4.0], [3.0, 4.0]]
