"""Which pairs are fitted over which bands, channels of other names, and what a structure is told to lack."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import swashplate as sp
from coupled_helicopter import matrices, measured
from swashplate.errors import IdentificationError
from swashplate.identification.frequency.fitted_pairs import PairChoice
from swashplate.identification.frequency.response_names import under_names_of
from swashplate.identification.frequency.state_space_fit import fit_state_space
from swashplate.identification.frequency.structure_score import lacking_words, parts_in
from swashplate.identification.responses.frequency_response import TWO_PI, FrequencyResponse
from swashplate.models.linear.state_space_file import structure

HEAVE_YAW = structure("compose:heave+yaw")


@pytest.fixture(scope="module")
def responses() -> FrequencyResponse:
    return measured(*matrices(), noise=0.01, averages=30.0).select(("w", "r"), ("pedal", "collective"))


def test_bands_of_pairs_channels_and_all(responses: FrequencyResponse) -> None:
    choice = PairChoice((0.2, 4.0), {"r/collective": (0.5, 2.0), "pedal": (0.3, 3.0)}, ("w / pedal",))
    targets, ceilings, missing = choice.targets(HEAVE_YAW, responses)
    ends = {t.name: (t.omega[0] / TWO_PI, t.omega[-1] / TWO_PI) for t in targets}
    assert ends["r / collective"] == pytest.approx((0.5, 2.0), rel=0.07)
    assert ends["r / pedal"] == pytest.approx((0.3, 3.0), rel=0.07)
    assert ends["w / collective"] == pytest.approx((0.2, 4.0), rel=0.07)
    assert not any(t.name == "w / pedal" for t in (*targets, *ceilings))
    assert "w / pedal" not in missing
    whole = PairChoice().targets(HEAVE_YAW, responses)
    assert "w / pedal" in (*[t.name for t in whole[0]], *whole[2]), "without the option it is there"


def test_what_is_left_out_and_its_bands_are_kept_with_the_result(responses: FrequencyResponse) -> None:
    fit = fit_state_space(
        HEAVE_YAW, responses, bands={"r/pedal": (0.3, 3.0)}, without=("r/collective", "w/pedal"), starts=1
    )
    assert [t.name for t in fit.targets] == ["w / collective", "r / pedal"]
    assert fit.settings["without"] == ["r/collective", "w/pedal"]
    assert fit.settings["bands_hz"] == {"r/pedal": [0.3, 3.0]}


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        (PairChoice(without=("r/colective",)), "'without' is given for 'r/colective'.*Did you mean 'r/collective'"),
        (PairChoice(bands={"q": (1.0, 2.0)}), "a band is given for 'q', which is no output"),
        (PairChoice(without=("w", "r")), "left out as asked: w, r"),
    ],
)
def test_a_pair_that_is_none_is_refused(responses: FrequencyResponse, choice: PairChoice, words: str) -> None:
    with pytest.raises(IdentificationError, match=words):
        choice.targets(HEAVE_YAW, responses)


def test_ardupilots_unfiltered_rate_is_taken_as_the_rate_and_said(responses: FrequencyResponse) -> None:
    logged = replace(responses, outputs=("w", "r_sid"))
    called, words = under_names_of(HEAVE_YAW, logged)
    assert called.outputs == ("w", "r")
    assert words == ("the responses' 'r_sid' is taken as the model's 'r'.",)
    assert called.settings["channels"] == {"r": "r_sid"}, "a hold-out is read in the same way"
    study = sp.fit_ss(HEAVE_YAW, logged, starts=1)
    assert study.remarks == words
    assert any(t.output == "r" for t in study.fit.targets)  # type: ignore[union-attr]
    both = replace(responses, outputs=("r", "r_sid"))
    assert under_names_of(HEAVE_YAW, both)[0].outputs == ("r", "r_sid"), "the filtered one is there"


def test_other_names_are_given_or_hinted_at(responses: FrequencyResponse) -> None:
    logged = replace(responses, outputs=("w", "r_imu"), inputs=("mixer_yaw", "mixer_collective"))
    _, words = under_names_of(HEAVE_YAW, logged)
    assert words == (
        "the responses' 'r_imu' is not fitted: the model has no such output. If it is 'r', say --rename r=r_imu.",
    )
    with pytest.raises(IdentificationError, match="Say --rename pedal=mixer_yaw,collective=mixer_collective"):
        PairChoice().targets(HEAVE_YAW, logged)
    given = {"r": "r_imu", "pedal": "mixer_yaw", "collective": "mixer_collective", "p": "p_imu"}
    called, _ = under_names_of(HEAVE_YAW, logged, given)
    assert (called.outputs, called.inputs) == (("w", "r"), ("pedal", "collective"))
    with pytest.raises(IdentificationError, match="have a channel of that name beside 'r_imu'"):
        under_names_of(HEAVE_YAW, logged, {"w": "r_imu"})


@pytest.mark.parametrize(
    ("name", "missed", "words"),
    [
        ("compose:body", ["ax / longitudinal"], "'flap' (ax / longitudinal)"),
        ("compose:body", ["p / lateral"], "Try compose:body+flap, or --search"),
        ("compose:body+flap_decoupled+torque", ["q / lateral"], "Try compose:body+flap+torque"),
        ("compose:body+flap", ["r / collective"], "Try compose:body+flap+torque"),
        ("compose:body+flap+torque", ["az / collective"], "Try compose:body+flap+inflow+torque"),
        ("compose:body+flap", ["r / pedal"], "Try compose:body+flap+gyro"),
        ("hybrid", ["p / lateral"], "'bar' (p / lateral)"),
        ("thirteen_state", ["az / collective"], "'inflow' (az / collective)"),
    ],
)  # fmt: skip
def test_what_this_structure_may_lack_is_named(name: str, missed: list[str], words: str) -> None:
    model = structure(name)
    told = lacking_words(model, missed)
    assert words in told
    assert not any(f"'{part}'" in told for part in parts_in(model)), "what it has is not lacking"


def test_another_kind_of_aircraft_gets_no_parts_of_a_helicopter() -> None:
    assert lacking_words(structure("coaxial"), ["p / servo_roll"]) == ""


def test_a_fit_says_what_its_structure_may_lack(responses: FrequencyResponse) -> None:
    fit = fit_state_space(HEAVE_YAW, responses, starts=1)
    (words,) = (text for text in fit.warnings if "not all of the aircraft" in text)
    assert "may be lacking are 'torque' (r / collective)" in words
    assert "Try compose:heave+yaw+torque, or --search." in words


def test_a_response_that_comes_later_than_the_others_of_its_input_is_fitted(responses: FrequencyResponse) -> None:
    values = {"Zw": -0.7, "Zcol": -20.0, "Nr": -2.0, "Nped": 30.0, "Ncol": 8.0, "tau_col": 0.02, "tau_r_col": 0.06}
    own = structure("compose:heave+yaw+r/collective")
    truth = own.with_values(values)
    rows = [truth.outputs.index(name) for name in responses.outputs]
    columns = [truth.inputs.index(name) for name in responses.inputs]
    scatter = np.exp(0.01 * np.random.default_rng(0).standard_normal(responses.response.shape))
    there = replace(responses, response=truth.response(responses.omega)[:, rows][:, :, columns] * scatter)
    found = fit_state_space(own, there, starts=1)
    for name in ("tau_col", "tau_r_col"):
        assert found.solution.numbers()[name] == pytest.approx(values[name], abs=3e-3)
    assert found.cost < 0.2 * fit_state_space(HEAVE_YAW, there, starts=1).cost
