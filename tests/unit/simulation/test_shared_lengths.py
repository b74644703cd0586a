"""Series of many lengths share compiled code, and the samples too many change nothing."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import swashplate as sp
from swashplate.simulation import closed_loop
from swashplate.simulation.closed_loop_batch import simulate_closed_loops
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


def test_flights_of_other_lengths_and_delays_are_the_same_and_compile_once() -> None:
    vehicle = sp.vehicle("coax")
    control = sp.state_hold(vehicle, sp.trim(vehicle))
    flown = [
        sp.simulate_closed_loop(
            vehicle, control, duration=seconds, reference={"z": -0.2}, rate=100.0, delays=0.03, start=sp.trim(vehicle)
        )
        for seconds in (0.8, 0.9)
    ]
    before = closed_loop._fly._cache_size()
    later = sp.simulate_closed_loop(
        vehicle, control, duration=0.7, reference={"z": -0.2}, rate=100.0, delays=0.04, start=sp.trim(vehicle)
    )
    assert closed_loop._fly._cache_size() == before
    short, long = (flight.array(vehicle.state_names) for flight in flown)
    assert np.array_equal(short, long[: len(short)])
    assert not np.array_equal(later.array(vehicle.state_names), short[:71])


def test_a_batch_keeps_the_samples_that_were_asked_for() -> None:
    vehicle = sp.vehicle("coax")
    control = sp.state_hold(vehicle, sp.trim(vehicle))
    batch = simulate_closed_loops(vehicle, control, duration=0.5, size=2, rate=100.0, keep=4)
    assert len(batch.time) == round(0.5 * control.rate) // 4
