"""Estimators beside a flight: they find what flies, hold on where nothing flies, and say what they cannot follow."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import IdentificationError
from swashplate.links.estimating import Estimating, KnownNow
from swashplate.simulation.trim import Trim

ROLL = "p_dot = Lp*p + La*servo_roll + bias"


@lru_cache(maxsize=2)
def hover(mass: float) -> Trim:
    return sp.trim(sp.vehicle("coax").with_values({"mass": mass}))


def hovered(running: Estimating, mass: float, steps: int) -> KnownNow:
    about = hover(mass)
    for _ in range(steps):
        running.step(running.dt, about.state, about.inputs, about.environment.voltage)
    return running.known[-1]


def test_what_flies_is_heavier_than_the_model_and_that_is_found() -> None:
    said: list[str] = []
    running = Estimating(sp.vehicle("coax"), ["mass"], rate=100.0, seed=1, say=said.append)
    assert running.known == (KnownNow("mass", "kg", 0.302),)
    last = hovered(running, 0.36, 600)
    assert last.sigma is not None
    assert last.value is not None
    assert last.sigma < 0.1 * 0.2 * 0.302  # of what was not known at the start
    assert abs(last.value - 0.36) < 2.5 * last.sigma
    assert abs(last.value - 0.302) > 5.0 * last.sigma  # and not the model's
    assert len(said) == 1
    assert said[0].startswith("estimated: mass 0.3")
    running.pause()
    lying = hovered(running, 0.36, 1)
    assert running.frozen == "a clock that jumped"
    assert lying.value == pytest.approx(last.value, abs=0.2 * last.sigma)


def test_an_equation_of_motion_is_followed() -> None:
    coax = sp.vehicle("coax")
    running = Estimating(coax, [ROLL], rate=100.0, seed=2)
    about, rate = hover(0.302), 0.0
    p, servo = coax.index("p"), coax.input_names.index("servo_roll")
    for k in range(1000):
        command = 0.1 * sum(np.sin(2.0 * np.pi * f * 0.01 * k + 7.0 * f * f) for f in (0.3, 0.7, 1.1, 1.6))
        x, u = about.state.copy(), about.inputs.copy()
        x[p], u[servo] = rate, command
        running.step(0.01, x, u, 12.0)
        rate = rate * np.exp(-0.03) + command * 20.0 / 3.0 * (1.0 - np.exp(-0.03))
    damping, effect, _ = running.known
    assert damping.sigma is not None
    assert damping.value is not None
    assert effect.value is not None
    assert abs(damping.value + 3.0) < 2.5 * damping.sigma < 0.3
    assert abs(effect.value - 20.0) < 0.5
    assert (damping.name, damping.unit, damping.model) == ("Lp", "(rad/s^2)/(rad/s)", None)


def test_before_a_flight_tells_it_no_number_is_given() -> None:
    running = Estimating(sp.vehicle("coax"), [ROLL], rate=100.0)
    assert [str(one) for one in running.known] == ["Lp not told yet", "La not told yet", "bias not told yet"]


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (["p_dot = Lp*p + La*aileron"], "aileron: is no channel of coax; there are x, y, z"),
        (["weight"], "weight: is no parameter of it"),
        ([" , "], "names nothing"),
        (["p_dot = "], "is no equation"),
    ],
)
def test_what_cannot_be_followed_is_said(asked: list[str], words: str) -> None:
    with pytest.raises(IdentificationError, match=words):
        Estimating(sp.vehicle("coax"), asked, rate=100.0)
