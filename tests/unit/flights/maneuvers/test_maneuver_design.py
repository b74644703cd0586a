"""Design rules, each once kept and once broken; the predicted coherence against a simulated one; ArduPilot's chirp."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from swashplate.errors import ManeuverError
from swashplate.flights.maneuvers.ardupilot_chirp import Chirp
from swashplate.flights.maneuvers.maneuver_design import (
    ExpectedResponse,
    RuleCheck,
    checks,
    excited_band,
    full_until,
    input_density,
    predicted_coherence,
    sampled,
)
from swashplate.flights.maneuvers.multisine import dealt, relative_peak_factor, wave
from swashplate.flights.maneuvers.series import parse


def _check(text: str, rule: str, *, rate: float = 100.0, **known: float) -> RuleCheck:
    return next(c for c in checks(parse(text), rate=rate, vehicle=ExpectedResponse(**known)) if c.rule == rule)


@pytest.mark.parametrize(
    ("rule", "kept", "broken"),
    [
        ("sample rate", "sweep:roll,0.5-4Hz,60s", "sweep:roll,0.5-8Hz,60s"),
        ("windows", "sweep:roll,0.5-4Hz,10s", "sweep:roll,0.5-3Hz,10s"),
        ("averaging", "sweep:roll,0.5-4Hz,10s", "sweep:roll,0.5-4Hz,9s"),
        ("length", "multisine:roll+pitch,0.2-4Hz,10s", "multisine:roll+pitch,0.1-4Hz,10s"),
        ("harmonics", "multisine:roll+pitch,0.2-4Hz,10s", "multisine:roll+pitch,0.2-2Hz,8s"),
        ("orthogonal axes", "multisine:roll+pitch,0.2-4Hz,10s", "multisine:roll+pitch,0.2-4Hz,10.004s"),
        ("length", "sine:roll,2Hz,5s", "sine:roll,2Hz,5.2s"),
        ("length", "sine:roll,2Hz,2.5s", "sine:roll,2Hz,2s"),
        ("sample rate", "doublet:roll,0.5s", "doublet:roll,0.055s"),
        ("sample rate", "3211:roll,0.1s", "3211:roll,0.05s"),
    ],
)
def test_a_rule_kept_and_broken(rule: str, kept: str, broken: str) -> None:
    if rule == "orthogonal axes":  # off by a third of a sample at 20 Hz
        assert _check(kept, rule, rate=100.0).met
        assert not _check("multisine:roll+pitch,0.5-4Hz,3.3s", rule, rate=2.0).met
        return
    assert _check(kept, rule).met
    assert not _check(broken, rule).met


def test_the_band_is_held_against_what_is_known_of_the_response() -> None:
    for text, rule, known, met in (
        ("sweep:roll,0.5-8Hz,60s", "low end", {"bandwidth": 1.0}, True),
        ("sweep:roll,0.6-8Hz,60s", "low end", {"bandwidth": 1.0}, False),
        ("sweep:roll,0.5-8Hz,60s", "high end", {"f180": 3.2}, True),
        ("sweep:roll,0.5-8Hz,60s", "high end", {"f180": 3.5}, False),
        ("doublet:roll,0.5s", "band", {"bandwidth": 0.75}, True),
        ("doublet:roll,0.5s", "band", {"bandwidth": 3.0}, False),
        ("doublet:roll,0.5s,0.2", "amplitude", {"noise": 0.01, "gain": 1.0}, True),
        ("doublet:roll,0.5s,0.2", "amplitude", {"noise": 0.03, "gain": 1.0}, False),
    ):
        assert _check(text, rule, **known).met is met, (text, rule)


def test_a_doublet_excites_what_its_spectrum_says() -> None:
    # |X| of a doublet of unit T is sin^2(pi f T) / (pi f); its peak is at 0.371 / T (tan x = 2 x at x = 1.1656).
    low, high = excited_band(parse("doublet:roll,0.5s"))
    f = np.linspace(0.001, 2.0, 20_000)
    power = (np.sin(np.pi * f * 0.5) ** 2 / (np.pi * f)) ** 2
    strong = f[power >= 0.1 * power.max()]
    assert low == pytest.approx(strong[0], abs=0.02)
    assert high == pytest.approx(strong[-1], abs=0.02)
    assert f[np.argmax(power)] * 0.5 == pytest.approx(1.1656 / np.pi, abs=1e-3)


@pytest.mark.parametrize("text", ["sweep:roll,0.5-8Hz,100s,0.1", "multisine:roll,0.5-8Hz,100s,0.1"])
def test_the_predicted_coherence_is_the_one_that_is_measured(text: str) -> None:
    rate, noise, gain = 100.0, 0.3, 2.0
    maneuver = parse(text)
    time = np.arange(int(100 * rate)) / rate
    x = maneuver.signals(time)["roll"]
    predicted = predicted_coherence(maneuver, rate=rate, noise=noise, gain=gain)
    assert 0.2 < predicted < 0.8
    rng = np.random.default_rng(1)
    measured = []
    for _ in range(20):
        y = gain * x + noise * rng.standard_normal(x.size)
        # The whole record untapered (it begins and ends at zero); the average over records takes the chance out.
        measured.append([np.fft.rfft(s) for s in (x, y)])
    xx, yy = (np.mean([np.abs(m[i]) ** 2 for m in measured], axis=0) for i in (0, 1))
    xy = np.mean([np.conj(m[0]) * m[1] for m in measured], axis=0)
    f = np.fft.rfftfreq(x.size, 1.0 / rate)
    if "multisine" in text:
        inside = (f > 0.6) & (f < 7.9)
        least = np.sum(np.abs(xy[inside]) ** 2 / xx[inside]) / np.sum(yy[inside])
    else:
        near = np.searchsorted(f, full_until(maneuver) - 0.5)
        inside = slice(near - 30, near + 30)
        least = np.sum(np.abs(xy[inside]) ** 2 / xx[inside]) / np.sum(yy[inside])
    assert least == pytest.approx(predicted, abs=0.12)


def test_the_needed_amplitude_gives_the_wanted_coherence() -> None:
    known = ExpectedResponse(noise=0.5, gain=2.0, coherence=0.8)
    first = next(
        c for c in checks(parse("sweep:roll,0.5-8Hz,60s,0.1"), rate=200.0, vehicle=known) if c.rule == "amplitude"
    )
    assert not first.met
    needed = float(first.expected.split()[3])
    again = parse(f"sweep:roll,0.5-8Hz,60s,{1.01 * needed:.6f}")
    assert predicted_coherence(again, rate=200.0, noise=0.5, gain=2.0) == pytest.approx(0.8, abs=0.01)
    with pytest.raises(ManeuverError, match="make no sense together"):
        checks(again, rate=200.0, vehicle=ExpectedResponse(noise=0.5, gain=0.0))
    with pytest.raises(ManeuverError, match="has no band"):
        input_density(parse("doublet:roll,1s"))


def test_a_sweeps_density_is_what_its_power_sums_to() -> None:
    maneuver = parse("sweep:roll,0.5-8Hz,60s,0.1")
    time = np.arange(60_000) / 1000.0
    x = maneuver.signals(time)["roll"]
    f = np.fft.rfftfreq(x.size, 1e-3)
    density = 2.0 * np.abs(np.fft.rfft(x)) ** 2 / (1000.0 * x.size)
    top = full_until(maneuver)
    assert top == pytest.approx(6.6, abs=0.1)  # it fades out over its last 3 s
    near = (f > top - 0.5) & (f < top - 0.2)
    assert density[near].mean() == pytest.approx(input_density(maneuver), rel=0.1)


@pytest.mark.parametrize(("low", "high", "duration", "axes"), [(0.2, 6.0, 20.0, 3), (0.5, 4.0, 8.0, 1)])
def test_multisines_are_flatter_than_schroeders_begin_at_zero_and_share_no_harmonic(
    low: float, high: float, duration: float, axes: int
) -> None:
    own = dealt(low, high, duration, axes=axes)
    assert sum(map(len, own)) == len(set(np.concatenate(own).tolist()))
    time = np.arange(int(200 * duration)) / 200.0
    for harmonics in own:
        n = np.arange(1, harmonics.size + 1)
        schroeder = np.cos(2 * np.pi * np.outer(time / duration, harmonics) - np.pi * n * (n - 1) / n.size).sum(axis=1)
        signal = wave(harmonics, time, duration=duration)
        assert relative_peak_factor(signal) < relative_peak_factor(schroeder) - 0.05
        assert relative_peak_factor(signal) < 1.18
        assert abs(signal[0]) < 1e-9
        assert np.max(np.abs(signal)) == pytest.approx(1.0, abs=5e-3)
        spectrum = np.abs(np.fft.rfft(signal))
        strong = np.flatnonzero(spectrum > 1e-6 * spectrum.max())
        np.testing.assert_array_equal(strong, harmonics)
        assert np.ptp(spectrum[harmonics]) < 1e-6 * spectrum.max()
    again = wave(own[0], time, duration=duration)
    np.testing.assert_array_equal(again, wave(own[0], time, duration=duration))
    assert_allclose(wave(own[0], time + duration, duration=duration), again, atol=1e-9)


def test_a_sine_and_the_samples_of_a_maneuver() -> None:
    data = sampled(parse("sine:roll,2Hz,5s,0.1"), rate=50.0)
    assert data.sizes["time"] == 251
    assert_allclose(data["roll"].values[:-1], 0.1 * np.sin(4 * np.pi * data["time"].values[:-1]), atol=1e-12)
    assert relative_peak_factor(data["roll"].values) == pytest.approx(1.0, abs=0.01)
    both = sampled(parse("multisine:roll+pitch,0.2-4Hz,10s"), rate=50.0)
    assert set(both.data_vars) == {"roll", "pitch"}
    with pytest.raises(ManeuverError, match="makes no sense"):
        sampled(parse("sine:roll,2Hz,5s,0.1"), rate=0.0)
    with pytest.raises(ManeuverError, match="one frequency above zero"):
        parse("sine:roll,1-2Hz,5s")
    with pytest.raises(ManeuverError, match="does not rise"):
        parse("sweep:roll,2Hz,50s")


CHIRP = Chirp.planned(10, 0.15, (0.5, 8.0), record=60.0, fade=3.0)


def test_the_chirp_dwells_then_rises_exponentially_and_fades() -> None:
    assert CHIRP.dwell == 4.0
    assert_allclose(CHIRP.frequency(np.array([-1.0, 0.0, 4.0, 32.0, 60.0, 61.0])), [0.5, 0.5, 0.5, 2.0, 8.0, 8.0])
    time = np.arange(0.0, 60.0, 1e-3)
    signal = CHIRP.signal(time)
    assert np.max(np.abs(signal)) <= 0.15
    assert np.all(CHIRP.signal(np.array([-1.0, 0.0, 60.001])) == 0.0)
    crossings = time[1:][np.diff(np.signbit(signal).astype(int)) != 0]
    measured = 0.5 / np.diff(crossings)
    middle = 0.5 * (crossings[1:] + crossings[:-1])
    assert_allclose(measured, CHIRP.frequency(middle), rtol=0.03)
    half = np.abs(signal[(time > 58.4) & (time < 58.6)]).max()  # in the middle of the fade: 0.55 at its begin
    assert 0.15 * 0.45 < half < 0.15 * 0.56
    # The phase is continuous where the dwell ends.
    assert np.max(np.abs(np.diff(CHIRP.signal(np.array([4.0 - 1e-7, 4.0 + 1e-7]))))) < 1e-6
    single = Chirp.planned(7, 5.0, (2.0, 2.0), record=10.0, fade=0.0)
    assert_allclose(
        single.signal(np.array([5.125, 0.0625])), 5.0 * np.sin(2 * np.pi * 2.0 * np.array([5.125, 0.0625 - 1]))
    )


def test_the_parameter_file() -> None:
    assert CHIRP.parameter_file().split() == [
        "SID_AXIS,10", "SID_MAGNITUDE,0.15", "SID_F_START_HZ,0.5", "SID_F_STOP_HZ,8.0", "SID_T_FADE_IN,3.0",
        "SID_T_REC,60.0", "SID_T_FADE_OUT,3.0",
    ]  # fmt: skip
    assert (CHIRP.axis_name, CHIRP.unit) == ("roll mixer", "1")


@pytest.mark.parametrize(
    ("band", "record", "says"),
    [
        ((0.5, 130.0), 60.0, "SID_F_STOP_HZ: is 130"),
        ((0.05, 8.0), 300.0, "SID_T_REC: is 300"),
        ((0.5, 8.0), 3.0, "dwells"),
    ],
)
def test_what_ardupilot_does_not_take_is_refused(band: tuple[float, float], record: float, says: str) -> None:
    with pytest.raises(ManeuverError, match=says):
        Chirp.planned(10, 0.1, band, record=record, fade=1.0)
