"""Conditioning of the two real CoaX flights: what is found there is what the plots show."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from swashplate.flights.conditioning.condition import condition, replay
from swashplate.flights.conditioning.ground import flying_interval
from swashplate.flights.conditioning.outliers import remove_outliers
from swashplate.flights.flight import Flight
from swashplate.flights.readers.read import read


@cache
def conditioned(path: Path) -> Flight:
    return condition(read(path), cutoff=15.0)


def test_july_ends_before_the_yaw_breaks_away(flight_july: Path) -> None:
    found = flying_interval(remove_outliers(read(flight_july)))
    assert found.start == 0.0
    assert 17.5 < found.stop < 18.0
    assert "crash" in found.reasons[0]
    flight = conditioned(flight_july)
    assert len(flight.segments) == 1
    assert np.max(np.abs(flight.array(("phi", "theta")))) < np.radians(10)
    assert np.max(np.abs(flight.values("r"))) < 2.0


def test_august_ends_where_something_holds_it(flight_august: Path) -> None:
    """From 40 s it is tilted by 7 degrees at 5 cm/s without accelerating, with a tenth less thrust: no free flight."""
    found = flying_interval(remove_outliers(read(flight_august)))
    assert 39.0 < found.stop < 41.0
    assert "held" in found.reasons[-1]
    rest = condition(read(flight_august), trim_ground=False, cutoff=15.0).between(42.0, 44.0)
    free = conditioned(flight_august)
    for flight, low, high in ((rest, 0.8, 1.5), (free, 0.0, 0.15)):
        assert low < np.linalg.norm(np.mean(flight.array(("ax", "ay")), axis=0)) < high
    thrust = [np.mean(f.array(("motor_lower", "motor_upper"))) ** 2 for f in (rest, free)]
    assert thrust[0] < 0.92 * thrust[1]


def test_august_loses_its_spikes_and_little_else(flight_august: Path) -> None:
    flight = conditioned(flight_august)
    removed = flight.history[0].details["removed"]
    assert 0 < removed["motion"] < 40
    assert 30 < removed["inputs"] < 100
    late = flight.array(("motor_lower", "motor_upper"))[flight.time("x") > 16.0]
    assert late.min() > 0.47
    assert late.max() < 0.59
    longest = max(b - a for a, b in flight.segments)
    assert longest > 30.0
    assert sum(b - a for a, b in flight.segments) > 39.0


@pytest.mark.parametrize("name", ["flight_july", "flight_august"])
def test_the_history_redoes_it_from_the_file(name: str, request: pytest.FixtureRequest) -> None:
    path = request.getfixturevalue(name)
    flight = conditioned(path)
    again = replay(read(path), flight.history)
    assert all(np.array_equal(again.values(c), flight.values(c)) for c in flight.channels)
