"""Simulate, identify, recover: the bounds are neither too narrow nor too wide."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
from sweeps import MANEUVER, Recovery, flown, flown_in_gusts, recover

SEEDS = 50
GUSTY = 12


def inside(recoveries: list[Recovery]) -> float:
    """Share of all estimates within two predicted standard deviations of the truth."""
    return float(np.mean([np.abs(r.distance) < 2.0 for r in recoveries]))


@pytest.mark.proof
def test_a_few_seeds_recover_the_truth() -> None:
    flight = flown()
    recoveries = [recover(flight, seed=seed, unbroken=True) for seed in range(3)]
    assert inside(recoveries) >= 0.75
    distance = np.array([r.distance for r in recoveries])
    assert np.abs(distance).max() < 4.0
    assert 0.5 < np.sqrt(np.mean(distance**2)) < 1.6


@pytest.mark.proof
def test_many_seeds_scatter_as_predicted() -> None:
    flight = flown()
    _judge(
        "recovery",
        f"Simulate, identify, recover: the six flight parameters, {SEEDS} seeds",
        f"The usual sensors on '{MANEUVER}' in calm air, output error at 100 Hz; 90 to 99 % and a scatter of 0.7 to "
        "1.4 of its prediction are promised.",
        (0.90, 0.99),
        (0.7, 1.4),
        [recover(flight, seed=seed) for seed in range(SEEDS)],
    )


@pytest.mark.proof
def test_prediction_error_scatters_as_predicted_in_gusts() -> None:
    recoveries = [
        recover(flown_in_gusts(seed, sigma=0.3), seed=seed, method="prediction-error", wind=True)
        for seed in range(GUSTY)
    ]
    _judge(
        "recovery_gusts",
        f"Simulate, identify, recover in gusts, {GUSTY} seeds",
        f"The usual sensors on '{MANEUVER}' in horizontal gusts of 0.3 m/s; prediction error with a wind. Priors of "
        "trims and of the tracked body's heading stand at the truth: a scatter below its prediction is no fault here.",
        (0.90, 1.0),
        (0.0, 1.4),
        recoveries,
    )


def _judge(
    file: str,
    title: str,
    how: str,
    shares: tuple[float, float],
    ratios: tuple[float, float],
    recoveries: list[Recovery],
) -> None:
    """Leave the table of the estimates' scatter, then hold it against what is promised."""
    share = inside(recoveries)
    error, distance = np.array([r.error for r in recoveries]), np.array([r.distance for r in recoveries])
    sigma = np.array([r.sigma for r in recoveries])
    # Each error in its own seed's sigma: gaps fall elsewhere in every seed, and with them what can be known.
    ratio = distance.std(axis=0, ddof=1)
    within = np.mean(np.abs(distance) < 2.0, axis=0)
    passed = bool(shares[0] <= share <= shares[1] and np.all((ratio > ratios[0]) & (ratio < ratios[1])))
    _leave(
        file,
        {
            "title": title,
            "text": f"{how} Pooled over the parameters {100.0 * share:.1f} % lie within two corrected sigmas.",
            "columns": [
                "parameter",
                "mean error",
                "scatter",
                "median sigma",
                "root mean square of sigma",
                "scatter in own sigmas",
                "within 2 sigmas",
            ],
            "rows": [
                [name, *(float(x) for x in row)]
                for name, *row in zip(
                    recoveries[0].names,
                    error.mean(axis=0),
                    error.std(axis=0, ddof=1),
                    np.median(sigma, axis=0),
                    np.sqrt(np.mean(sigma**2, axis=0)),
                    ratio,
                    within,
                    strict=True,
                )
            ],
            "passed": passed,
        },
    )
    assert passed, (share, ratio)


def _leave(name: str, found: dict[str, object]) -> None:
    folder = os.environ.get("SWASHPLATE_PROOF")
    if folder:
        Path(folder, f"{name}.json").write_text(json.dumps(found), encoding="utf-8")
