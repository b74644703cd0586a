"""Simulation-based calibration (Talts et al. 2018): truths drawn from the prior rank anywhere among NUTS' draws."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

import proof_page
import swashplate as sp
from rolling import OUTPUTS_OF_ROLL, Numbers, Roll, Stick, rates, rolling
from swashplate.flights.flight import Flight, stream
from swashplate.physics.environment import Environment

FLIGHTS = int(os.environ.get("SWASHPLATE_SBC_FLIGHTS", "200"))
PRIOR = {"Lb": (60.0, 5.0), "tau": (0.2, 0.02), "A": (0.5, 0.04)}
NOISE = (0.02, 1.0, 0.05)
DT, SAMPLES, BINS = 0.02, 200, 10


def flight(truth: dict[str, float], random: Any) -> Flight:
    """Four seconds in calm air, stick moved at random, white noise on what is measured."""
    stick = 0.2 * np.sign(np.sin(3.0 * np.arange(SAMPLES) * DT)) + 0.05 * random.standard_normal(SAMPLES)
    x, rows, fine = np.zeros(2), [], 20
    for k in range(SAMPLES):
        after = stick[min(k + 1, SAMPLES - 1)]
        dx = np.array(rates(Roll(*x), Stick(stick[k]), Numbers(**truth), Environment(), None))  # type: ignore[arg-type]
        rows.append([x[0], dx[0], 9.81 * x[1]])
        for j in range(fine):
            u = stick[k] + (j + 0.5) / fine * (after - stick[k])  # inputs are straight between samples
            dx = np.array(rates(Roll(*x), Stick(u), Numbers(**truth), Environment(), None))  # type: ignore[arg-type]
            x = x + DT / fine * dx
    seen = np.array(rows) + random.standard_normal((SAMPLES, 3)) * NOISE
    columns = {"stick": stick, **dict(zip(OUTPUTS_OF_ROLL, seen.T, strict=True))}
    return Flight({"uniform": stream(np.arange(SAMPLES) * DT, columns, {"stick": "1"})})


def rank(seed: int) -> list[float]:
    """Share of the draws below the truth, by parameter."""
    random = np.random.default_rng(seed)
    truth = {name: float(mean + sigma * random.standard_normal()) for name, (mean, sigma) in PRIOR.items()}
    fit = sp.identify(
        rolling(), flight(truth, random), free=list(PRIOR), priors=PRIOR, outputs=OUTPUTS_OF_ROLL, method="output-error"
    )
    drawn = sp.posterior(fit, method="nuts", chains=2, warmup=60, draws=2000, seed=seed).posterior
    assert drawn is not None
    return [float(np.mean(drawn.values[:, i] < truth[n])) for i, n in enumerate(PRIOR)]


@pytest.mark.proof
def test_the_ranks_of_the_truth_are_uniform() -> None:
    ranks = np.array([rank(seed) for seed in range(FLIGHTS)])
    counts = np.stack([np.histogram(own, bins=BINS, range=(0.0, 1.0))[0] for own in ranks.T])
    expected = FLIGHTS / BINS
    likely = [float(chi2.sf(np.sum((own - expected) ** 2 / expected), BINS - 1)) for own in counts]
    within = [np.mean(np.abs(ranks - 0.5) <= 0.5 * share, axis=0) for share in (0.5, 0.95)]
    passed = bool(min(likely) > 0.01 / len(PRIOR))
    proof_page.leave(
        "posterior_calibration",
        {
            "title": f"Simulation-based calibration of the posterior, {FLIGHTS} flights",
            "text": "Truths drawn from the prior, flights simulated, NUTS run: ranks of the truth among the draws are "
            "uniform where the posterior holds.",
            "columns": ["parameter", "probability of the histogram", "within the 50 % band", "within the 95 % band"],
            "rows": [[n, p, float(a), float(b)] for n, p, a, b in zip(PRIOR, likely, *within, strict=True)],
            "passed": passed,
        },
    )
    print(ranks.mean(axis=0), within, likely)
    assert passed, (likely, counts)
