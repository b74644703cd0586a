"""Densities add up to the variance, a tone stands where it is, a rotor's harmonics are found or said to be hidden."""

from __future__ import annotations

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight, stream


def flight(rate: float = 200.0, *, speed: float = 25.0, seconds: float = 40.0) -> Flight:
    """A tone of 2 m/s^2 at twice the rotor's speed [Hz] and of 0.5 at the rotor's own, with noise of 0.1."""
    time = np.arange(0.0, seconds, 1.0 / rate)
    chance = np.random.default_rng(1)
    az = 2.0 * np.sin(4.0 * np.pi * speed * time) + 0.5 * np.sin(2.0 * np.pi * speed * time)
    az += 0.1 * chance.standard_normal(time.size)
    p = np.radians(3.0) * np.sin(2.0 * np.pi * 3.0 * time)
    motion = stream(time, {"az": az - 9.81, "p": p})
    turning = stream(np.arange(0.0, seconds, 0.1), {"omega_rotor": np.full(int(seconds * 10), 2.0 * np.pi * speed)})
    return Flight({"motion": motion, "rotor": turning})


def test_the_density_holds_the_variance_in_the_screens_unit() -> None:
    found = sp.spectrum(flight(), "p")
    assert found.unit == "deg/s"
    assert found.rms(1.0, 10.0) == pytest.approx(3.0 / np.sqrt(2.0), rel=0.02)
    assert found.frequency[np.argmax(found.density)] == pytest.approx(3.0, abs=1.0 / found.seconds)
    assert found.windows >= 16


def test_a_part_is_a_part_and_too_little_is_refused() -> None:
    found = sp.spectrum(flight(), "az", start=10.0, stop=20.0)
    assert (found.start, found.stop) == pytest.approx((10.0, 20.0), abs=0.01)
    with pytest.raises(FlightError, match="expected at least 32"):
        sp.spectrum(flight(), "az", start=10.0, stop=10.1)
    with pytest.raises(FlightError, match="no such channel"):
        sp.spectrum(flight(), "ay")


def test_a_gap_is_not_bridged() -> None:
    whole = flight()
    cut = whole.streams["motion"].where(
        (whole.streams["motion"].time < 10.0) | (whole.streams["motion"].time > 12.0), drop=True
    )
    found = sp.spectrum(whole.with_streams({"motion": cut}), "az")
    assert found.start > 12.0


def test_a_sweep_rises_in_the_spectrogram() -> None:
    time = np.arange(0.0, 40.0, 0.01)
    sweep = np.sin(2.0 * np.pi * (1.0 * time + 0.25 * time**2))  # 1 to 21 Hz
    found = sp.spectrogram(Flight({"s": stream(time, {"mixer_roll": sweep})}), "mixer_roll")
    ridge = found.frequency[np.argmax(found.density, axis=0)]
    assert ridge == pytest.approx(1.0 + 0.5 * found.time, abs=1.5 * (found.frequency[1] - found.frequency[0]))


def test_harmonics_are_told_with_their_strength() -> None:
    found = sp.harmonics(flight(), "az")
    assert found.speed == pytest.approx(25.0)
    assert [h.number for h in found.harmonics] == [1, 2, 3]
    assert [h.rms for h in found.harmonics[:2]] == pytest.approx([0.5 / np.sqrt(2.0), 2.0 / np.sqrt(2.0)], rel=0.03)
    assert "the strongest is 2 x at 50.00 Hz" in found.words


def test_a_rotor_that_the_rate_hides_is_said_to_be_hidden() -> None:
    found = sp.harmonics(flight(rate=40.0), "az")
    assert found.harmonics == ()
    assert "log faster" in found.words


def test_without_a_turning_rotor_there_is_nothing_to_hold_against() -> None:
    made = flight()
    with pytest.raises(FlightError, match="no rotor speed"):
        sp.harmonics(made.with_streams({"motion": made.streams["motion"]}), "az")
    with pytest.raises(FlightError, match="does not turn"):
        sp.harmonics(flight(speed=0.0), "az")
