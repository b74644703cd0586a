"""Two logs of one flight on one clock, with honest bounds."""

import numpy as np
import pytest

from conditioning_flights import wobble
from swashplate.errors import FlightError
from swashplate.flights.conditioning.synchronise import Synchronisation, merge, synchronise
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance

OFFSET, DRIFT = 3.217, 50e-6


def pair(seed: int, *, noise: float = 0.05) -> tuple[Flight, Flight]:
    """On board at 100 Hz, motion capture at 200 Hz: the second's clock runs late by OFFSET and slow by DRIFT."""
    rng = np.random.default_rng(seed)
    t_one = np.arange(0.0, 45.0, 0.01)
    t_two = np.arange(0.0, 38.0, 0.005)
    seen = OFFSET + (1.0 + DRIFT) * t_two
    one, two = {}, {}
    for name in ("p", "q", "r"):
        both = wobble(np.concatenate([t_one, seen]), rng, amplitude=0.5, low=0.21, high=3.7)
        # Coloured noise: its low part survives the filter, and a plain bound would not see it.
        n_one, n_two = (np.convolve(rng.standard_normal(t.size), np.ones(9) / 3, "same") for t in (t_one, t_two))
        one[name] = both[: t_one.size] + noise * n_one + 0.02
        two[name] = both[t_one.size :] + noise * n_two
    return (
        Flight({"imu": stream(t_one, one)}, Provenance(source="board")),
        Flight({"mocap": stream(t_two, {**two, "x": np.sin(t_two)})}, Provenance(source="mocap")),
    )


def test_offset_and_drift_are_found_within_honest_bounds() -> None:
    found = [synchronise(*pair(seed)) for seed in range(8)]
    z = np.array([[(s.offset - OFFSET) / s.offset_sigma, (s.drift - DRIFT) / s.drift_sigma] for s in found])
    assert np.max(np.abs(z)) < 3.5
    # Too wide fails as well as too narrow; 16 values of a normal distribution lie in here with more than 99 %.
    assert 0.55 < np.sqrt(np.mean(z**2)) < 1.55
    assert max(s.offset_sigma for s in found) < 0.005


def test_the_second_log_comes_onto_the_first_clock() -> None:
    first, second = pair(1)
    clock = synchronise(first, second)
    both = merge(first, second, clock=clock)
    assert both.history[-1].details["added"] == ["x"]
    np.testing.assert_allclose(both.time("x"), OFFSET + (1 + DRIFT) * second.time("x"), atol=5 * clock.offset_sigma)
    assert both.provenance == first.provenance
    np.testing.assert_array_equal(both.values("p"), first.values("p"))


def test_logs_of_different_flights_are_refused() -> None:
    first, _ = pair(1)
    _, other = pair(99)
    with pytest.raises(FlightError, match=r"correlation|overlap"):
        synchronise(first, other)
    with pytest.raises(FlightError, match="share no motion"):
        synchronise(first, Flight({"a": stream([0.0, 1.0], {"x": [0.0, 1.0]})}))
    still = Flight({"a": stream(np.arange(500) / 100, {"p": np.zeros(500)})})
    with pytest.raises(FlightError, match="p: is constant"):
        synchronise(first, still)


def test_a_clock_prints_itself() -> None:
    clock = Synchronisation(3.217, 50e-6, 0.001, 2e-6, 20.0, 0.0005, 0.99, ("p",))
    assert str(clock) == "offset 3.2170 ± 0.0010 s, drift 50.0 ± 2.0 ppm (correlation 0.990 of p)"
