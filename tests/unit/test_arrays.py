"""The order of sizes, which rounding must not change."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.arrays import largest_first, lengthened


@pytest.mark.parametrize("rounding", [-1e-15, 0.0, 1e-15])
def test_what_is_equal_but_for_rounding_keeps_its_order(rounding: float) -> None:
    sizes = np.array([0.0, 0.25, 0.25 + rounding, 0.4, 0.25 - rounding])
    assert largest_first(sizes).tolist() == [3, 1, 2, 4, 0]


def test_what_differs_is_ordered() -> None:
    assert largest_first(np.array([0.25, 0.2501, 0.2499])).tolist() == [1, 0, 2]
    assert largest_first(np.zeros(3)).tolist() == [0, 1, 2]


def test_the_last_row_is_repeated() -> None:
    rows = np.array([[1.0, 2.0], [3.0, 4.0]])
    assert lengthened(rows, 4).tolist() == [[1.0, 2.0], [3.0, 4.0], [3.0, 4.0], [3.0, 4.0]]
