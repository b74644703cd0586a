"""Whose a sweep is: by what the log says, otherwise by what moves most of what it ever moves."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.errors import FlightError
from swashplate.flights.maneuvers.ardupilot_chirp import AXES, MIXER, MOVED
from swashplate.flights.provenance import Event
from swashplate.identification.responses.excitations import SweepOfCommand, ToldSweeps, only_answering, owners_of


def one(*size: float, axis: str = "", channel: str = "", share: float = 0.5) -> SweepOfCommand:
    return SweepOfCommand({}, np.array(size), np.full(len(size), share), "1.0 to 2.0 s, all", axis, channel)


def test_every_axis_of_the_firmware_reaches_one_command_first() -> None:
    assert set(MOVED) == set(AXES)
    for axis, (words, _) in AXES.items():
        for part, channel in (
            ("roll", "mixer_roll"),
            ("lateral", "mixer_roll"),
            ("pitch", "mixer_pitch"),
            ("longitudinal", "mixer_pitch"),
            ("yaw", "mixer_yaw"),
            ("collective", "mixer_collective"),
        ):
            assert (MOVED[axis] == channel) or part not in words.split(), (axis, words)
    assert [MOVED[axis] for axis in MIXER.values()] == ["mixer_roll", "mixer_pitch", "mixer_yaw", "mixer_collective"]


def test_the_command_that_the_log_names_owns_its_sweep_whatever_it_moves() -> None:
    sweeps = [
        one(1.0, 0.9, axis="roll mixer", channel="mixer_roll"),
        one(0.9, 1.0, axis="pitch mixer", channel="mixer_pitch"),
    ]
    commands = ["mixer_roll", "mixer_pitch"]
    assert owners_of(sweeps, commands, 1, called={}) == commands
    assert owners_of(sweeps, ["lateral", "mixer_pitch"], 1, called={"lateral": "mixer_roll"}) == [
        "lateral",
        "mixer_pitch",
    ]
    answering = [one(0.3, *each.size, axis=each.axis, channel=each.channel) for each in sweeps]
    assert owners_of(answering, ["mixer_yaw", *commands], 1, called={}) == commands
    assert owners_of(sweeps, ["mixer_roll"], 1, called={}) == ["mixer_roll", ""]


def test_a_servo_behind_the_commands_takes_the_sweep_that_moves_it_most() -> None:
    """It is no command of another axis, and carries what the log's own command does."""
    sweeps = [
        one(1.0, 1.0, 0.2, axis="roll mixer", channel="mixer_roll"),
        one(0.4, 0.2, 1.0, axis="pitch mixer", channel="mixer_pitch"),
    ]
    commands = ["rcout_1", "mixer_roll", "mixer_pitch"]
    assert owners_of(sweeps, commands, 1, called={}) == ["rcout_1", "mixer_pitch"]
    both = [
        one(1.0, 1.0, 0.2, axis="roll mixer", channel="mixer_roll"),
        one(0.9, 0.2, 1.0, axis="pitch mixer", channel="mixer_pitch"),
    ]
    with pytest.raises(
        FlightError, match=r"rcout_1: was moved alike by sweeps of several axes, roll mixer .*, pitch mixer"
    ):
        owners_of(both, commands, 1, called={})


def test_without_a_word_of_the_log_an_input_that_only_answers_owns_nothing() -> None:
    sweeps = [one(1.0, 0.3), one(0.5, 1.0)]
    assert owners_of(sweeps, ["stick_roll", "stick_pitch"], 1, called={}) == ["stick_roll", "stick_pitch"]
    # Commands one behind the other move alike: the named one keeps its sweep.
    assert owners_of([one(1.0, 1.0), one(0.9, 0.95)], ["servo", "stick"], 1, called={}) == ["servo", "servo"]


def test_sweeps_that_the_log_calls_one_axis_have_one_owner() -> None:
    sweeps = [one(1.0, 0.3, axis="axis 10"), one(0.5, 1.0, axis="axis 10")]
    assert len(set(owners_of(sweeps, ["stick_roll", "stick_pitch"], 2, called={}))) == 1


def test_only_commands_that_rate_loops_make_answer() -> None:
    event = Event(1.0, "sweep", "roll mixer", {"axis": 10, "start": 1.0, "stop": 9.0, "channel": "mixer_roll"})
    told = [ToldSweeps(0, (event,))]
    names = ["mixer_roll", "mixer_pitch", "mixer_yaw", "mixer_collective", "rcout_1"]
    assert only_answering(told, names, called={}) == ("mixer_pitch", "mixer_yaw")
    assert only_answering(told, ["tail"], called={"tail": "mixer_yaw"}) == ("tail",)
    assert only_answering([ToldSweeps(0, ())], names, called={}) == ()
    unknown = Event(1.0, "sweep", "axis 30", {"axis": 30, "start": 1.0, "stop": 9.0})
    assert only_answering([ToldSweeps(0, (event, unknown))], names, called={}) == ()
