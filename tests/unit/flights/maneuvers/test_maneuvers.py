"""Maneuvers: their shapes, their spectra, and what a wrong description is told."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import swashplate as sp
from swashplate.errors import ManeuverError
from swashplate.flights.maneuvers.series import DEFAULT_AMPLITUDE, HOVER, KINDS, Maneuver, parse

INPUTS = ("motor_lower", "motor_upper", "servo_roll", "servo_pitch")


def test_a_sweep_goes_through_its_band_and_fades() -> None:
    sweep = parse("sweep:pitch,0.5-8Hz,60s")
    time = np.arange(60_000) / 1000.0
    signal = sweep.signals(time)["pitch"]
    assert sweep.amplitude == DEFAULT_AMPLITUDE["pitch"]
    assert 0.99 * sweep.amplitude < np.max(np.abs(signal)) <= sweep.amplitude
    assert abs(signal[0]) < 1e-6
    assert abs(signal[-1]) < 1e-3
    crossings = time[1:][np.diff(np.signbit(signal).astype(int)) != 0]
    frequency = 0.5 / np.diff(crossings)
    assert frequency[2] == pytest.approx(0.5, rel=0.15)
    assert frequency[-3] == pytest.approx(8.0, rel=0.05)
    assert np.median(np.diff(frequency)) > 0.0


def test_zero_outside_of_its_time() -> None:
    time = np.array([-1.0, -1e-9, 60.0, 61.0])
    for text in ("sweep:roll,0.5-8Hz,60s", "step:roll,60s", "doublet:roll,30s"):
        assert np.all(parse(text).signals(time)["roll"] == 0.0)


@pytest.mark.parametrize(
    ("text", "pattern"),
    [
        ("doublet:roll,0.5s,0.2", [1, -1]),
        ("3-2-1-1:roll,0.5s,0.2", [1, 1, 1, -1, -1, 1, -1]),
        ("step:roll,0.5s,0.2", [1]),
    ],
)
def test_blocks(text: str, pattern: list[int]) -> None:
    maneuver = parse(text)
    assert maneuver.duration == pytest.approx(0.5 * len(pattern))
    middle = 0.25 + 0.5 * np.arange(len(pattern))
    np.testing.assert_allclose(maneuver.signals(middle)["roll"], 0.2 * np.array(pattern))


def test_multisine_axes_are_uncorrelated_and_flat() -> None:
    multisine = parse("multisine:roll+pitch+yaw,0.2-8Hz,30s,0.1")
    time = np.arange(30_000) / 1000.0
    signals = np.stack(list(multisine.signals(time).values()))
    correlation = np.corrcoef(signals)
    np.testing.assert_allclose(correlation - np.eye(3), 0.0, atol=1e-10)
    peaks = np.max(np.abs(signals), axis=1)
    np.testing.assert_allclose(peaks, 0.1, rtol=0.01)
    # Schroeder's phases: relative peak factor (peak / rms / sqrt 2) below 1.4 (random phases: above 2).
    assert np.all(peaks / signals.std(axis=1) / np.sqrt(2.0) < 1.4)


def test_axes_move_the_right_inputs() -> None:
    axes = sp.vehicle("coax").stick_axes
    time = np.array([0.1])
    heave = parse("step:collective,1s,0.1").offsets(time, inputs=INPUTS, axes=axes)
    yaw = parse("step:yaw,1s,0.1").offsets(time, inputs=INPUTS, axes=axes)
    named = parse("step:motor_upper,1s,0.1").offsets(time, inputs=INPUTS, axes=axes)
    assert [heave[name][0] for name in INPUTS] == [0.1, 0.1, 0.0, 0.0]
    assert [yaw[name][0] for name in INPUTS] == [-0.1, 0.1, 0.0, 0.0]
    assert [named[name][0] for name in INPUTS] == [0.0, 0.1, 0.0, 0.0]
    with pytest.raises(ManeuverError, match="the vehicle has no axis and no input 'rudder'"):
        parse("step:rudder,1s").offsets(time, inputs=INPUTS, axes=axes)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("swep:pitch,0.5-8Hz,60s", "does not begin with one of sweep"),
        ("sweep", "and a colon"),
        ("sweep:pitch,0.5-8Hz", "says no time"),
        ("sweep:pitch,0.5-8Hz,0s", "lasts no time"),
        ("step:roll,1s,0.1,0.2", "says its amplitude twice"),
        ("sweep:roll,0.5-8Hz,2Hz,60s", "says its band twice"),
        ("multisine:roll+roll,0.5-8Hz,10s", "names an axis twice"),
        ("sweep:pitch,60s", "needs a band"),
        ("doublet:pitch,0.5-8Hz,1s", "has no band"),
        ("sweep:pitch,8-0.5Hz,60s", "does not rise"),
        ("sweep:pitch,0.5-8Hz,60s,-0.2", "'-0.2' in"),
        ("sweep:pitch,0.5-8Hz,60s,0", "amplitude of 0"),
        ("sweep:pitch+roll,0.5-8Hz,60s", "moves one axis"),
        ("sweep:Pitch!,0.5-8Hz,60s", "is no axis"),
        ("sweep:pitch,0.05-8Hz,20s", "periods of 0.05 Hz, expected at least 4"),
    ],
)
def test_a_wrong_description_is_explained(text: str, says: str) -> None:
    with pytest.raises(ManeuverError, match=says):
        parse(text)


@settings(max_examples=50, deadline=None)
@given(st.sampled_from(sorted(KINDS.keys() - {HOVER})), st.floats(0.01, 1.0), st.floats(10.0, 60.0))
def test_no_maneuver_exceeds_its_amplitude(kind: str, amplitude: float, duration: float) -> None:
    band = {"sweep": (0.5, 4.0), "multisine": (0.5, 4.0), "sine": (2.0, 2.0)}.get(kind)
    signal = Maneuver(kind, ("roll",), duration, amplitude, band).signals(np.linspace(-1.0, duration + 1.0, 5001))[
        "roll"
    ]
    assert np.max(np.abs(signal)) <= 1.01 * amplitude


@settings(max_examples=50, deadline=None)
@given(st.text(max_size=40))
def test_any_text_parses_or_is_explained(text: str) -> None:
    try:
        found = parse(text)
    except ManeuverError:
        return
    assert found.duration > 0.0


def test_a_multirotor_says_itself_which_motors_an_axis_moves() -> None:
    crazyflie = sp.vehicle("crazyflie")
    moved = parse("step:heave,1s,0.1").offsets(np.array([0.1]), inputs=crazyflie.input_names, axes=crazyflie.stick_axes)
    assert all(values[0] == pytest.approx(0.1) for values in moved.values())
    turned = parse("step:yaw,1s,0.1").offsets(np.array([0.1]), inputs=crazyflie.input_names, axes=crazyflie.stick_axes)
    assert {np.sign(values[0]) for values in turned.values()} == {1.0, -1.0}


def test_a_hover_moves_nothing_for_its_time() -> None:
    hover = parse("hover:20s")
    assert (hover.axes, hover.duration) == ((), 20.0)
    assert hover.signals(np.zeros(3)) == {}
    added = hover.offsets(np.arange(3.0), inputs=("a",))
    np.testing.assert_array_equal(added["a"], 0.0)
    for text in ("hover:roll,20s", "hover:", "hover:0s"):
        with pytest.raises(ManeuverError, match="says no time alone"):
            parse(text)
