"""The gain that a likelihood begins with, against the Kalman gain of noise that is known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from swashplate.arrays import Array
from swashplate.filtering.riccati import gain_at, settled_covariance, through
from swashplate.identification.time.first_gain import first_gain, kalman_gains

PHI = np.array([[1.0, 0.05], [-0.1, 0.96]])
C = np.eye(2)
GUSTS, SENSORS = np.diag([1e-4, 4e-3]), np.diag([0.02, 0.05])


def _records() -> list[Array]:
    random, found = np.random.default_rng(4), []
    for count in (1500, 900):
        x, rows = np.zeros(2), []
        for _ in range(count):
            rows.append(C @ x + np.sqrt(np.diag(SENSORS)) * random.standard_normal(2))
            x = PHI @ x + np.sqrt(np.diag(GUSTS)) * random.standard_normal(2)
        found.append(np.array(rows))
    return found


RECORDS = _records()


def _run(gain: Array) -> tuple[float, Sequence[Array]]:
    errors = []
    for record in RECORDS:
        x, rows = np.zeros(2), []
        for y in record:
            rows.append(y - C @ x)
            x = PHI @ x + gain @ rows[-1]
        errors.append(np.array(rows))
    whole = np.concatenate(errors)
    return 0.5 * len(whole) * float(np.linalg.slogdet(whole.T @ whole / len(whole))[1]), errors


def test_it_ends_at_the_filter_of_the_noise_that_was_there() -> None:
    best = PHI @ gain_at(settled_covariance(through(PHI, C, GUSTS, SENSORS)), C, SENSORS)
    begun = kalman_gains(PHI, C, [100.0 * GUSTS], SENSORS)
    cost, found = first_gain(PHI, C, [0.9 * np.eye(2), *begun], _run)
    assert _run(begun[0])[0] > _run(best)[0] + 50.0
    assert cost == pytest.approx(_run(found)[0])
    # As likely as the truth, and more so by half of a chi-square number for each of four entries at most.
    assert _run(best)[0] - 8.0 < cost < _run(best)[0] + 0.1
    np.testing.assert_allclose(found, best, atol=0.04)


def test_it_is_never_worse_than_what_was_given() -> None:
    unstable = -0.02 * np.eye(2)
    assert np.max(np.abs(np.linalg.eigvals(PHI - unstable @ C))) > 1.0
    cost, found = first_gain(PHI, C, [unstable], _run)
    np.testing.assert_array_equal(found, unstable)
    assert cost == _run(unstable)[0]
    stands, blind = np.eye(2), np.array([[0.0, 1.0]])
    assert kalman_gains(np.diag([1.0, 0.5]), blind, [stands, np.nan * stands], np.eye(1)) == []
