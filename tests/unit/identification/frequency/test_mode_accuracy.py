"""What the bounds of parameters leave of the modes."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.identification.frequency.mode_accuracy import mode_accuracy
from swashplate.models.linear.state_space_file import parse, structure

SPRING = """
kind = "state-space"
name = "spring"
[states]
z = "m"
w = "m/s"
[inputs]
force = "1"
[equations]
z = {w = "1"}
w = {z = "-A * B", w = "-C", force = "1"}
[outputs.z]
unit = "m"
of = {z = "1"}
[parameters]
A = {value = 4.0, unit = "1/s"}
B = {value = 25.0, unit = "1/s"}
C = {value = 6.0, unit = "1/s"}
"""


def test_two_numbers_told_only_together_leave_a_mode_that_is_told() -> None:
    model = parse(SPRING)
    bounds = {"A": 2.0, "B": 12.5, "C": 0.3}  # half of A and of B
    apart, together = np.eye(3), np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    (told,) = mode_accuracy(model, bounds, together, lowest=1.0)
    assert (told.frequency, told.damping) == (pytest.approx(10.0), pytest.approx(0.3))
    assert told.frequency_bound == pytest.approx(0.0, abs=1e-6)
    assert told.damping_bound == pytest.approx(0.3 / 20.0)  # zeta = C / (2 omega)
    (loose,) = mode_accuracy(model, bounds, apart, lowest=11.0)
    assert loose.frequency_percent == pytest.approx(50.0 / np.sqrt(2.0), rel=1e-4)
    assert told.inside
    assert not loose.inside


def test_what_no_response_tells_leaves_its_mode_untold() -> None:
    (mode,) = mode_accuracy(parse(SPRING), {"A": float("inf"), "C": 0.1}, np.eye(2), lowest=1.0)
    assert mode.frequency_bound == np.inf


def test_slopes_are_those_of_the_eigenvalues() -> None:
    model = structure("eleven_state")
    change = 1e-3
    value = model.parameters["Lb"].value
    found = mode_accuracy(model, {"Lb": change * value}, np.eye(1), lowest=0.5)
    moved = model.with_values({"Lb": (1.0 + change) * value}).eigenvalues()
    for mode in found:
        near = moved[np.argmin(np.abs(moved - mode.eigenvalue))]
        assert abs(abs(near) - mode.frequency) == pytest.approx(mode.frequency_bound, rel=0.02, abs=1e-7)
