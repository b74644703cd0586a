"""A uniform grid stays one when it was given as Unix time in float64; a jitter that is no rounding does not pass."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.identification.core.records import uniform_table

TIME = np.arange(2000) / 50.0


@pytest.mark.parametrize("epoch", [0.0, 1.7e9, 1.7e9 + 0.123])
def test_unix_time_in_float64_is_a_uniform_grid(epoch: float) -> None:
    flight = Flight.from_arrays(epoch + TIME, {"p": np.sin(TIME)})
    time, _ = uniform_table(flight, ("p",), who="the test")
    assert (time[-1] - time[0]) / (time.size - 1) == pytest.approx(0.02, rel=1e-7)


@pytest.mark.parametrize("epoch", [0.0, 1.7e9])
def test_a_jitter_of_microseconds_is_refused(epoch: float) -> None:
    moved = TIME + 2e-6 * np.random.default_rng(1).uniform(-1.0, 1.0, TIME.size)
    with pytest.raises(FlightError, match="time steps vary"):
        uniform_table(Flight.from_arrays(epoch + moved, {"p": np.sin(TIME)}), ("p",), who="the test")
