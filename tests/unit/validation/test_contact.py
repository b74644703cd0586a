"""A push beyond a heading is found with its limit and its size; gusts alone are not called a contact."""

from __future__ import annotations

import numpy as np
import pytest

from swashplate.arrays import Array
from swashplate.identification.time.kinematics import PREDICTED
from swashplate.validation.contact import Contact, contact

DT, N = 0.02, 1600
TIME = np.arange(N) * DT
PSI = PREDICTED.index("psi")


def _flown(seed: int, *, push: float = 0.0, beyond: float = 2.8, axis: int = 0) -> tuple[Array, Array]:
    """A body that wanders and turns, in gusts that fade with 0.5 s and drifts; pushed beyond a heading."""
    rng = np.random.default_rng(seed)
    keep = np.exp(-DT / np.array([0.5] * 3))
    gust, drift = np.zeros((N, 3)), np.cumsum(0.02 * np.sqrt(DT) * rng.standard_normal((N, 3)), axis=0)
    for k in range(1, N):
        gust[k] = keep * gust[k - 1] + 0.25 * np.sqrt(1.0 - keep**2) * rng.standard_normal(3)
    states = np.zeros((N, 12))
    for column in (0, 1, 2):
        states[:, column] = np.cumsum(0.2 * np.sqrt(DT) * rng.standard_normal(N))
    states[:, PSI] = 2.2 + 0.9 * np.sin(2.0 * np.pi * TIME / 7.0 + rng.uniform(0, 6)) + 0.1 * states[:, 0]
    pushes = gust + drift
    pushes[states[:, PSI] > beyond, axis] += push
    return states, pushes


def _found(seed: int, **how: float) -> Contact | None:
    return contact("a", TIME, *_flown(seed, **how))  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", range(5))
def test_a_tether_beyond_a_heading_is_found(seed: int) -> None:
    found = _found(seed, push=-0.65)
    assert found is not None
    assert (found.feature, found.above, found.axis) == ("psi", True, "forward")
    assert found.limit == pytest.approx(2.8, abs=0.25)
    assert found.push == pytest.approx(-0.65, abs=0.25)
    assert "Nothing was left out" in found.summary_text
    states, _ = _flown(seed, push=-0.65)
    inside = np.zeros(N, dtype=bool)
    for first, last in found.intervals:
        inside |= (first <= TIME) & (last >= TIME)
    assert np.mean(inside == (states[:, PSI] > found.limit)) > 0.98


def test_gusts_alone_are_no_contact() -> None:
    assert [seed for seed in range(100, 120) if _found(seed) is not None] == []


def test_the_side_and_the_axis_are_told() -> None:
    states, pushes = _flown(3)
    pushes[states[:, PSI] < 1.6, 1] += 0.8
    found = contact("a", TIME, states, pushes)
    assert found is not None
    assert (found.feature, found.above, found.axis) == ("psi", False, "right")


def test_a_start_touches_the_mask_when_its_prediction_enters_it() -> None:
    one = Contact("a", "psi", True, 2.8, "forward", -0.6, 0.002, 0.1, ((3.0, 4.0),))
    np.testing.assert_array_equal(
        one.touches(np.array([1.0, 2.5, 3.5, 4.0, 4.1]), 1.0), [False, True, True, True, False]
    )


def test_a_record_of_a_few_seconds_tells_nothing() -> None:
    states, pushes = _flown(1, push=-2.0)
    assert contact("a", TIME[:400], states[:400], pushes[:400]) is None
