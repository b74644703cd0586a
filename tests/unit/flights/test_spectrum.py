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
    assert "the strongest is 2 x at 50.00 Hz" in found.summary


def shaken_gyro(speed: float, *, tone: float, tilt: float = 0.0) -> Flight:
    """A gyro [rad/s] with noise, a rotor's `tone` at twice its speed [Hz], and a slow drift of strength `tilt`."""
    made = flight()
    time = made.time("p")
    chance = np.random.default_rng(2)
    p = 0.01 * chance.standard_normal(time.size) + tilt * np.cumsum(chance.standard_normal(time.size)) / 200.0
    p += tone * np.sin(4.0 * np.pi * speed * time)
    return made.with_streams({"motion": stream(time, {"p": p}), "rotor": made.streams["rotor"]})


def test_notches_are_suggested_where_a_harmonic_stands_out() -> None:
    found = sp.harmonics(shaken_gyro(25.0, tone=0.05), "p")
    assert found.notches is not None
    assert found.notches.numbers == (2,)
    assert found.notches.parameters == {
        "INS_HNTCH_ENABLE": 1, "INS_HNTCH_MODE": 2, "INS_HNTCH_REF": 1,
        "INS_HNTCH_FREQ": 22.5, "INS_HNTCH_BW": 11.2, "INS_HNTCH_HMNCS": 2,
    }  # fmt: skip
    # The delay is the slope of the phase of the notch that the parameters describe.
    centre, low = 2.0 * np.pi * 50.0, 2.0 * np.pi * 0.5
    width = 2.0 * np.pi * 50.0 * found.notches.width / found.notches.lowest
    phase = np.angle((centre**2 - low**2) / (centre**2 - low**2 + 1j * low * width))
    assert found.notches.delay == pytest.approx(-phase / low, rel=1e-3)
    assert f"{1e3 * found.notches.delay:.1f} ms" in str(found)


@pytest.mark.parametrize(("speed", "tone", "tilt"), [(25.0, 0.0, 0.0), (25.0, 0.0, 5.0), (23.0, 0.05, 0.0)])
def test_no_notch_where_nothing_stands_out_at_a_harmonic(speed: float, tone: float, tilt: float) -> None:
    """Noise, a drift whose density falls steeply, and a tone of something else (46 Hz beside 50)."""
    assert sp.harmonics(shaken_gyro(speed, tone=tone, tilt=tilt), "p").notches is None


def test_a_stretch_too_short_to_tell_the_multiples_apart_is_not_judged() -> None:
    found = sp.harmonics(shaken_gyro(25.0, tone=0.05), "p", start=10.0, stop=10.6)
    assert found.notches is None
    assert {harmonic.above for harmonic in found.harmonics} == {None}
    assert "too short" in str(found)


def test_an_accelerometer_says_nothing_about_notches_of_gyros() -> None:
    found = sp.harmonics(flight(), "az")
    assert max(harmonic.above or 0.0 for harmonic in found.harmonics) > 10.0
    assert found.notches is None


def test_a_rotor_that_the_rate_hides_is_said_to_be_hidden() -> None:
    found = sp.harmonics(flight(rate=40.0), "az")
    assert found.harmonics == ()
    assert "log faster" in found.summary


def test_without_a_turning_rotor_there_is_nothing_to_hold_against() -> None:
    made = flight()
    with pytest.raises(FlightError, match="no rotor speed"):
        sp.harmonics(made.with_streams({"motion": made.streams["motion"]}), "az")
    with pytest.raises(FlightError, match="does not turn"):
        sp.harmonics(flight(speed=0.0), "az")
