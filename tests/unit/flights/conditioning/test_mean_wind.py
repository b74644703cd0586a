"""The mean wind from air speed and velocity over ground: right within its bounds, and refused where it is not told."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from swashplate.errors import FlightError
from swashplate.flights.conditioning.mean_wind import mean_wind
from swashplate.flights.conditioning.reconstruction import reconstruct
from swashplate.flights.flight import Flight

WIND, SCALE = np.array([4.0, -2.5]), 1.06


def flown(seed: int, *, turn: float = 2.0 * np.pi / 40.0, seconds: float = 160.0, speed: float = 14.0) -> Flight:
    """Circles at constant air speed in gusts of 0.6 m/s that last 2 s, with noise."""
    random, dt = np.random.default_rng(seed), 0.04
    time = np.arange(0.0, seconds, dt)
    keep = np.exp(-dt / 2.0)
    gusts = lfilter([0.6 * np.sqrt(1.0 - keep**2)], [1.0, -keep], random.standard_normal((2, time.size)), axis=1)
    heading = turn * time + 0.3
    through = speed * np.stack([np.cos(heading), np.sin(heading)])
    ground = through + WIND[:, None]
    measured = SCALE * np.linalg.norm(through - gusts, axis=0) + 0.2 * random.standard_normal(time.size)
    channels = {"airspeed": measured, "vx": ground[0], "vy": ground[1], "vz": np.zeros_like(time)}
    return Flight.from_arrays(time, channels, source="circles")


def test_wind_and_scale_lie_within_their_bounds() -> None:
    truth = np.array([*WIND, SCALE])
    scores = []
    for seed in range(30):
        values, covariance = mean_wind(flown(seed))
        scores.append((values - truth) / np.sqrt(np.diag(covariance)))
        assert np.all(np.abs(values - truth) < [0.5, 0.5, 0.03])
    assert np.mean(np.abs(scores) < 2.0) > 0.87
    assert 0.7 < np.std(scores) < 1.35


def test_reconstruct_prints_it_and_takes_the_scale_out() -> None:
    flight = flown(0)
    found = reconstruct(flight)
    assert "mean wind, towards north +" in str(found)
    assert found.as_dict()["wind"].keys() == {"wind_north", "wind_east"}
    assert found.scales["airspeed"].significant
    factor = np.mean(flight.values("airspeed") / found.corrected(flight).values("airspeed"))
    assert factor == pytest.approx(SCALE, abs=0.02)


@pytest.mark.parametrize(("how", "words"), [({"turn": 1e-4}, "hardly turns"), ({"speed": 3.0}, "faster than 5 m/s")])
def test_what_cannot_be_told_is_refused(how: dict[str, float], words: str) -> None:
    flight = flown(1, **how)
    with pytest.raises(FlightError, match=words):
        mean_wind(flight)
    assert any(note.startswith("wind:") for note in reconstruct(flight).notes)
