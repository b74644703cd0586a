"""Filters of an autopilot's parameters, what they cost, and the noise before and behind them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from rate_loops import Loop, flight
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.flights.review.filters import Filter, filters
from swashplate.flights.review.noise import gyro_noise

ARDUPILOT = {
    "INS_GYRO_FILTER": 80.0,
    "INS_HNTCH_ENABLE": 1.0,
    "INS_HNTCH_MODE": 0.0,
    "INS_HNTCH_FREQ": 60.0,
    "INS_HNTCH_BW": 30.0,
    "INS_HNTCH_ATT": 40.0,
    "INS_HNTCH_HMNCS": 3.0,
    "ATC_RAT_RLL_FLTT": 20.0,
    "ATC_RAT_RLL_FLTD": 0.0,
}
BETAFLIGHT = {
    "gyro_lpf1_static_hz": 250.0,
    "gyro_lpf1_dyn_hz_0": 200.0,
    "gyro_lpf2_static_hz": 500.0,
    "gyro_lpf2_type": 1.0,
    "dterm_lpf1_static_hz": 75.0,
    "dterm_lpf1_type": 3.0,
    "gyro_notch_hz_0": 120.0,
    "gyro_notch_cutoff_0": 100.0,
    "dyn_notch_count": 3.0,
    "dyn_notch_min_hz": 100.0,
    "dyn_notch_max_hz": 600.0,
}


def of(reader: str, parameters: dict[str, float], made: Flight | None = None) -> Flight:
    made = made or flight(Loop(), 1, seconds=20.0)
    return replace(made, provenance=Provenance(reader=reader, parameters=parameters))


@pytest.mark.parametrize(("reader", "parameters"), [("ardupilot", ARDUPILOT), ("blackbox", BETAFLIGHT)])
def test_a_filters_delay_is_the_slope_of_its_own_phase(reader: str, parameters: dict[str, float]) -> None:
    chosen, _ = filters(of(reader, parameters))
    assert chosen
    for each in chosen:
        slope = -np.angle(each.response(np.array([1e-3]))) / (2.0 * np.pi * 1e-3)
        assert each.delay == pytest.approx(float(slope[0]), rel=1e-4), each.name
        if each.kind == "notch":
            assert abs(each.response(np.array([each.frequency]))[0]) == pytest.approx(each.left, abs=1e-9)
        else:
            assert abs(each.response(np.array([each.frequency]))[0]) == pytest.approx(10 ** (-3 / 20), abs=0.002)


def test_what_the_parameters_configure_is_found() -> None:
    chosen, untold = filters(of("ardupilot", ARDUPILOT))
    assert [(each.name, each.frequency) for each in chosen] == [
        ("INS_GYRO_FILTER", 80.0), ("INS_HNTCH", 60.0), ("INS_HNTCH (2 x)", 120.0), ("ATC_RAT_RLL_FLTT", 20.0),
    ]  # fmt: skip
    assert untold == ()
    chosen, untold = filters(of("blackbox", BETAFLIGHT))
    assert [(each.name, each.frequency) for each in chosen] == [
        ("gyro_lpf1_dyn_hz_0", 200.0), ("gyro_lpf2_static_hz", 500.0), ("dterm_lpf1_static_hz", 75.0),
        ("gyro_notch_hz_0", 120.0),
    ]  # fmt: skip
    assert "3 dynamic notches between 100 and 600 Hz" in untold[0]
    chosen, _ = filters(of("ulog", {"IMU_GYRO_CUTOFF": 40.0, "IMU_GYRO_NF0_FRQ": 90.0, "IMU_GYRO_NF0_BW": 20.0}))
    assert [each.kind for each in chosen] == ["low-pass", "notch"]


def test_a_notch_that_follows_the_rotor_stands_at_its_mean_speed() -> None:
    made = flight(Loop(), 1, seconds=20.0)
    made = made.with_channel("omega_rotor", np.full(made.values("p").size, 2.0 * np.pi * 30.0), like="p")
    follows = {**ARDUPILOT, "INS_HNTCH_MODE": 2.0, "INS_HNTCH_REF": 1.0, "INS_HNTCH_FREQ": 24.0}
    chosen, untold = filters(of("ardupilot", follows, made))
    assert [each.frequency for each in chosen if each.kind == "notch"] == pytest.approx([30.0, 60.0])
    assert untold == ()
    chosen, untold = filters(of("ardupilot", follows))
    assert "which the log does not tell" in untold[0]


def shaken(seconds: float = 30.0) -> Flight:
    """White noise and a line at 60 Hz behind a low-pass of 80 Hz, at 1 kHz, with what was before it."""
    n, rng = round(1000 * seconds), np.random.default_rng(2)
    time = np.arange(n) / 1000.0
    raw = np.deg2rad(5.0) * rng.standard_normal(n) + np.deg2rad(8.0) * np.sin(2.0 * np.pi * 60.0 * time)
    filtered = lfilter(*butter(2, 80.0, fs=1000.0), raw)
    return Flight({"rates": stream(time, {"p": filtered, "p_raw": raw})})


def test_noise_before_the_filters_is_measured_or_divided() -> None:
    made = shaken()
    parameters = {"INS_GYRO_FILTER": 80.0}
    chosen, _ = filters(of("ardupilot", parameters, made))
    ((measured,), _) = gyro_noise(of("ardupilot", parameters, made), chosen)
    assert measured.source == "p_raw"
    assert measured.rms_before == pytest.approx(np.hypot(5.0 * np.sqrt(0.96), 8.0 / np.sqrt(2.0)), rel=0.03)
    alone = Flight({"rates": made.streams["rates"][["p"]]})
    ((divided,), _) = gyro_noise(of("ardupilot", parameters, alone), chosen)
    assert divided.source == ""
    low = (divided.frequency > 20.0) & (
        divided.frequency < 90.0
    )  # the made filter runs at 1 kHz: above, its own steps tell
    assert np.allclose(divided.before[low], measured.before[low], rtol=0.1)
    assert np.isnan(divided.before[-1])  # nothing comes through there: what was before cannot be told


def test_one_more_notch_does_what_is_said() -> None:
    ((found,), _) = gyro_noise(of("ardupilot", {"INS_GYRO_FILTER": 80.0}, shaken()), ())
    assert found.peaks[0].frequency == pytest.approx(60.0)
    assert found.peaks[0].rms == pytest.approx(8.0 / np.sqrt(2.0) * 0.87, rel=0.05)
    assert found.notch is not None
    assert found.notch.parameters[2:4] == (("INS_HNTCH_FREQ", 60.0), ("INS_HNTCH_BW", 30.0))
    made = Filter("", "gyro", "notch", 60.0, width=30.0, left=0.01)
    assert found.notch.delay == pytest.approx(made.delay)
    both = of("ardupilot", {f"{name}_ENABLE": 1.0 for name in ("INS_HNTCH", "INS_HNTC2")}, shaken())
    ((found,), _) = gyro_noise(both, ())
    assert found.notch is not None
    assert found.notch.parameters == ()  # both are taken
    ((quiet,), _) = gyro_noise(of("ardupilot", {}, flight(Loop(), 1)), ())
    assert (quiet.peaks, quiet.notch) == ((), None)


def test_a_slow_log_has_no_spectrum_of_noise() -> None:
    slow = Flight({"rates": flight(Loop(), 1).streams["rates"].isel(time=slice(None, None, 16))})
    found, why = gyro_noise(slow, ())
    assert found == ()
    assert "too slowly" in why
