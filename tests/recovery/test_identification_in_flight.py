"""What recursive estimators promise: coverage in one cycle and after, a payload within three seconds, false alarms.

`SWASH_SEEDS` sets how many flights; run with `pytest -m proof`.
"""

from __future__ import annotations

import os

import numpy as np
import pytest

import swashplate as sp
from short_period import TRUTH, short_period
from swashplate.filtering.sensor_suite import suite
from swashplate.identification.recursive.equation import regression_equation
from swashplate.identification.recursive.fourier_regression import RecursiveRegression, regression_plan
from swashplate.identification.recursive.slow_parameters import SlowParameters, slow_plan

pytestmark = pytest.mark.proof
SEEDS = int(os.environ.get("SWASH_SEEDS", "100"))
CYCLE = 2.0 * np.pi / 3.4278
"""Period of the damped oscillation [s]."""
MASS = 0.302


@pytest.mark.parametrize("cycles", [1.0, 2.0, 5.0])
@pytest.mark.parametrize("gust", [0.02, 0.1])
def test_the_truth_lies_within_two_sigmas(cycles: float, gust: float) -> None:
    """White gusts of 0.02 and 0.1 m/s^2 (rad/s^2) per root of Hz, gyro and velocity noise of 0.01."""
    e = regression_equation("q_dot = Mw*w + Mq*q + Md*elevator + bias")
    plan = regression_plan(e, rate=100, band=(0.1, 2.0), spacing=0.1, held=["elevator"])
    inside, told = [], 0
    for seed in range(SEEDS):
        samples = short_period(round(cycles * CYCLE * 100) + 1, gust=gust, seed=seed)
        samples[:, :2] += 0.01 * np.random.default_rng(1000 + seed).standard_normal((len(samples), 2))
        regression = RecursiveRegression(plan)
        for row in samples:
            regression.step(0.01, row)
        found = regression.estimate()
        if found is not None:
            told += 1
            inside.append([abs(found[n] - v) < 2.0 * found.sigmas[i] for i, (n, v) in enumerate(TRUTH.items())])
    share = float(np.mean(inside))
    print(f"{cycles:g} cycles, gusts {gust:g}: {100 * share:.1f} % of {told} flights within two sigmas")
    assert told >= 0.95 * SEEDS
    assert 0.90 <= share <= 0.99


def _hover(share: float, seconds: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Inputs and noisy readings of a hover under an autopilot, `share` of the mass from the start on."""
    coax, random = sp.vehicle("coax"), np.random.default_rng(seed)
    about = sp.trim(coax)
    law = sp.autopilot(coax, about, mode="place")
    flown = coax.with_values({"mass": share * MASS})
    flight = sp.simulate_closed_loop(flown, law, duration=seconds, rate=100.0, start=about)
    body = flight.array(("x", "y", "z", "phi", "theta", "psi", "p", "q", "r"))
    sigma = [s for sensor in suite("mocap@100,gyro@100") for s in sensor.sigma]
    return flight.array((*coax.input_names, "voltage")), body + sigma * random.standard_normal(body.shape)


def _filter() -> SlowParameters:
    sensors = suite("mocap@100+0ms,gyro@100+0ms")
    return SlowParameters(
        slow_plan(sp.vehicle("coax"), ("mass",), sensors=sensors, rate=100.0, spread=0.05, wander=0.02)
    )


def _alarmed(running: SlowParameters, inputs: np.ndarray, readings: np.ndarray, limit: float) -> list[float]:
    """Seconds at which the mass had left the card's by `limit` sigmas, looked at every tenth of a second."""
    found = []
    for k, (u, y) in enumerate(zip(inputs, readings, strict=True)):
        running.step(0.01, u, y)
        told = running.estimate() if k % 10 == 9 else None
        if told is not None and abs(told.values[0] - MASS) > limit * told.sigmas[0]:
            found.append(0.01 * k)
    return found


LIMIT = 5.0
"""Sigmas that a mass must have left the card's by for a payload to be announced."""


def test_a_payload_of_a_fifth_is_found_within_three_seconds() -> None:
    late, inside = [], []
    for seed in range(max(3, SEEDS // 10)):
        running = _filter()
        _alarmed(running, *_hover(1.0, 5.0, seed), LIMIT)
        heavy = _hover(1.2, 3.0, 500 + seed)
        alarms = _alarmed(running, *heavy, LIMIT)
        told = running.estimate()
        late.append(alarms[0] if alarms else np.inf)
        inside.append(abs(told.values[0] - 1.2 * MASS) < 2.0 * told.sigmas[0])
    print(
        f"+20 %: announced after {np.median(late):.2f} s (worst {max(late):.2f}); {np.mean(inside):.2f} within 2 sigmas"
    )
    assert max(late) < 3.0
    assert np.mean(inside) > 0.5


def test_false_alarms_are_rare() -> None:
    hours, alarms = 0.0, 0
    for seed in range(max(3, SEEDS // 10)):
        alarms += bool(_alarmed(_filter(), *_hover(1.0, 60.0, 900 + seed), LIMIT))
        hours += 60.0 / 3600.0
    print(f"{alarms} false alarms in {hours:.2f} hours of hover in still air at {LIMIT:g} sigmas")
    assert alarms == 0
