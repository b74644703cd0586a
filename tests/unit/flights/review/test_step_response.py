"""Step responses of rate loops from ordinary flights: known ones come back within their bands, others are refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rate_loops import RATE, Loop, flight, gusts, sticks
from swashplate.arrays import Array
from swashplate.flights.flight import Flight, stream
from swashplate.flights.maneuvers.sweeps import Sweep
from swashplate.flights.review import step_response as module
from swashplate.flights.review.review import review

WITHIN = 2.2  # standard errors: Student's 97.5 % for the parts that are left out


def truth(loop: Loop) -> tuple[Array, Array, Array]:
    """Time and response of the loop itself, and delay, rise, overshoot, final value and bandwidth of it."""
    time, response = loop.truth()
    grid = np.arange(round(module.AFTER * module.FASTEST) + 1) / module.FASTEST
    steps = np.interp(grid, time + 0.5 / RATE, response)  # the target's sample stands for half a step around it
    return grid, steps, module._readings(steps, module.FASTEST)


@pytest.mark.parametrize(("seeds", "right_of"), [(8, 7), pytest.param(20, 18, marks=pytest.mark.proof)])
@pytest.mark.parametrize(
    ("loop", "how"),
    [
        (Loop(), {"size": 0.3}),
        (Loop(delay=0.04), {"gust": 6.0}),
    ],
    ids=["overshoot of 20 %, a gentle pilot", "overshoot of 48 %, strong gusts"],
)
def test_a_known_loop_comes_back_within_its_band(loop: Loop, how: dict[str, Any], seeds: int, right_of: int) -> None:
    grid, steps, readings = truth(loop)
    inside = np.zeros(4, dtype=np.int64)
    covered = []
    for seed in range(seeds):
        (found,) = review(flight(loop, seed, **how), swept=()).loops
        assert found.step is not None, found.why
        told = (found.step.delay, found.step.rise, found.step.overshoot, found.step.final)
        inside += [abs(read.value - right) <= WITHIN * read.error for read, right in zip(told, readings, strict=False)]
        right = np.interp(found.step.time, grid, steps)
        covered.append(np.mean((found.step.low <= right) & (right <= found.step.high)))
    assert inside.min() >= right_of, inside
    assert np.mean(covered) >= 0.9


def test_the_errors_are_no_larger_than_they_need_be() -> None:
    """A band that is wide enough to hold anything says nothing."""
    (found,) = review(flight(Loop(), 3), swept=()).loops
    assert found.step is not None
    assert found.step.delay.error < 0.002
    assert found.step.overshoot.error < 0.03
    assert np.max(found.step.high - found.step.low) < 0.2
    assert found.step.bandwidth is not None
    assert found.step.bandwidth.value == pytest.approx(truth(Loop())[2][4], rel=0.05)


def held_level(*, asks: Array, seed: int = 1) -> Flight:
    """An attitude loop holds an angle that is asked for [rad], in gusts."""
    loop, n = Loop(), asks.size
    gust, h, wait = gusts(seed, n / RATE, size=8.0), 1.0 / RATE, round(0.02 * RATE)
    rate = angle = total = moved = 0.0
    rows, sent = np.zeros((n, 4)), np.zeros(n)
    for k in range(n):
        target = 5.0 * (asks[k] - angle)
        error = target - rate
        total += h * error
        sent[k] = loop.p * error + loop.i * total
        moved += h * ((sent[k - wait] if k >= wait else 0.0) - moved) / loop.lag
        rows[k] = target, rate, sent[k], angle
        rate += h * (loop.effect * moved - loop.damping * rate + gust[k])
        angle += h * rate
    channels = dict(zip(("p_demand", "p", "mixer_roll", "phi"), rows.T, strict=True))
    return Flight({"rates": stream(np.arange(n) * h, {**channels, "phi_demand": asks})})


def test_a_target_that_only_answers_gusts_gives_no_step_response() -> None:
    (found,) = review(held_level(asks=np.zeros(round(60 * RATE))), swept=()).loops
    assert found.step is None
    assert "the motion comes before its target" in found.why


def test_an_angle_that_is_asked_for_stands_for_the_target() -> None:
    """Part of the target answers gusts here; what the stick moved of it gives the loop's own response."""
    grid, steps, readings = truth(Loop())
    inside, covered = [], []
    for seed in range(6):
        (found,) = review(held_level(asks=0.3 * sticks(seed, 120.0), seed=seed + 40), swept=()).loops
        assert found.step is not None, found.why
        assert found.step.reference == "phi_demand"
        told = (found.step.delay, found.step.rise, found.step.overshoot, found.step.final)
        inside += [abs(read.value - right) <= WITHIN * read.error for read, right in zip(told, readings, strict=False)]
        right = np.interp(found.step.time, grid, steps)
        covered.append(np.mean((found.step.low <= right) & (right <= found.step.high)))
    assert sum(inside) >= 21  # of 24
    assert np.mean(covered) > 0.8


def changed(made: Flight, **channels: Array) -> Flight:
    for name, values in channels.items():
        made = made.with_channel(name, values, like="p")
    return made


def test_what_the_log_lacks_is_said() -> None:
    made = flight(Loop(), 1)
    rng = np.random.default_rng(0)
    n = made.values("p").size
    still = changed(made, p_demand=0.01 * rng.standard_normal(n))
    noisy = changed(made, p=made.values("p") + 3.0 * rng.standard_normal(n))
    loose = changed(made, p=0.2 * made.values("p"))
    slow = Flight({"rates": made.streams["rates"].isel(time=slice(None, None, 40))})
    short = made.between(0.0, 12.0)
    for wrong, words in (
        (still, "the target did not move"),
        (noisy, "gusts or noise move it"),
        (loose, "no loop holds it there"),
        (slow, "logged at 10 Hz"),
        (short, "the target did not move"),
        (Flight({"rates": made.streams["rates"].drop_vars("p_demand")}), "no target of this rate (p_demand)"),
    ):
        (found,) = review(wrong, swept=()).loops
        assert found.step is None
        assert words in found.why


def test_a_sweep_is_no_target() -> None:
    """What is added at the mixer moves the aircraft, and no target: those stretches are left out."""
    made = flight(Loop(), 1, seconds=30.0)
    everywhere = Sweep(0.0, 30.0, "roll", 0.5, 10.0, "mixer_roll", "log")
    (found,) = review(made, swept=(everywhere,)).loops
    assert found.why == "no stretch without a gap is 4 s long"
