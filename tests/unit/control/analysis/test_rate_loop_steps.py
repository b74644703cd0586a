"""The stepped loop against a closed form, against its own frequency response, and where it must say "unstable"."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.control.analysis.rate_loop_steps import rate_loop_steps
from swashplate.errors import ControllerError
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import parse

NAMES = {"rate": "p", "command": "mixer_roll"}


def first_order(gain: float = 20.0, pole: float = 4.0, delay: float = 0.0) -> StateSpaceModel:
    """p / mixer_roll = gain / (s + pole) e^(-delay s)."""
    return parse(
        f"""
kind = "state-space"
name = "roll"
title = "roll"
trust = "test"
[states]
p = "rad/s"
[inputs]
mixer_roll = "1"
[equations]
p = {{p = "{-pole!r}", mixer_roll = "{gain!r}"}}
[outputs.p]
unit = "rad/s"
of = {{p = "1"}}
[delays]
mixer_roll = "{delay!r}"
[parameters]
""",
        path="roll",
    )


def test_proportional_control_of_a_first_order_lag_has_its_closed_form() -> None:
    found = rate_loop_steps(first_order(), {"P": 0.3, "FF": 0.1}, **NAMES)
    pole = 4.0 + 20.0 * 0.3
    level = 20.0 * (0.3 + 0.1) / pole
    assert found.step == pytest.approx(level * (1.0 - np.exp(-pole * found.time)), abs=0.03)  # one step late
    assert found.settled == pytest.approx(level, rel=1e-3)
    assert found.disturbance[-1] == pytest.approx(20.0 * 0.1 / pole, rel=1e-3)
    assert found.stable


def test_the_integral_takes_the_disturbance_away() -> None:
    found = rate_loop_steps(first_order(), {"ATC_RAT_RLL_P": 0.3, "ATC_RAT_RLL_I": 1.0}, seconds=8.0, **NAMES)
    assert found.settled == pytest.approx(1.0, abs=1e-3)
    assert abs(found.disturbance[-1]) < 1e-3 < np.max(np.abs(found.disturbance))


@pytest.mark.parametrize(("p", "stable"), [(0.3, True), (1.2, True), (2.3, True), (3.1, False), (6.0, False)])
def test_what_the_delay_makes_unstable_is_called_so(p: float, stable: bool) -> None:
    delay = 0.03
    # |P 20 / (j w + 4)| at the frequency where the phase with the delay is -180 deg, with the one step of the loop.
    w = np.linspace(1.0, 200.0, 20000)
    phase = -np.arctan(w / 4.0) - w * (delay + 0.5 / 400.0)
    at = w[np.argmin(np.abs(phase + np.pi))]
    assert (p * 20.0 / np.hypot(at, 4.0) < 1.0) == stable
    assert rate_loop_steps(first_order(delay=delay), {"P": p}, **NAMES).stable == stable


def test_filters_cost_phase() -> None:
    plant = first_order(delay=0.03)
    plain = rate_loop_steps(plant, {"P": 1.2}, **NAMES)
    slow = rate_loop_steps(plant, {"P": 1.2, "FLTE": 5.0}, **NAMES)
    gyro = rate_loop_steps(plant, {"P": 1.2}, gyro_filter=5.0, **NAMES)
    assert slow.overshoot > plain.overshoot + 0.05
    assert gyro.overshoot > plain.overshoot + 0.05
    assert rate_loop_steps(plant, {"P": 2.2}, **NAMES).stable
    assert not rate_loop_steps(plant, {"P": 2.2}, gyro_filter=5.0, **NAMES).stable


def test_the_filter_of_the_demand_softens_its_step_and_not_a_disturbance() -> None:
    plant = first_order(delay=0.03)
    sharp, soft = (rate_loop_steps(plant, {"P": 1.2, "FLTT": hertz}, **NAMES) for hertz in (0.0, 2.0))
    assert soft.overshoot < 0.5 * sharp.overshoot
    np.testing.assert_array_equal(soft.disturbance, sharp.disturbance)
    assert np.isnan(rate_loop_steps(plant, {"P": 9.0}, **NAMES).overshoot), "not 0 where it left all bounds"


def test_what_is_no_loop_is_refused() -> None:
    with pytest.raises(ControllerError, match="hold no gain"):
        rate_loop_steps(first_order(), {"ATC_RAT_RLL_FLTE": 20.0}, **NAMES)
    with pytest.raises(ControllerError, match="is no channel of the model"):
        rate_loop_steps(first_order(), {"P": 1.0}, rate="q", command="mixer_roll")
