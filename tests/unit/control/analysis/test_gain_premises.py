"""The gate before gains: each premise is taken away in turn, and no gains come out; with all of them they do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from swashplate.arrays import Complex
from swashplate.control.analysis import ardupilot_gains
from swashplate.control.analysis.ardupilot_gains import Suggestion
from swashplate.control.analysis.gain_premises import refuse_turned_commands
from swashplate.control.analysis.rate_gain_names import untuned
from swashplate.control.analysis.rate_loop_steps import rate_loop_steps
from swashplate.errors import ControllerError
from swashplate.identification.frequency.transfer_function_fit import fit_transfer_function
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.state_space_file import structure
from swashplate.validation.refutation import OPEN, REFUTED, STANDS, Judgement

OMEGA = 2.0 * np.pi * np.geomspace(0.3, 12.0, 80)
SWEPT = {"mixer_roll": {"kind": "sweep", "words": "a sweep."}}
FLOWN = {
    "ATC_RAT_RLL_P": 0.135, "ATC_RAT_RLL_I": 0.09, "ATC_RAT_RLL_D": 0.0036, "ATC_RAT_RLL_FLTT": 20.0,
    "ATC_RAT_RLL_FLTE": 0.0, "ATC_RAT_RLL_FLTD": 20.0,
}  # fmt: skip


def plant(omega: np.ndarray = OMEGA) -> Complex:
    """A quadrotor's roll rate: a motor's lag and 15 ms."""
    s = 1j * omega
    return 45.0 * np.exp(-0.015 * s) / ((s + 0.5) * (1.0 + 0.03 * s))


def answer(omega: np.ndarray = OMEGA) -> Complex:
    """Minus the inverse of the controller of `FLOWN`: what its log shows where nothing was swept."""
    s = 1j * omega
    return -1.0 / (0.135 + 0.09 / s + 0.0036 * s / (1.0 + s / (40.0 * np.pi)))


def measured(h: Complex, **settings: Any) -> FrequencyResponse:
    shape = (OMEGA.size, 1, 1)
    one = np.ones(shape)
    made = FrequencyResponse(
        OMEGA, ("mixer_roll",), ("p",), h.reshape(shape), one, one[:, :, 0], 0.01 * one, one[:, :, 0], one[:, :, 0], one
    )
    known = {"excitation": SWEPT, "autopilot": FLOWN, "firmware": "ArduCopter V4.5.7"}
    return replace(made, settings={**known, **settings})


def suggested(responses: FrequencyResponse, form: str = "0/2") -> Suggestion:
    fit = fit_transfer_function(responses, form, input="mixer_roll")
    (roll,) = sp.suggest_gains(fit, responses)
    return roll


def test_where_every_premise_holds_there_are_gains_of_the_flown_sign() -> None:
    roll = suggested(measured(plant()))
    assert roll.refused == ""
    assert 0.0 < roll.parameters["ATC_RAT_RLL_P"] < 1.0
    assert roll.buys, "something named is better"
    assert all(value >= 0.0 for value in roll.parameters.values())


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"excitation": {}}, "nothing tells what moved 'mixer_roll'"),
        ({"excitation": {"mixer_roll": {"kind": "unknown", "words": "Fly a sweep."}}}, "(unknown): Fly a sweep."),
        ({"excitation": {"mixer_roll": {"kind": "controller", "words": "It answers."}}}, "(controller): It answers."),
        ({"firmware": "ArduPlane V4.5.7 (00000000)"}, "ArduPlane V4.5.7"),
        ({"firmware": "Betaflight 2025.12.1"}, "none that this program tunes"),
        ({"firmware": "PX4"}, "none that this program tunes"),
    ],
)
def test_each_premise_of_the_log_is_needed(settings: Mapping[str, Any], told: str) -> None:
    roll = suggested(measured(plant(), **settings))
    assert roll.parameters == {}
    assert roll.refused.startswith("none: ")
    assert told in roll.refused


@pytest.mark.parametrize("kind", ["sweep", "reference", "sticks", "maneuver"])
def test_whatever_moved_it_from_outside_will_do(kind: str) -> None:
    told = {"mixer_roll": {"kind": kind, "words": ""}}
    assert suggested(measured(plant(), excitation=told)).parameters


def test_a_renamed_command_is_known_by_the_logs_name() -> None:
    """`fit-ss --rename stick=mixer_roll`: what moved it is told of the log's channel."""
    renamed = replace(measured(plant(), channels={"stick": "mixer_roll"}), inputs=("stick",))
    for kind in ("sweep", "controller"):
        told = {"mixer_roll": {"kind": kind, "words": ""}}
        responses = replace(renamed, settings={**renamed.settings, "excitation": told})
        (roll,) = sp.suggest_gains(fit_transfer_function(responses, "0/2", input="stick"), responses)
        assert bool(roll.parameters) == (kind == "sweep"), roll.words


def test_a_stick_the_other_way_gets_no_gains() -> None:
    roll = suggested(measured(-plant(), autopilot={}))
    assert "turns p negative" in roll.refused
    assert roll.parameters == {}


def test_a_band_that_does_not_tell_the_sign_gets_none() -> None:
    responses = measured(plant())
    fit = fit_transfer_function(responses, "0/2", input="mixer_roll", band=(3.0, 4.0))
    (roll,) = sp.suggest_gains(fit, responses)
    assert "sign from mixer_roll to p is not known" in roll.refused


def test_a_controllers_answer_gets_none_even_where_it_is_called_a_sweep() -> None:
    """The sign of it is not an aircraft's, and the flown gains are unstable on it: both must refuse by themselves."""
    responses = measured(answer())
    assert "sign" in suggested(responses, "2/2").refused
    fit = fit_transfer_function(responses, "2/2", input="mixer_roll")
    (roll,) = ardupilot_gains.suggest_gains(fit, autopilot=FLOWN, premise=lambda rate, command: "")
    assert "the model is refuted" in roll.refused
    assert "the aircraft flew" in roll.refused
    assert roll.flown == FLOWN
    assert "it is unstable" not in repr(roll), "what flew is not called unstable"


@pytest.mark.parametrize("verdict", [REFUTED, STANDS, OPEN])
@pytest.mark.parametrize("seen", [(), ("sweep.csv 1.00-8.00 s",)])
def test_a_flight_that_refutes_the_model_gives_none_and_is_called_held_out_only_where_it_was(
    verdict: str, seen: tuple[str, ...]
) -> None:
    responses = measured(plant())
    fit = fit_transfer_function(responses, "0/2", input="mixer_roll")
    along: Any = SimpleNamespace(
        judgement=Judgement(verdict, ("p misses by 40 % of the motion.",)), fitted_sources=seen
    )
    (roll,) = sp.suggest_gains(fit, responses, unseen=along)
    whose = "the fit's own flight (NOT a held-out one)" if seen else "the held-out flight"
    told = f"{whose} refutes the model: p misses by 40 % of the motion." in roll.refused
    assert told == (roll.parameters == {}) == (verdict == REFUTED)


def test_flown_gains_refute_a_model_and_do_not_where_they_are_stable() -> None:
    """Mutation of the delay: with 15 ms the flown loop is stable, with 400 ms it is not; the sampled loop agrees."""
    for delay, refuted in ((0.015, False), (0.4, True)):
        model = structure("yaw").with_values({"Nr": -0.5, "Nped": 45.0, "tau_yaw": delay})
        flown = {name.replace("RLL", "YAW"): value for name, value in FLOWN.items()}
        (yaw,) = ardupilot_gains.suggest_gains(model, autopilot=flown)
        steps = rate_loop_steps(model, flown, rate="r", command="mixer_yaw")
        assert steps.stable != refuted
        assert ("the model is refuted" in yaw.refused) == refuted


def test_a_model_that_turns_against_its_command_gets_no_negative_gain() -> None:
    model = structure("yaw").with_values({"Nr": -6.0, "Nped": -30.0, "tau_yaw": 0.03})
    (yaw,) = ardupilot_gains.suggest_gains(model)
    assert yaw.parameters == {}
    assert "would be negative" in yaw.refused


def test_a_model_that_does_not_follow_the_response_gets_none() -> None:
    roll = suggested(measured(plant()), "1/1 no delay")
    assert "does not follow p / mixer_roll: J = " in roll.refused


def test_flown_gains_are_kept_where_nothing_named_is_better() -> None:
    first = suggested(measured(plant()))
    again = suggested(measured(plant(), autopilot=first.parameters))
    assert again.parameters == again.flown
    assert again.words.startswith("Keep what you fly")
    weak = {**first.parameters, "ATC_RAT_RLL_P": 0.3 * first.parameters["ATC_RAT_RLL_P"]}
    assert suggested(measured(plant(), autopilot=weak)).buys


def test_firmwares() -> None:
    five = {"roll_p_gain": 50.0}
    assert untuned("", {}) == untuned("ArduCopter V4.7.0-dev (1234abcd)", {}) == untuned("APM:Copter V3.5", {}) == ""
    assert untuned("Rotorflight 4.4.0", five) == ""
    assert "five gains" in untuned("Rotorflight 4.2", {})
    assert untuned("ArduPilot", {"ATC_RAT_YAW_P": 0.2}) == ""
    assert "does not name" in untuned("ArduPilot", {"INS_GYRO_FILTER": 20.0})
    for other in ("ArduRover V4.2", "ArduSub V4.1.2", "INAV 7.1.2 (00000000) MATEKF722SE", "unnamed (Blackbox)"):
        assert other in untuned(other, {"ATC_RAT_RLL_P": 0.1})


def test_a_vehicle_behind_a_reversed_mapping_is_refused_by_name() -> None:
    omega = np.geomspace(1.0, 200.0, 200)
    h = np.zeros((omega.size, 4, 4), dtype=np.complex128)
    for k, sense in enumerate((1.0, 1.0, 1.0, -1.0)):
        h[:, k, k] = sense * plant(omega)
    names = {"commands": ("roll", "pitch", "yaw", "throttle"), "outputs": ("p", "q", "r", "down"), "where": "it"}
    refuse_turned_commands(omega, h, **names)  # type: ignore[arg-type]
    for k, name in enumerate(names["commands"]):
        turned = h.copy()
        turned[:, k, k] *= -1.0
        with pytest.raises(ControllerError, match=f"a positive {name} command makes"):
            refuse_turned_commands(omega, turned, **names)  # type: ignore[arg-type]
