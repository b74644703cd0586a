"""Controllers from the first seconds of a record: a law that is there is found, one that is not explains nothing."""

from __future__ import annotations

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import SwashError
from swashplate.identification.core.records import POSE, Record
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.validation.controller_law import Law, check_closed, learnt

PSI, R = PREDICTED.index("psi"), PREDICTED.index("r")


def _record(*, gains: tuple[float, float], lag: int, noise: float) -> tuple[Record, np.ndarray]:
    """Eight seconds in which the yaw command answers heading and yaw rate; states of which only those two move."""
    rng = np.random.default_rng(3)
    time = np.arange(800) / 100.0
    states = np.zeros((time.size, 12))
    states[:, R] = 0.5 * np.convolve(rng.standard_normal(time.size), np.ones(25) / 5.0, "same")
    states[:, PSI] = np.cumsum(states[:, R]) / 100.0
    answer = np.roll(states[:, [PSI, R]] @ gains, lag)
    command = 0.02 + answer + noise * rng.standard_normal(time.size)
    command[500:] += 1.0  # what comes after five seconds is another controller
    inputs = np.zeros((time.size, 4))
    inputs[:, 1], inputs[:, 0] = 0.5 + 0.5 * command, 0.5 - 0.5 * command
    outputs = np.zeros((time.size, 6))
    return Record("made", time, inputs, outputs, np.full(time.size, 11.1), POSE, False), states


def _yaw(record: Record, states: np.ndarray) -> Law:
    (law,) = learnt(sp.vehicle("coax"), record, states, axes=("yaw",), seconds=5.0)
    return law


def test_a_law_is_found_with_its_lag_and_nothing_later_is_looked_at() -> None:
    law = _yaw(*_record(gains=(-0.03, -0.01), lag=2, noise=1e-4))
    np.testing.assert_allclose(law.gains, (-0.03, -0.01), rtol=0.02)
    assert law.lag == pytest.approx(0.02)
    assert law.explained > 0.99
    assert law.motion == ("psi", "r")
    assert "20 ms late" in law.summary_text
    assert "-0.03 per psi" in law.summary_text


def test_a_command_that_answers_nothing_is_hardly_explained() -> None:
    law = _yaw(*_record(gains=(0.0, 0.0), lag=0, noise=5e-3))
    assert law.explained < 0.1
    assert max(map(abs, law.gains)) < 3e-3


def test_only_what_answers_its_own_motion_can_be_closed() -> None:
    coax = sp.vehicle("coax")
    check_closed(coax, ("yaw", "heave"))
    with pytest.raises(SwashError, match=r"'roll' cannot be closed, expected yaw or heave"):
        check_closed(coax, ("yaw", "roll"))
