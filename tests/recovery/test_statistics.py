"""Simulate, identify, recover: the bounds are neither too narrow nor too wide."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
from sweeps import MANEUVER, Recovery, flown, recover

SEEDS = 50


def inside(recoveries: list[Recovery]) -> float:
    """Share of all estimates within two predicted standard deviations of the truth."""
    return float(np.mean([np.abs(r.distance) < 2.0 for r in recoveries]))


def test_a_few_seeds_recover_the_truth() -> None:
    flight = flown()
    recoveries = [recover(flight, seed=seed) for seed in range(3)]
    assert inside(recoveries) >= 0.75
    distance = np.array([r.distance for r in recoveries])
    assert np.abs(distance).max() < 4.0
    assert 0.5 < np.sqrt(np.mean(distance**2)) < 1.6


@pytest.mark.proof
def test_many_seeds_scatter_as_predicted() -> None:
    flight = flown()
    recoveries = [recover(flight, seed=seed) for seed in range(SEEDS)]
    share = inside(recoveries)
    error = np.array([r.error for r in recoveries])
    predicted = np.sqrt(np.mean([r.sigma**2 for r in recoveries], axis=0))
    ratio = error.std(axis=0, ddof=1) / predicted
    within = np.mean(np.abs([r.distance for r in recoveries]) < 2.0, axis=0)
    passed = bool(0.90 <= share <= 0.99 and np.all((ratio > 0.7) & (ratio < 1.4)))
    _leave(
        "recovery",
        {
            "title": "Simulate, identify, recover: the six flight parameters",
            "text": f"{SEEDS} seeds of the usual sensors on '{MANEUVER}', output error at 100 Hz. Pooled over the "
            f"parameters {100.0 * share:.1f} % lie within two corrected standard deviations (promised: 90 to 99 %); "
            "each parameter's scatter is to be 0.7 to 1.4 of its prediction.",
            "columns": ["parameter", "mean error", "scatter", "predicted", "scatter / predicted", "within 2 sigma"],
            "rows": [
                [name, *(float(x) for x in row)]
                for name, *row in zip(
                    recoveries[0].names,
                    error.mean(axis=0),
                    error.std(axis=0, ddof=1),
                    predicted,
                    ratio,
                    within,
                    strict=True,
                )
            ],
            "passed": passed,
        },
    )
    assert 0.90 <= share <= 0.99
    assert np.all((ratio > 0.7) & (ratio < 1.4)), ratio


def _leave(name: str, found: dict[str, object]) -> None:
    folder = os.environ.get("SWASHPLATE_PROOF")
    if folder:
        Path(folder, f"{name}.json").write_text(json.dumps(found), encoding="utf-8")
