"""`swash respond` on a log whose command only its loops moved: the reason, what to fly, and exit code 2."""

from __future__ import annotations

import json
from pathlib import Path

from commands import swash
from test_frequency_verbs import log as swept_log

import swashplate as sp
from field_cases import loiter_log


def test_it_is_said_with_what_to_fly_and_kept_with_the_responses(shared_data: Path, tmp_path: Path) -> None:
    log = loiter_log(shared_data, tmp_path / "loiter.bin", rate=25, seconds=60)
    asked = ("respond", log, "--inputs", "mixer_roll", "--outputs", "p", "--band", "0.5-6")
    outcome = swash(*asked, "--out", tmp_path / "out")
    assert outcome.code == 2
    assert "'mixer_roll' is a controller's answer: the log holds the set-points of its loop" in outcome.err
    assert "Fly a sweep, or move the sticks and name the set-point with --references." in outcome.err
    assert "What loiter.bin tells without a sweep" in outcome.out
    assert "no step response: the motion comes before its target" in outcome.out
    assert "SID_AXIS 10" in outcome.out
    unnamed = swash("respond", log)
    assert unnamed.code == 2
    assert "No sweep was found" in unnamed.err
    assert "`swash inspect` tells what the flight shows without one" in unnamed.err
    looked = swash("inspect", log, "--json")
    assert json.loads(looked.out)["review"]["next"][0]["parameters"]["SID_AXIS"] == 10.0
    kept = sp.FrequencyResponse.load(tmp_path / "out" / "responses.nc").settings["excitation"]
    assert kept["mixer_roll"]["kind"] == "controller"
    assert "neither a sweep nor a stick nor a set-point" in kept["mixer_roll"]["words"]
    outcome = swash(*asked, "--references", "p_demand")
    assert outcome.code == 2
    assert "'mixer_roll' is a controller's answer" in outcome.err


def test_a_line_without_a_number_is_a_warning_and_the_others_stand(tmp_path: Path) -> None:
    """Without --band the slowest lines are asked too, where a sweep is weak."""
    flown = swept_log(tmp_path / "flown.csv", seed=1, swept=True, seconds=120.0)
    told = swash("respond", flown, "--inputs", "mixer_roll,mixer_pitch", "--outputs", "p,q")
    assert told.code == 0
    assert "no number is given there" in told.out
    for pair in ("p / mixer_roll", "p / mixer_pitch", "q / mixer_roll", "q / mixer_pitch"):
        assert pair in told.out


def test_channels_that_nobody_names_are_those_of_the_sweeps(tmp_path: Path) -> None:
    done = swash("respond", "examples/helicopter_sweeps", "--out", tmp_path / "r", "--json")
    assert done.code == 0, done.err
    found = sp.FrequencyResponse.load(tmp_path / "r" / "responses.nc")
    assert found.inputs == ("mixer_roll", "mixer_pitch")
    assert found.outputs == ("p", "q")
    assert "nputs mixer_roll, mixer_pitch, outputs p, q: what the sweeps moved" in done.err
