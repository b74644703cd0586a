"""Gains in Rotorflight's names: its scales, its law step by step, whole numbers that keep the margins."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from swashplate.control.analysis.ardupilot_gains import GAIN_MARGIN, PHASE_MARGIN, Suggestion, suggest_gains
from swashplate.control.analysis.rate_gain_names import beware, short, written
from swashplate.control.analysis.rate_loop_steps import rate_loop_steps
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import structure

SITL = {
    "Lb": 3588.6, "Ma": 617.5, "tau_f": 0.068232, "Ba": 1.2963, "Ab": -1.3402, "Blat": 0.24493, "Blon": -0.08487,
    "Alat": 0.07285, "Alon": 0.26962, "tau_roll": 0.0534, "tau_pitch": 0.0526,
}  # fmt: skip
FLOWN = {
    f"{axis}_{name}": value
    for axis in ("roll", "pitch")
    for name, value in {
        "p_gain": 50.0, "i_gain": 100.0, "d_gain": 20.0, "f_gain": 100.0, "gyro_cutoff": 50.0, "d_cutoff": 15.0,
    }.items()
}  # fmt: skip


@pytest.fixture(scope="module")
def model() -> StateSpaceModel:
    return structure("rotor_body").with_values(SITL)


@pytest.fixture(scope="module")
def suggested(model: StateSpaceModel) -> tuple[Suggestion, ...]:
    return suggest_gains(model, autopilot=FLOWN)


def _law(model: StateSpaceModel, k: dict[str, float], seconds: float, rate: float) -> np.ndarray:
    """Rotorflight's own law (pid.c, mode 2) in deg/s, for a set-point of 1 rad/s in roll, on the model."""
    a, b, c, _ = model.explicit()
    dt = 1.0 / rate
    i, o, n = model.inputs.index("mixer_roll"), model.outputs.index("p"), a.shape[0]
    held = expm(np.block([[a, b[:, [i]]], [np.zeros((1, n + 1))]]) * dt)
    x, waiting = np.zeros(n), [0.0] * max(1, round(model.delay("p", "mixer_roll") * rate))
    gyro = error = before = slope = 0.0
    tangent = np.tan(np.pi * k["roll_d_cutoff"] * dt)
    rates = []
    for _ in range(round(seconds * rate)):
        u = waiting.pop(0)
        p = float(np.rad2deg(c[o] @ x))
        rates.append(np.deg2rad(p))
        gyro += (1.0 - np.exp(-2.0 * np.pi * k["roll_gyro_cutoff"] * dt)) * (p - gyro)
        target = np.rad2deg(1.0)
        change = -(gyro - before)  # a bilinear differentiator with a limited bandwidth
        slope = 2 * np.pi * k["roll_d_cutoff"] / (1 + tangent) * change + (1 - tangent) / (1 + tangent) * slope
        before = gyro
        error += (target - gyro) * dt
        waiting.append(
            0.00000666666 * k["roll_p_gain"] * (target - gyro) + 0.0002 * k["roll_i_gain"] * error
            + 0.1e-6 * k["roll_d_gain"] * slope + 0.000025 * k["roll_f_gain"] * target
        )  # fmt: skip
        x = held[:n, :n] @ x + held[:n, n] * u
    return np.array(rates)


def test_the_loop_steps_as_the_firmwares_law(model: StateSpaceModel) -> None:
    gains = {name: value for name, value in FLOWN.items() if name.startswith("roll")} | {"roll_d_gain": 300.0}
    found = rate_loop_steps(model, gains, rate="p", command="mixer_roll", seconds=1.0)
    own = _law(model, gains, 1.0, 400.0)
    assert np.abs(found.step[: own.size] - own).max() < 0.02 * np.abs(own).max()
    for name in ("roll_p_gain", "roll_i_gain", "roll_d_gain", "roll_f_gain"):  # every scale is seen
        wrong = rate_loop_steps(model, {**gains, name: 2.0 * gains[name]}, rate="p", command="mixer_roll", seconds=1.0)
        assert np.abs(wrong.step[: own.size] - own).max() > 0.04 * np.abs(own).max(), name


def test_whole_numbers_that_keep_the_margins(suggested: tuple[Suggestion, ...]) -> None:
    roll, pitch = suggested
    assert roll.axis == "roll"
    for found in (roll, pitch):
        assert all(value == round(value) and 0 <= value <= 1000 for value in found.parameters.values())
        assert found.parameters[f"{found.axis}_gyro_cutoff"] == 50.0
        assert not found.margins.gain_margin.value < GAIN_MARGIN
        assert not found.margins.phase_margin.value < PHASE_MARGIN
        assert found.peak < 2.0
        # By hand: the loop of these whole numbers, with the gyro's filter and the derivative's bandwidth.
        omega = np.geomspace(1.0, 200.0, 4000)
        s, k = 1j * omega, {name.split("_", 1)[1]: value for name, value in found.parameters.items()}
        scale = 0.1e-6 if found.axis == "roll" else 1.0e-6
        law = 0.00000666666 * k["p_gain"] + 0.0002 * k["i_gain"] / s
        law = law + scale * k["d_gain"] * s / (1.0 + s / (2.0 * np.pi * k["d_cutoff"]))
        law = np.rad2deg(1.0) * law / (1.0 + s / (2.0 * np.pi * k["gyro_cutoff"]))
        least = np.abs(1.0 + law * found.loop.plant(omega)).min()
        assert 1.0 / least == pytest.approx(found.peak, rel=0.01)
    # One over the steady rate per command (3.5897 rad/s per unit), in units of 2.5e-5 a deg/s.
    assert roll.parameters["roll_f_gain"] == pytest.approx(np.deg2rad(1.0) / 3.5897 / 2.5e-5, abs=6.0)
    assert "error are not in the loop" in roll.words
    assert "roll_p_gain" in repr(roll)
    assert f"{roll.parameters['roll_p_gain']:.0f} " in repr(roll)


def test_flown_gains_are_judged_too(suggested: tuple[Suggestion, ...]) -> None:
    roll, _ = suggested
    assert roll.flown["roll_i_gain"] == 100.0
    assert np.isfinite(roll.flown_peak)
    assert set(roll.steps()) == {"suggested", "flown"}


def test_a_model_of_the_wrong_sign_gets_none(model: StateSpaceModel) -> None:
    turned = model.with_values({**SITL, "Lb": -3588.6, "Ma": -617.5})
    for found in suggest_gains(turned, autopilot=FLOWN):
        assert found.parameters == {}
        assert found.words.startswith("none:")


def test_names_there_and_back_and_what_is_not_judged() -> None:
    gains = {"yaw_p_gain": 40.0, "yaw_d_cutoff": 20.0, "yaw_f_gain": 7.0}
    assert written("yaw", short(gains)) == gains
    assert short({"ATC_RAT_YAW_P": 0.3}) == {"P": 0.3}
    assert "1.6 dB" in beware("yaw", {"yaw_stop_gain_0": 120.0, "yaw_stop_gain_1": 80.0})
    assert beware("RLL", {}) == ""
