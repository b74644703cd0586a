"""Whether a command answers the motion: loops and open commands whose answer is known, and what cannot be told."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from simulated_loops import Case, Flown, fly
from swashplate.flights import feedback
from swashplate.flights.feedback import ANSWER, NO_NEWS, OWN, AnswerShares, share_of

LOOP = Case(1, plant=(40.0, 3.0, 0.04, 0.02), gains=(0.15, 0.1, 0.0, 1.2, 0.0), gust=(1.0, 0.5, 0.0), seconds=30.0)
OPEN = Case(2, shape="3-2-1-1", size=0.05, gust=(0.5, 1.0, 0.0), sensor=(0.2, 1.0), seconds=30.0)


def told_by_motion(command: np.ndarray, motion: np.ndarray, dt: float, **how: Any) -> AnswerShares:
    """Of one command."""
    (told,) = feedback.told_by_motion(command[:, None], motion, dt, **how)
    return told


def asked(flown: Flown, *channels: str, backwards: bool = False) -> AnswerShares:
    """What the motion of a flight tells of its command."""
    order = slice(None, None, -1) if backwards else slice(None)
    motion = flown.flight.array(channels)[order]
    return told_by_motion(flown.flight.values("command")[order], motion, 1.0 / flown.case.log)


@pytest.fixture(scope="module")
def flights() -> list[Flown]:
    """A loop in gusts; with doublets at its rate's set-point; open 3-2-1-1 in coloured noise; all at 100 Hz."""
    return fly([LOOP, replace(LOOP, shape="doublets", place="rate", size=1.0), OPEN])


@pytest.mark.parametrize("channels", [("p",), ("p", "phi")])
def test_a_loop_without_excitation_answers_and_one_with_it_does_not(
    flights: list[Flown], channels: tuple[str, ...]
) -> None:
    alone, excited, _ = (asked(flown, *channels) for flown in flights)
    assert alone.answer
    assert not alone.independent
    assert alone.past > 0.99
    assert excited.independent
    assert not excited.answer


def test_a_textbook_maneuver_in_coloured_noise_is_no_answer(flights: list[Flown]) -> None:
    """The elevator rests before and after; slow noise of a fifth of the motion is in the log."""
    told = asked(flights[2], "p", "phi")
    assert told.independent
    assert told.news < NO_NEWS


def test_backwards_in_time_cause_and_answer_change_places() -> None:
    """Without gusts the motion backwards runs ahead of the command, as what a controller answers does."""
    (flown,) = fly([replace(OPEN, shape="multisine", gust=(0.01, 1.0, 0.0), sensor=(0.01, 0.0))])
    forwards, backwards = asked(flown, "p"), asked(flown, "p", backwards=True)
    assert forwards.follows
    assert forwards.independent
    assert not backwards.follows
    assert (forwards.past, forwards.later) == (
        pytest.approx(backwards.later, abs=0.05),
        pytest.approx(backwards.past, abs=0.05),
    )


def test_a_force_that_follows_at_once_counts_as_later() -> None:
    random = np.random.default_rng(3)
    command = lfilter([1.0], [1.0, -0.9], random.standard_normal(3000))
    force = -9.0 * command + 0.1 * random.standard_normal(3000)
    as_force = told_by_motion(command, force[:, None], 0.04, at_once=[True])
    assert as_force.independent
    assert as_force.follows
    assert told_by_motion(command, force[:, None], 0.04).answer, "without knowing that it is a force"


def test_an_attitude_that_is_not_logged_is_the_integral_of_the_rate() -> None:
    random = np.random.default_rng(4)
    rate = lfilter([1.0], [1.0, -0.95], random.standard_normal(3000))
    command = -np.cumsum(rate) * 0.04
    assert told_by_motion(command, rate[:, None], 0.04).past > 0.99
    assert told_by_motion(command, rate[:, None], 0.04, memory=False).past < OWN


def test_nothing_is_said_where_nothing_can_be() -> None:
    random = np.random.default_rng(5)
    motion, command = random.standard_normal((400, 2)), random.standard_normal(400)
    assert told_by_motion(command, motion, 0.04).known
    for told in (
        told_by_motion(command[:40], motion[:40], 0.04),
        told_by_motion(np.full(400, 0.3), motion, 0.04),
        told_by_motion(command, np.zeros((400, 2)), 0.04),
        told_by_motion(command[:1], motion[:1], 0.04),
    ):
        assert not told.known
        assert not told.independent
        assert not told.answer
        assert not told.follows
    assert np.isnan(share_of(command, np.zeros((400, 1)), 0.04))


def test_noise_of_its_own_explains_nothing_however_many_channels_are_asked() -> None:
    """Per degree of freedom: in 40 s nine channels of noise leave a command as it is."""
    random = np.random.default_rng(6)
    told = told_by_motion(random.standard_normal(1000), random.standard_normal((1000, 9)), 0.04)
    assert abs(told.past) < 0.1
    assert abs(told.later) < 0.1
    assert told.independent


def test_the_share_of_causes_is_that_which_was_made() -> None:
    """A command whose variance is one half each of a stick that came 80 ms before and of noise."""
    random = np.random.default_rng(7)
    stick, noise = (lfilter([1.0], [1.0, -0.8], random.standard_normal(6000)) for _ in range(2))
    command = np.roll(stick, 2) / stick.std() + noise / noise.std()
    assert share_of(command, stick[:, None], 0.04) == pytest.approx(0.5, abs=0.04)
    assert share_of(command, stick[:, None], 0.04, past=False) < 0.4
    assert share_of(stick, stick[:, None], 0.04) > 0.999


def test_what_changes_only_by_unit_changes_nothing(flights: list[Flown]) -> None:
    flight = flights[0].flight
    motion, command = flight.array(("p", "phi")), flight.values("command")
    told, other = (
        told_by_motion(command, motion, 0.01),
        told_by_motion(5.0 + 1e4 * command, motion * [57.3, -1e-3], 0.01),
    )
    assert (told.past, told.later, told.news, told.fresh) == pytest.approx(
        (other.past, other.later, other.news, other.fresh), abs=1e-6
    )
    assert told.past > ANSWER


def test_several_commands_at_once_are_told_as_each_alone(flights: list[Flown]) -> None:
    flight = flights[0].flight
    motion = flight.array(("p", "phi"))
    commands = np.stack([flight.values("command"), 0.0 * motion[:, 0], np.roll(motion[:, 0], -7)], axis=1)
    together = feedback.told_by_motion(commands, motion, 0.01)
    assert not together[1].known
    for command, told in zip(commands.T[::2], together[::2], strict=True):
        alone = told_by_motion(command, motion, 0.01)
        assert vars(told) == pytest.approx(vars(alone), abs=1e-9)
    assert together[2].follows


def test_a_long_record_is_told_by_a_part_of_its_rows() -> None:
    """The law of ten minutes is found whichever rows are left out."""
    random = np.random.default_rng(8)
    rate = lfilter([1.0], [1.0, -0.9], random.standard_normal(15_000))
    command = -0.5 * np.roll(rate, 1) + 0.1 * rate.std() * random.standard_normal(15_000)
    told = told_by_motion(command, rate[:, None], 0.04)
    assert told.past == pytest.approx(1.0 - 0.1**2 / (0.5**2 + 0.1**2), abs=0.01)
    assert told.answer
