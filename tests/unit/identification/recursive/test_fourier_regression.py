"""Recursive Fourier regression against a batch of transforms, a closed form, and the time domain."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from short_period import TRUTH, short_period
from swashplate.errors import IdentificationError
from swashplate.identification.recursive.equation import regression_equation
from swashplate.identification.recursive.fourier_regression import (
    CLOCK,
    GAP,
    NO_NUMBER,
    RecursiveRegression,
    RegressionPlan,
    regression_plan,
    scatter,
)

EQUATION = "q_dot = Mw*w + Mq*q + Md*elevator + bias"


def run(plan: RegressionPlan, samples: np.ndarray) -> RecursiveRegression:
    found = RecursiveRegression(plan)
    for row in samples:
        found.step(plan.dt, row)
    return found


def batch(plan: RegressionPlan, samples: np.ndarray, weights: np.ndarray | None = None) -> tuple[np.ndarray, ...]:
    """Left and right side by plain sums over the whole record, interval by interval."""
    dt, n = plan.dt, len(samples)
    omega = 2.0 * np.pi * plan.hertz
    turns = np.exp(-1j * np.outer(np.arange(n) * dt, omega))
    w = np.ones(n - 1) if weights is None else weights

    def smooth(x: np.ndarray) -> np.ndarray:
        return w @ (0.5 * dt * (x[:-1, None] * turns[:-1] + x[1:, None] * turns[1:]))

    q, w_, elevator = samples.T
    hold = (1.0 - np.exp(-1j * omega * dt)) / (1j * omega)
    ends = w @ (q[1:, None] * turns[1:] - q[:-1, None] * turns[:-1])
    right = [smooth(w_), smooth(q), w @ (elevator[:-1, None] * turns[:-1]) * hold, w @ turns[:-1] * hold]
    return ends + 1j * omega * smooth(q), np.array(right).T


@pytest.mark.parametrize("memory", [None, 3.0])
def test_it_is_the_batch_of_complex_least_squares(memory: float | None) -> None:
    samples = short_period(800, gust=0.3)
    plan = regression_plan(regression_equation(EQUATION), rate=100, band=(0.1, 2.0), memory=memory, held=["elevator"])
    weights = None if memory is None else np.exp(-0.01 / memory) ** np.arange(798, -1, -1)
    left, right = batch(plan, samples, weights)
    both = np.vstack([right.real, right.imag]), np.concatenate([left.real, left.imag])
    expected = np.linalg.lstsq(*both, rcond=None)[0]
    found = run(plan, samples).estimate()
    assert found is not None
    np.testing.assert_allclose(found.values, expected, rtol=1e-10)
    assert found.names == ("Mw", "Mq", "Md", "bias")


def test_without_noise_it_is_the_system_itself() -> None:
    plan = regression_plan(regression_equation(EQUATION), rate=100, band=(0.1, 2.0), held=["elevator"])
    found = run(plan, short_period(600)).estimate()
    assert found is not None
    for name, value in TRUTH.items():
        assert found[name] == pytest.approx(value, rel=2e-3)
    half_late = regression_plan(regression_equation(EQUATION), rate=100, band=(0.1, 2.0))
    wrong = run(half_late, short_period(600)).estimate()  # a held command taken for a smooth one is half a step late
    assert wrong is not None
    assert abs(wrong["Mq"] + 2.0) > 10.0 * abs(found["Mq"] + 2.0)


def test_a_known_term_and_a_delay_count() -> None:
    samples = short_period(900)
    late = np.column_stack([samples[5:, :2], samples[:-5, 2]])  # logged 5 samples before it acts... seen from the log
    early = np.column_stack([samples[:-5, :2], samples[5:, 2]])
    e = regression_equation("q_dot = Mw*w - 2*q + Md*elevator + bias", delays={"elevator": 0.05})
    plan = regression_plan(e, rate=100, band=(0.1, 2.0), held=["elevator"])
    found, other = run(plan, early).estimate(), run(plan, late).estimate()
    assert found is not None
    assert other is not None
    assert found["Md"] == pytest.approx(-10.0, rel=0.03)
    assert abs(other["Md"] + 10.0) > 5.0 * abs(found["Md"] + 10.0)
    assert found.names == ("Mw", "Md", "bias")


def test_instruments_take_out_what_gusts_do_to_the_regressors() -> None:
    """Twelve flights in strong gusts: the damping is biased, unless the elevator is an instrument."""
    e = regression_equation("q_dot = Mw*w + Mq*q + Md*elevator + bias")
    asked: dict[str, Any] = {"rate": 100, "band": (0.1, 2.0), "spacing": 0.1, "held": ["elevator"]}
    plans = [regression_plan(e, **asked), regression_plan(e, **asked, instruments=["elevator"])]
    found = []
    for seed in range(12):
        running = [RecursiveRegression(plan) for plan in plans]
        for row in short_period(600, gust=1.0, seed=seed):
            for regression in running:
                regression.step(0.01, row)
        told = [regression.estimate() for regression in running]
        found.append([(one["Mq"] - TRUTH["Mq"]) / one.sigmas[1] for one in told if one is not None])
    plain, instrumented = np.mean(found, axis=0)
    assert plain > 1.0
    assert abs(instrumented) < 0.6
    with pytest.raises(IdentificationError, match="q: is what is to be explained"):
        regression_plan(e, **asked, instruments=["q"])


def test_gaps_values_that_are_none_and_clocks_freeze_it() -> None:
    plan = regression_plan(regression_equation(EQUATION), rate=100, band=(0.1, 2.0), held=["elevator"])
    samples = short_period(700, gust=0.1)
    found = run(plan, samples[:400])
    before = found.estimate()
    assert before is not None
    for elapsed, sample, why in (
        (0.5, samples[450], GAP),
        (-3600.0, samples[451], CLOCK),
        (float("nan"), samples[452], CLOCK),
        (0.001, samples[453], CLOCK),
        (0.01, [np.nan, 0.0, 0.0], NO_NUMBER),
        (0.01, [0.0, np.inf, 0.0], NO_NUMBER),
    ):
        assert not found.step(elapsed, sample)
        assert found.frozen == why
        after = found.estimate()
        assert after is not None
        np.testing.assert_array_equal(after.values, before.values)
        np.testing.assert_array_equal(after.sigmas, before.sigmas)
    assert not found.step(0.01, samples[500])
    assert found.step(0.01, samples[501])
    assert found.frozen == ""
    for row in samples[502:]:
        found.step(0.01, row)
    whole = found.estimate()
    assert whole is not None
    assert whole.sigmas[0] < before.sigmas[0]
    assert whole["Mw"] == pytest.approx(-4.0, abs=3.0 * whole.sigmas[0])


def test_the_scatter_is_that_of_white_noise_in_time() -> None:
    random = np.random.default_rng(3)
    times, dt, first, spacing = np.arange(300) * 0.01, 0.01, 2, 0.1
    omega = 2.0 * np.pi * spacing * np.arange(first, first + 12)
    rows = random.standard_normal((12, 3)) + 1j * random.standard_normal((12, 3))
    weights = np.exp(-0.3 * times)
    m = np.arange(2 * (first + 11) + 1)
    window = dt * (weights**2) @ np.exp(-2j * np.pi * spacing * np.outer(times, m))
    moving = weights[:, None] * (np.exp(-1j * np.outer(times, omega)) @ rows.conj()).real
    np.testing.assert_allclose(scatter(rows, window, first), dt * moving.T @ moving, rtol=1e-9)


def test_it_says_nothing_while_nothing_is_told_apart() -> None:
    plan = regression_plan(regression_equation(EQUATION), rate=100, band=(0.1, 2.0), held=["elevator"])
    samples = short_period(600)
    assert RecursiveRegression(plan).estimate() is None
    assert run(plan, samples[:60]).estimate() is None
    same = samples.copy()
    same[:, 1] = 2.0 * same[:, 0]
    assert run(plan, same).estimate() is None
    still = samples.copy()
    still[:, 2] = 0.3  # a command that never moves is a bias
    assert run(plan, still).estimate() is None
    assert run(plan, samples).estimate() is not None


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"band": (0.0, 1.0)}, "band"),
        ({"band": (0.1, 30.0)}, "band"),
        ({"band": (0.1, 2.0), "spacing": 0.9}, "band"),
        ({"memory": 0.0}, "memory"),
        ({"memory": float("nan")}, "memory"),
        ({"held": ["rudder"]}, "rudder"),
        ({"held": ["q"]}, "q"),
    ],
)
def test_settings_that_cannot_work_are_refused(changes: dict[str, object], word: str) -> None:
    with pytest.raises(IdentificationError, match=word):
        regression_plan(regression_equation(EQUATION), rate=100, **changes)  # type: ignore[arg-type]
