"""Suggested rate-loop gains keep their margins on the model they were made for."""

from __future__ import annotations

import re
from functools import lru_cache

import numpy as np
import pytest
from scipy import signal

from swashplate.control.analysis.ardupilot_gains import GAIN_MARGIN, OVERSHOOT, PHASE_MARGIN, Suggestion, suggest_gains
from swashplate.models.linear.state_space_file import structure

SITL = {
    "Lb": 3588.6, "Ma": 617.5, "tau_f": 0.068232, "Ba": 1.2963, "Ab": -1.3402, "Blat": 0.24493, "Blon": -0.08487,
    "Alat": 0.07285, "Alon": 0.26962, "tau_roll": 0.0534, "tau_pitch": 0.0526,
}  # fmt: skip


@lru_cache(maxsize=1)
def suggested() -> tuple[Suggestion, ...]:
    return suggest_gains(structure("rotor_body").with_values(SITL))


def test_gains_of_the_simulated_helicopter() -> None:
    roll, pitch = suggested()
    # Feed-forward: one over the steady rate per command (true DC gains 3.5897 and 3.9515 rad/s per unit).
    assert abs(roll.parameters["ATC_RAT_RLL_FF"] * 3.5897 - 1.0) < 0.03
    assert abs(pitch.parameters["ATC_RAT_PIT_FF"] * 3.9515 - 1.0) < 0.03
    for found in (roll, pitch):
        read = found.margins
        assert not read.gain_margin.value < GAIN_MARGIN
        assert not read.phase_margin.value < PHASE_MARGIN
        assert found.peak < 2.0
        # The closed loop is stable: Nyquist's curve of this stable plant does not go round -1.
        omega = np.geomspace(0.01, 500.0, 20000)
        broken = found.loop.controller(found.parameters, omega) * found.loop.plant(omega)
        turns = np.unwrap(np.angle(1.0 + broken))
        assert abs(turns[-1] - turns[0]) < np.pi
    # The firmware's own hand-tuned P for this helicopter is 0.06 in roll.
    assert 0.03 < roll.parameters["ATC_RAT_RLL_P"] < 0.12


def test_an_axis_that_the_model_lacks_gets_none() -> None:
    assert suggest_gains(structure("heave")) == ()


def test_the_controllers_filters_cost_margin_and_are_suggested_with_the_gains() -> None:
    model = structure("rotor_body").with_values(SITL)
    flown = {"ATC_RAT_RLL_P": 0.06, "ATC_RAT_RLL_I": 0.105, "ATC_RAT_RLL_D": 0.0, "ATC_RAT_RLL_FF": 0.21}
    unfiltered, _ = suggest_gains(model, autopilot={**flown, "ATC_RAT_RLL_FLTE": 0.0})
    filtered, _ = suggest_gains(model, autopilot={**flown, "ATC_RAT_RLL_FLTE": 20.0})
    assert filtered.parameters["ATC_RAT_RLL_FLTE"] == 20.0
    assert unfiltered.parameters["ATC_RAT_RLL_FLTE"] == 0.0
    # Where the loop is at -180 degrees, 20 Hz take the phase of a first-order filter, and the gain margin with it.
    without, behind = unfiltered.flown_margins.omega_180.value, filtered.flown_margins.omega_180.value
    assert behind < without

    def turned(omega: float, *filters: complex) -> float:
        """From -180 degrees, by hand."""
        own = 0.06 + 0.105 / (1j * omega)
        return float(np.degrees(np.angle(-own * model.response(np.array([omega]))[0, 0, 0] * np.prod(filters))))

    assert turned(behind, 1.0 / (1.0 + 1j * behind / (40.0 * np.pi))) == pytest.approx(0.0, abs=0.1)
    # A rate from before the gyro's filter: the loop has that filter all the same.
    raw, _ = suggest_gains(
        model, autopilot={**flown, "ATC_RAT_RLL_FLTE": 20.0, "INS_GYRO_FILTER": 20.0}, sources={"p": "p_sid"}
    )
    at = raw.flown_margins.omega_180.value
    gyro = signal.freqs(*signal.butter(2, 40.0 * np.pi, analog=True), [at])[1][0]
    assert turned(at, gyro, 1.0 / (1.0 + 1j * at / (40.0 * np.pi))) == pytest.approx(0.0, abs=0.1)


def _all(**gains: float) -> dict[str, float]:
    return {f"ATC_RAT_{axis}_{name}": value for axis in ("RLL", "PIT") for name, value in gains.items()}


def test_what_gains_buy_and_cost_is_said_and_a_step_overshoots_little() -> None:
    model = structure("rotor_body").with_values(SITL)
    flown = _all(P=0.06, I=0.105, D=1e-4, FF=0.21, FLTT=20.0, FLTE=20.0, FLTD=0.0)
    roll, pitch = suggest_gains(model, autopilot=flown)
    for found in (roll, pitch):
        before, after = found.figures_flown, found.figures_suggested
        assert before.overshoot > 0.4  # the filter of the demand takes it away
        assert after.overshoot <= OVERSHOOT
        assert after.rejection > 1.2 * before.rejection
        assert after.coupling < before.coupling
        assert any("overshoot" in words for words in found.buys)
        assert any("gain margin" in words for words in found.costs)
        assert all(words in repr(found) for words in (*found.buys, *found.costs))
        steps = found.steps()
        assert steps["suggested"].overshoot == pytest.approx(after.overshoot)
        assert steps["flown"].overshoot == pytest.approx(before.overshoot)
    # Disturbance rejection by hand: the sensitivity of P and I on the model, where it is -3 dB.
    s = 1j * np.array([roll.figures_flown.rejection])
    own = (0.06 + 0.105 / s + 1e-4 * s) / (1.0 + s / (40.0 * np.pi))
    assert abs(1.0 / (1.0 + own * model.response(s.imag)[:, 0, 0])) == pytest.approx(0.708, rel=0.01)


def test_a_loop_with_phase_to_spare_and_a_high_crossover_is_called_out_by_its_delay_margin() -> None:
    """Yaw nearly an integrator, without delay: any gain keeps its phase, and time is what the suggestion pays with."""
    model = structure("yaw").with_values({"Nr": -1.3, "Nped": 30.0, "tau_yaw": 0.0})
    flown = {"ATC_RAT_YAW_P": 0.1, "ATC_RAT_YAW_I": 0.01, "ATC_RAT_YAW_D": 0.0, "ATC_RAT_YAW_FLTE": 0.0}
    (yaw,) = suggest_gains(model, autopilot=flown)
    before, after = yaw.figures_flown.margins, yaw.figures_suggested.margins
    assert after.phase_margin.value > PHASE_MARGIN
    assert after.crossover.value < 2.0 * np.pi * 40.0  # seen, and not beyond what is judged
    assert after.delay_margin.value < 0.5 * before.delay_margin.value
    assert any(words.startswith("delay margin") for words in yaw.costs)
    assert re.search(r"^  delay margin +60\.\d+ ms +732\.\d ms$", repr(yaw), re.MULTILINE)
    # The same crossing by hand.
    at = before.crossover.value
    lag = np.pi + np.angle(yaw.loop.controller(flown, np.array([at])) * yaw.loop.plant(np.array([at])))[0]
    assert before.delay_margin.value == pytest.approx(lag / at, rel=1e-3)


def test_flown_gains_that_nothing_beats_are_kept() -> None:
    model = structure("rotor_body").with_values(SITL)
    first = suggested()
    good = {name: value for found in first for name, value in found.parameters.items()}
    again = suggest_gains(model, autopilot=good)
    for found in again:
        assert found.parameters == found.flown
        assert "Keep what you fly" in found.words
        assert not found.costs
    narrow = suggest_gains(model, autopilot=good | {"ATC_RAT_RLL_P": 2.0 * good["ATC_RAT_RLL_P"]})
    assert narrow[0].parameters != narrow[0].flown  # these keep no 6 dB


def test_the_steady_rate_is_the_models_and_not_that_of_a_slow_sweep() -> None:
    """At a pole of 1.3 rad/s the gain at 0.2 Hz is 28 % below the steady one."""
    (yaw,) = suggest_gains(structure("yaw").with_values({"Nr": -1.3, "Nped": 30.0, "tau_yaw": 0.05}))
    assert yaw.parameters["ATC_RAT_YAW_FF"] == pytest.approx(1.3 / 30.0, rel=1e-6)
    assert yaw.figures_suggested.overshoot <= OVERSHOOT


@pytest.mark.parametrize("damping", [-0.02, -6.0])
def test_yaw_that_goes_on_turning_gets_no_feed_forward(damping: float) -> None:
    (yaw,) = suggest_gains(structure("yaw").with_values({"Nr": damping, "Nped": 30.0, "tau_yaw": 0.05}))
    slow = damping == -0.02
    assert yaw.parameters["ATC_RAT_YAW_FF"] == pytest.approx(0.0 if slow else 6.0 / 30.0, rel=0.03)
    assert ("no feed-forward" in yaw.words) == slow
    # An integrator with a delay keeps 6 dB up to pi/4 over the delay, with I and the filter somewhat less.
    assert 3.0 < yaw.parameters["ATC_RAT_YAW_P"] * 30.0 < np.pi / 4 / 0.05
    assert yaw.margins.gain_margin.value >= GAIN_MARGIN
    assert yaw.margins.phase_margin.value >= PHASE_MARGIN


def test_an_unstable_rate_gets_no_gains_but_a_reason() -> None:
    (yaw,) = suggest_gains(structure("yaw").with_values({"Nr": 3.0}), autopilot={"ATC_RAT_YAW_P": 0.2})
    assert yaw.parameters == {}
    assert "unstable mode at 3 rad/s" in yaw.words
    assert yaw.flown == {"ATC_RAT_YAW_P": 0.2}
    (slow,) = suggest_gains(structure("yaw").with_values({"Nr": 0.2}))
    assert "0.2 rad/s" in slow.words
    assert slow.parameters


@pytest.mark.parametrize("flown_integral", [0.0446, 0.005])
def test_a_disturbance_that_lasts_fades_and_what_becomes_worse_is_named(flown_integral: float) -> None:
    """A hardly damped, quick yaw (a CoaX's): an integral of the feed-forward's size left 175 deg/s after 2 s."""
    model = structure("yaw").with_values({"Nr": -1.0, "Nped": 870.0, "tau_yaw": 0.012})
    own = {"P": 0.0297, "I": flown_integral, "D": 0.0, "FF": 0.0, "FLTT": 20.0, "FLTD": 20.0}
    (yaw,) = suggest_gains(model, autopilot={f"ATC_RAT_YAW_{name}": value for name, value in own.items()})
    before, after, steps = yaw.figures_flown, yaw.figures_suggested, yaw.steps()
    assert yaw.parameters != yaw.flown
    assert np.degrees(after.left) < 20.0
    assert (after.left > 1.2 * before.left) == any(words.startswith("left of a disturbance") for words in yaw.costs)
    assert any(words.startswith("left of a disturbance") for words in yaw.costs) == (flown_integral == 0.0446)
    assert after.noise > before.noise
    assert any(words.startswith("noise of the gyro in the command") for words in yaw.costs)
    for figures, name in ((before, "flown"), (after, "suggested")):
        shaken = np.abs(steps[name].disturbance)
        assert figures.shaken == pytest.approx(shaken.max())
        assert figures.left == pytest.approx(shaken[-80:].max())
