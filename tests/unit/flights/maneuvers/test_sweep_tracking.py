"""A sweep followed along its own frequency: what goes with it is kept, what a loop adds beside it is not."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from swashplate.flights.maneuvers.series import parse
from swashplate.flights.maneuvers.sweep_tracking import Course, Ridge, course_of
from swashplate.flights.maneuvers.sweeps import rising

TIME = np.arange(10_000) / 100.0


def program() -> np.ndarray:
    return np.asarray(parse("sweep:roll,0.1-6Hz,90s,0.1").signals(TIME - 5.0)["roll"])


def hand() -> np.ndarray:
    """The same band at a speed that wanders, with a rest of 2 s from which it goes on at another phase."""
    random = np.random.default_rng(3)
    wander = lfilter([1.0], [1.0, -np.exp(-0.01 / 3.0)], np.sqrt(2.0 * 0.01 / 3.0) * random.standard_normal(TIME.size))
    held = (TIME > 60.0) & (TIME < 62.0)
    frequency = 0.1 * 40.0 ** (TIME / 100.0) * np.exp(0.08 * wander)
    phase = 2.0 * np.pi * np.cumsum(np.where(held, 0.0, frequency)) * 0.01 + 0.7 * (TIME > 61.0)
    return np.asarray(np.where(held, 0.0, 0.1 * np.sin(phase)))


def gusts(seed: int, size: float) -> np.ndarray:
    """Slow noise, as a loop answers gusts: 0.3 Hz and below."""
    noise = np.random.default_rng(seed).standard_normal(TIME.size)
    slow = lfilter([1.0], [1.0, -np.exp(-0.01 * 2.0 * np.pi * 0.3)], noise)
    return np.asarray(size * slow / np.std(slow))


def followed(signal: np.ndarray) -> tuple[np.ndarray, Course]:
    ridge = rising(TIME, signal)
    assert ridge is not None
    course = course_of(TIME, signal, ridge)
    return course.in_signal(signal), course


def common(one: np.ndarray, other: np.ndarray) -> float:
    return float(one @ other / np.sqrt((one @ one) * (other @ other)))


@pytest.mark.parametrize(("sweep", "lawful", "least"), [(program(), True, 0.95), (hand(), False, 0.9)])
def test_the_sweep_is_kept_and_what_gusts_add_is_not(sweep: np.ndarray, lawful: bool, least: float) -> None:
    added = gusts(1, 0.05)
    found, course = followed(sweep + added)
    assert course.lawful is lawful
    assert common(found, sweep) > least
    assert common(found, sweep) > common(sweep + added, sweep)
    # What a loop makes of gusts is 40 % of this signal's size, and nearly nothing of what follows the sweep.
    assert abs(common(found, added)) < 0.5 * abs(common(sweep + added, added))


def test_a_lawful_sweep_is_followed_from_its_first_to_its_last_cycle() -> None:
    _, course = followed(program() + gusts(2, 0.01))
    span = TIME[course.inside]
    assert span[0] < 9.0
    assert span[-1] == pytest.approx(95.0, abs=2.0)
    law = np.gradient(course.phase, 0.01)[500] / (2.0 * np.pi)
    at = span[500] - 5.0
    assert law == pytest.approx(0.1 + 5.9 * np.expm1(4.0 * at / 90.0) / np.expm1(4.0), rel=0.05)


def test_a_law_is_not_carried_far_beyond_its_sweep() -> None:
    """Two sweeps in one log of 600 s: an exponential law, carried on to its end, would turn more than 1e9 times."""
    long = np.arange(60_000) / 100.0
    signal = sum(np.asarray(parse("sweep:roll,0.1-10Hz,110s,0.1").signals(long - at)["roll"]) for at in (5.0, 200.0))
    ridge = rising(long[:15_000], signal[:15_000])
    assert ridge is not None
    course = course_of(long, signal, ridge)
    assert course.lawful
    assert course.phase.size == course.inside.sum() < 15_000
    assert np.all(np.diff(course.phase) < np.pi)


def test_a_course_at_another_frequency_or_time_follows_nothing() -> None:
    sweep = program() + gusts(1, 0.05)
    ridge = rising(TIME, sweep)
    assert ridge is not None
    inside = (ridge.start <= TIME) & (ridge.stop >= TIME)
    power = {}
    for factor in (1.0, 0.5, 2.0):
        frequency = factor * np.interp(TIME[inside], ridge.time, ridge.frequency)
        course = Course(inside, 2.0 * np.pi * np.cumsum(frequency) * 0.01, lawful=False)
        power[factor] = float(np.mean(course.in_signal(sweep) ** 2))
    assert power[1.0] > 10.0 * max(power[0.5], power[2.0])


def test_a_doublet_beside_the_sweep_is_left_out() -> None:
    doublets = parse("doublet:roll,1s,0.3").signals(TIME - 97.0)["roll"]
    found, _ = followed(program() + doublets)
    assert np.all(found[TIME > 97.5] == 0.0)


def test_a_ridge_knows_its_ends() -> None:
    ridge = Ridge(np.array([1.0, 2.0]), np.array([0.5, 0.6]), np.ones(2), 0.9)
    assert (ridge.start, ridge.stop) == (1.0, 2.0)
