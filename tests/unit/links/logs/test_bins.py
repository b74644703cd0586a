"""Thinning: of every bin the lowest and the highest sample stay, gaps stay gaps, ten million samples are no matter."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from swashplate.links.logs.bins import extremes, gaps, trace

VALUES = hnp.arrays(
    np.float64,
    st.integers(1, 400),
    elements=st.floats(-1e6, 1e6) | st.sampled_from([np.nan, np.inf, -np.inf]),
)


@settings(derandomize=True, deadline=None, max_examples=150)
@given(values=VALUES, bins=st.integers(1, 60))
def test_lowest_and_highest_of_every_bin_are_kept(values: np.ndarray, bins: int) -> None:
    chosen = extremes(values, bins)
    size = -(-values.size // bins)
    assert chosen.size <= 2 * bins
    assert np.all(np.diff(chosen) > 0)
    for begin in range(0, values.size, size):
        part = values[begin : begin + size]
        kept = values[chosen[(chosen >= begin) & (chosen < begin + size)]]
        finite = part[np.isfinite(part)]
        if finite.size:
            assert kept[np.isfinite(kept)].min() == finite.min()
            assert kept[np.isfinite(kept)].max() == finite.max()


@settings(derandomize=True, deadline=None, max_examples=60)
@given(n=st.integers(2, 3000), bins=st.integers(2, 50), edges=st.tuples(st.floats(0, 1), st.floats(0, 1)))
def test_what_is_drawn_are_samples_and_reach_both_edges(n: int, bins: int, edges: tuple[float, float]) -> None:
    time = np.arange(n) * 0.01
    values = np.sin(np.arange(n) ** 1.5)
    low, high = sorted(edge * time[-1] for edge in edges)
    drawn = trace(time, values, start=low, stop=high, bins=bins, breaks=gaps(time))
    places = np.searchsorted(time, drawn.time)
    assert np.array_equal(time[places], drawn.time)
    assert np.array_equal(values[places], drawn.values)
    inside = (time >= low) & (time <= high)
    if inside.any():
        assert drawn.values.min() <= values[inside].min()
        assert drawn.values.max() >= values[inside].max()
    assert drawn.time.size <= 2 * bins or not drawn.thinned


def test_a_single_sample_of_ten_million_is_seen() -> None:
    time, values = np.arange(10_000_000) * 1e-3, np.zeros(10_000_000)
    values[7_654_321] = 5.0
    drawn = trace(time, values, start=0.0, stop=1e4, bins=1000, breaks=np.zeros(0, dtype=np.int64))
    assert drawn.time.size <= 2001
    assert drawn.values.max() == 5.0
    assert drawn.time[np.argmax(drawn.values)] == pytest.approx(7654.321)


@pytest.mark.parametrize("bins", [5, 500])
def test_a_gap_breaks_the_line(bins: int) -> None:
    time = np.concatenate([np.arange(0.0, 5.0, 0.01), np.arange(8.0, 12.0, 0.01)])
    drawn = trace(time, np.ones(time.size), start=0.0, stop=12.0, bins=bins, breaks=gaps(time))
    holes = np.flatnonzero(np.isnan(drawn.values))
    assert holes.size == 1
    assert 5.0 < drawn.time[holes[0]] < 8.0
    assert np.all(np.diff(drawn.time) > 0)


def test_steps_of_a_slower_message_are_no_gaps() -> None:
    time = np.concatenate([np.arange(0.0, 5.0, 0.1), np.arange(5.0, 50.0, 0.005)])  # paused streaming, then dense
    assert gaps(time).size == 0
