"""Series of many lengths share compiled code, and the samples too many change nothing."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import swashplate as sp
from swashplate.simulation import closed_loop, closed_loop_batch
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
    vehicle = sp.vehicle("crazyflie")
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
    changes = np.flatnonzero(np.diff(flown[1].values(vehicle.input_names[0]))) + 1
    assert changes.size > 20
    assert len(set(changes % 2)) == 1, "the controller runs at its own rate, half of the flight's, and 30 ms late"
    assert not np.array_equal(later.array(vehicle.state_names), short[:71])


def test_any_number_of_vehicles_and_any_delay_fly_one_program() -> None:
    """What is compiled knows neither how many fly, nor how long, nor how late up to the next power of two.

    Of samples as many are kept as were asked for.
    """
    vehicle = sp.vehicle("crazyflie")
    control, start = sp.state_hold(vehicle, sp.trim(vehicle)), sp.trim(vehicle)
    places, batches, compiled = np.linspace(-0.3, 0.3, 9), [], []
    for size, seconds, delay in ((9, 0.6, 0.03), (3, 0.5, 0.04), (1, 0.6, 0.035)):
        wind = {"wind_north": places[:size]} if size > 1 else {"wind_north": places[0]}
        wind = {name: np.broadcast_to(values, (100, size)) for name, values in wind.items()}
        batches.append(
            simulate_closed_loops(
                vehicle,
                control,
                duration=seconds,
                size=size,
                rate=100.0,
                wind=wind,
                delays=delay,
                start=start,
                keep=4,
            )
        )
        compiled.append(closed_loop_batch._fly_many._cache_size())
    assert compiled[0] == compiled[1] == compiled[2]
    nine, three, one = batches
    assert len(three.time) == round(0.5 * control.rate) // 4
    assert nine.states.shape[2] == 9
    assert three.states.shape[2] == 3
    late = simulate_closed_loops(
        vehicle, control, duration=0.5, size=9, rate=100.0, wind={"wind_north": np.tile(places, (100, 1))},
        delays=0.04, start=start, keep=4,
    )  # fmt: skip
    assert np.array_equal(late.states[:, :, :3], three.states)
    assert one.states.shape[2] == 1
