"""Before gusts are blamed every input of the log is asked: one that moved what the model leaves is named."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter, lsim

from swashplate.flights.flight import Flight, stream
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import parse
from swashplate.validation.verify import other_inputs, verify

ROLL = """
kind = "state-space"
name = "roll"
[states]
p = "rad/s"
[inputs]
mixer_roll = "1"
[equations]
p = {p = "Lp", mixer_roll = "Lroll"}
[parameters]
Lp = {value = -6.0, unit = "1/s"}
Lroll = {value = 25.0, unit = "rad/s^2"}
[outputs.p]
of = {p = "1"}
"""
TIME = np.arange(0.0, 60.0, 0.01)


@pytest.fixture(scope="module")
def roll() -> StateSpaceModel:
    return parse(ROLL)


def smooth(seed: int, over: float = 0.2) -> np.ndarray:
    """Noise that fades over some seconds, of unit size."""
    keep = np.exp(-0.01 / over)
    made = lfilter([1.0], [1.0, -keep], np.random.default_rng(seed).standard_normal(TIME.size))
    return np.asarray(made / made.std())


def flown(*, pitch: np.ndarray, gust: np.ndarray, answers: float = 0.0) -> Flight:
    """p' = -6 p + 25 roll + 10 pitch + gust behind servos of 50 ms.

    With `answers` a loop gives the pitch command of the rate that the gust makes of q.
    """
    roll = 0.01 * smooth(1)
    q = lsim(([1.0], [1.0, 4.0]), gust, TIME)[1]
    command = pitch - answers * q
    servo = lsim(([1.0], [0.05, 1.0]), 25.0 * roll + 10.0 * command, TIME)[1]
    p = lsim(([1.0], [1.0, 6.0]), servo + gust, TIME)[1]
    noise = np.random.default_rng(2).standard_normal((2, TIME.size))
    table = {"mixer_roll": roll, "mixer_pitch": command, "p": p + 0.005 * noise[0], "q": q + 0.005 * noise[1]}
    return Flight({"uniform": stream(TIME, table)})


def test_the_input_that_moved_it_is_named_instead_of_gusts(roll: StateSpaceModel) -> None:
    found = verify(roll, flown(pitch=0.3 * smooth(3), gust=0.05 * smooth(4)), outputs=["p"])
    (text,) = [words for words in found.warnings if "Theil" in words]
    assert "other inputs explain much: 'mixer_pitch' (9" in text
    assert "Add them to it." in text
    assert "gusts" not in text


def test_gusts_are_blamed_where_no_other_input_did_it(roll: StateSpaceModel) -> None:
    found = verify(roll, flown(pitch=0.3e-3 * smooth(3), gust=3.0 * smooth(4)), outputs=["p"])
    assert any("may be no input (gusts)" in words for words in found.warnings)


def test_an_input_that_answers_the_same_gusts_is_not_named(roll: StateSpaceModel) -> None:
    """The pitch loop feels the gust that rolls the aircraft: what it does goes with the error, and is no cause."""
    flight = flown(pitch=0.0 * TIME, gust=3.0 * smooth(4), answers=0.05)
    found = verify(roll, flight, outputs=["p"])
    assert any("may be no input (gusts)" in words for words in found.warnings)
    error = {"p": [(TIME, flight.values("p"))]}
    assert other_inputs([flight], ["mixer_roll"], error) == {}
    free = flown(pitch=0.3 * smooth(3), gust=0.05 * smooth(4))
    assert set(other_inputs([free], ["mixer_roll"], {"p": [(TIME, free.values("p"))]})) == {"p"}
