"""Outliers go, motion stays."""

import numpy as np
import pytest

from conditioning_flights import sweep
from swashplate.errors import FlightError
from swashplate.flights.conditioning.outliers import outliers, remove_outliers
from swashplate.flights.flight import Flight, stream


@pytest.mark.parametrize("noise", [0.0, 0.3, 1.0])
def test_a_sweep_loses_less_than_one_sample_in_a_thousand(noise: float) -> None:
    flight = sweep(40.0, 1, noise=noise)
    removed = remove_outliers(flight).history[-1].details["removed"]
    for name, data in flight.streams.items():
        assert removed[name] < 1e-3 * data.sizes["time"]


def test_spikes_and_glitches_are_found_and_counted() -> None:
    flight = sweep(30.0, 2)
    spikes, glitches = [300, 1500, 3001], [700, 701, 2500]
    inputs, motion = flight.streams["inputs"].copy(deep=True), flight.streams["motion"].copy(deep=True)
    inputs["servo_pitch"].values[spikes] = 5.0
    motion["x"].values[glitches] += 0.03
    clean = remove_outliers(flight.with_streams({"motion": motion, "inputs": inputs}))
    assert not set(inputs["time"].values[spikes]) & set(clean.streams["inputs"]["time"].values)
    assert not set(motion["time"].values[glitches]) & set(clean.streams["motion"]["time"].values)
    details = clean.history[-1].details
    assert details["removed"]["inputs"] <= len(spikes) + 4
    assert details["removed"]["motion"] <= len(glitches) + 4
    assert details["by_channel"]["servo_pitch"] >= len(spikes)


def test_a_jump_of_the_yaw_for_two_samples_is_a_glitch() -> None:
    t = np.arange(600) / 150.0
    psi = 0.4 * np.sin(t) + 1e-3 * np.random.default_rng(0).standard_normal(t.size)
    psi[[250, 251]] += 0.1
    assert np.flatnonzero(outliers(t, psi)).tolist() == [250, 251]


def test_a_spike_in_the_first_sample_is_found() -> None:
    t = np.arange(600) / 150.0
    y = 0.5 + 1e-3 * np.random.default_rng(0).standard_normal(t.size)
    y[0] = 1.0
    assert np.flatnonzero(outliers(t, y)).tolist() == [0]


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_a_step_is_no_outlier(noise: float) -> None:
    t = np.arange(900) / 150.0
    y = np.where((t > 2) & (t < 4), 0.3, 0.0) + noise * np.random.default_rng(3).standard_normal(t.size)
    assert not outliers(t, y).any()


def test_a_constant_channel_has_no_outliers() -> None:
    assert not outliers(np.arange(100) / 100.0, np.full(100, 0.5)).any()


def test_missing_samples_are_dropped_and_a_dead_channel_is_an_error() -> None:
    t = np.arange(200) / 100.0
    values = np.sin(t)
    values[50:53] = np.nan
    clean = remove_outliers(Flight({"a": stream(t, {"x": values})}))
    assert clean.history[-1].details["removed"] == {"a": 3}
    with pytest.raises(FlightError, match="x: has no finite sample"):
        remove_outliers(Flight({"a": stream(t, {"x": np.full(200, np.nan)})}))


def test_a_lost_quaternion_is_dropped() -> None:
    flight = sweep(10.0, 4)
    motion = flight.streams["motion"].copy(deep=True)
    for name in ("qw", "qx", "qy", "qz"):
        motion[name].values[100] = 0.0
    clean = remove_outliers(flight.with_streams({"motion": motion}))
    assert float(motion["time"][100]) not in clean.streams["motion"]["time"].values
