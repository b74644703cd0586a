"""Gains in Betaflight's names from a response: its scales, whole numbers, margins with ANGLE mode, and refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import swashplate as sp
from swashplate.arrays import Complex
from swashplate.control.analysis.ardupilot_gains import Suggestion
from swashplate.control.analysis.kept_margins import GAIN_MARGIN, PEAK, PHASE_MARGIN, keeps_with_angle
from swashplate.control.analysis.rate_gain_names import DTERM, axes_of, cli_lines, firmware_of, short, untuned, written
from swashplate.control.analysis.rate_loop import SEEN
from swashplate.identification.frequency.transfer_function_fit import fit_transfer_function
from swashplate.identification.responses.frequency_response import FrequencyResponse

FLOWN = {
    "p_roll": 45.0, "i_roll": 80.0, "d_roll": 30.0, "p_pitch": 47.0, "i_pitch": 84.0, "d_pitch": 34.0,
    "p_yaw": 45.0, "i_yaw": 80.0, "d_yaw": 0.0, "yaw_lowpass_hz": 100.0, DTERM: 50.0,
}  # fmt: skip


OMEGA = 2.0 * np.pi * np.geomspace(1.0, 15.0, 80)


def plant(omega: np.ndarray = OMEGA) -> Complex:
    """The roll rate of `x8` per mixer command as its log gave it: motors late by 0.06 s, and 1 ms."""
    s = 1j * omega
    return np.asarray(3796.0 * np.exp(-0.001 * s) / (s * (s + 17.13)))


def suggested(h: Complex, **flown: float) -> Suggestion:
    shape, one = (OMEGA.size, 1, 1), np.ones((OMEGA.size, 1, 1))
    made = FrequencyResponse(
        OMEGA, ("mixer_roll",), ("p",), h.reshape(shape), one, one[:, :, 0], 0.01 * one, one[:, :, 0], one[:, :, 0], one
    )
    known = {"excitation": {"mixer_roll": {"kind": "sweep", "words": ""}}, "autopilot": FLOWN | flown}
    known["firmware"] = "Betaflight 2026.12.0-alpha"
    responses = replace(made, settings=known)
    (roll,) = sp.suggest_gains(fit_transfer_function(responses, "0/2", input="mixer_roll"), responses)
    return roll


def test_a_late_vehicle_gets_more_of_everything_with_named_lines_that_are_better() -> None:
    """Flown under the firmware: phase margin 54 degrees where the defaults had 15 (docs/proof.md)."""
    roll = suggested(plant())
    assert roll.refused == ""
    assert roll.margins.phase_margin.value >= PHASE_MARGIN > 2.0 * roll.flown_margins.phase_margin.value
    assert roll.peak <= PEAK < roll.flown_peak
    assert roll.figures_suggested.rejection > 2.0 * roll.figures_flown.rejection
    assert all(value == round(value) and 0.0 <= value <= 250.0 for value in roll.parameters.values())
    assert any(text.startswith("phase margin") for text in roll.buys)
    assert any(text.startswith("noise of the gyro") for text in roll.costs)


def test_no_crossover_beyond_what_was_measured() -> None:
    """Of a quick vehicle stronger gains would keep every margin on the model, where nobody has measured it."""
    roll = suggested(6.0 * plant())
    assert roll.margins.crossover.value <= OMEGA[-1] * 1.02


def test_where_nothing_is_better_the_flown_gains_are_kept() -> None:
    first = suggested(plant())
    again = suggested(plant(), **first.parameters)
    assert again.parameters == again.flown == first.parameters
    assert again.words.startswith("Keep what you fly")


def test_a_rate_loop_that_is_too_slow_for_the_angle_around_it_is_told() -> None:
    loop = 20.0 / (1j * SEEN) * np.exp(-0.01j * SEEN)
    quick, slow = np.stack([loop, 0.2 * loop])
    assert keeps_with_angle(SEEN, np.stack([quick, slow]), np.stack([quick, slow])).tolist() == [True, False]
    assert GAIN_MARGIN == 6.0


def test_scales_are_those_of_its_pid_loop() -> None:
    """pid.h of 2026.12: terms of a thousandth of the command, per deg/s, deg and deg/s^2."""
    k = short({"p_roll": 45.0, "i_roll": 80.0, "d_roll": 30.0, DTERM: 50.0})
    per_degree = 1e-3 * np.degrees(1.0)
    assert (k["P"], k["I"], k["D"]) == pytest.approx(
        (45.0 * 0.032029 * per_degree, 80.0 * 0.244381 * per_degree, 30.0 * 0.000529 * per_degree)
    )
    assert (k["FLTD"], k["FLTG"]) == (50.0, 0.0)  # the derivative is that of the gyro
    assert written("Roll", k) == {"p_roll": 45.0, "i_roll": 80.0, "d_roll": 30.0, DTERM: 50.0}
    assert firmware_of("Roll") == "Betaflight"
    assert firmware_of("roll") == "Rotorflight"
    assert firmware_of("YAW") == "ArduPilot"


def test_what_a_command_line_takes() -> None:
    assert cli_lines({"p_roll": 62.0, "d_roll": 225.0, DTERM: 50.0}) == [
        "set p_roll = 62", "set d_roll = 225", "set d_max_roll = 225"
    ]  # fmt: skip
    assert cli_lines({"roll_p_gain": 50.0}) == ["set roll_p_gain = 50"]


def test_a_log_without_these_gains_is_refused() -> None:
    assert untuned("Betaflight 2026.12.0-alpha", FLOWN) == ""
    assert "2025.12" in untuned("Betaflight 4.5.1", {})
    assert tuple(axes_of(FLOWN)) == ("Roll", "Pitch", "Yaw")
