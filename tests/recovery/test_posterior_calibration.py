"""Simulation-based calibration (Talts et al. 2018): truths from the prior rank anywhere among a posterior's draws.

Flights of two seconds tell three times as much as the prior, so that the posterior needs both, and is a little skewed.
Each sampler is asked on the same flights, and the test itself is asked whether it sees draws that are too narrow.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

import proof_page
import swashplate as sp
from rolling import OUTPUTS_OF_ROLL, Numbers, Roll, Stick, rates, rolling
from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.flights.flight import Flight, stream
from swashplate.physics.environment import Environment

FLIGHTS = int(os.environ.get("SWASHPLATE_SBC_FLIGHTS", "200"))
PRIOR = {"Lb": (60.0, 5.0), "tau": (0.2, 0.02), "A": (0.5, 0.04)}
NOISE = (0.1, 5.0, 0.25)
GUSTS = (0.5, 0.02)
"""White noise on the rates of the two states, per root of Hz."""
DT, SAMPLES, FINE, BINS = 0.02, 100, 20, 10
LEAST = 0.01
"""Probability of the least likely histogram of all; each is asked for its share of it."""


def flight(truth: dict[str, float], random: Any, gusts: tuple[float, float] | None) -> Flight:
    """Two seconds with a stick that is moved at random, white noise on what is measured."""
    stick = 0.2 * np.sign(np.sin(3.0 * np.arange(SAMPLES) * DT)) + 0.05 * random.standard_normal(SAMPLES)
    x, rows, numbers, air = np.zeros(2), [], Numbers(**truth), Environment()
    for k in range(SAMPLES):
        after = stick[k] if gusts else stick[min(k + 1, SAMPLES - 1)]
        dx = np.array(rates(Roll(*x), Stick(stick[k]), numbers, air, None))  # type: ignore[arg-type]
        rows.append([x[0], dx[0], 9.81 * x[1]])
        for j in range(FINE):
            u = stick[k] + (j + 0.5) / FINE * (after - stick[k])  # output error: straight between samples
            dx = np.array(rates(Roll(*x), Stick(u), numbers, air, None))  # type: ignore[arg-type]
            x = x + DT / FINE * dx
            if gusts:
                x = x + np.array(gusts) * np.sqrt(DT / FINE) * random.standard_normal(2)
    seen = np.array(rows) + random.standard_normal((SAMPLES, 3)) * NOISE
    columns = {"stick": stick, **dict(zip(OUTPUTS_OF_ROLL, seen.T, strict=True))}
    return Flight({"uniform": stream(np.arange(SAMPLES) * DT, columns, {"stick": "1"})})


def ranked(seed: int, *, gusts: bool) -> dict[str, Array]:
    """By sampler: shares of the draws below the truth (parameters,), of draws as they are and of half their width."""
    random = np.random.default_rng([seed, gusts])
    truth = {name: float(mean + sigma * random.standard_normal()) for name, (mean, sigma) in PRIOR.items()}
    flown = flight(truth, random, GUSTS if gusts else None)
    method = "filter-error" if gusts else "output-error"
    fit = sp.identify(rolling(), flown, free=list(PRIOR), prior=PRIOR, outputs=OUTPUTS_OF_ROLL, method=method)
    asked: dict[str, dict[str, Any]] = {"laplace": {}, "nuts": {"chains": 2, "warmup": 60, "draws": 2000}}
    found = {}
    for name, how in asked.items():
        drawn = sp.posterior(fit, method=name, seed=seed, **how).posterior
        assert drawn is not None
        middle, true = drawn.values.mean(axis=0), np.array(list(truth.values()))
        found[name] = np.array(
            [np.mean(middle + width * (drawn.values - middle) < true, axis=0) for width in (1.0, 0.5)]
        )
    return found


def histogram(ranks: Array) -> tuple[Array, float]:
    """Counts in bins of equal probability, and how likely a worse one is."""
    counts = np.histogram(ranks, bins=BINS, range=(0.0, 1.0))[0]
    expected = ranks.size / BINS
    return counts, float(chi2.sf(np.sum((counts - expected) ** 2) / expected, BINS - 1))


@pytest.mark.proof
def test_the_ranks_of_the_truth_are_uniform() -> None:
    found: dict[tuple[str, str], list[Array]] = {}
    refused: list[str] = []
    for gusts, air in ((False, "calm air"), (True, "gusts")):
        for seed in range(FLIGHTS):
            try:
                for name, shares in ranked(seed, gusts=gusts).items():
                    found.setdefault((air, name), []).append(shares)
            except IdentificationError as error:
                refused.append(f"{air} {seed}: {error}")
    least = LEAST / (len(PRIOR) * len(found))
    rows, likely, mutated = [], [], []
    for (air, name), shares in found.items():
        for parameter, (own, narrow) in zip(PRIOR, np.array(shares).transpose(2, 1, 0), strict=True):
            counts, chance = histogram(own)
            within = [float(np.mean(np.abs(own - 0.5) <= 0.5 * share)) for share in (0.5, 0.95)]
            likely.append(chance)
            mutated.append(histogram(narrow)[1])
            told = " ".join(map(str, counts))
            rows.append([air, name, parameter, len(own), told, chance, mutated[-1], *(100.0 * w for w in within)])
    passed = min(likely) > least and max(mutated) < least and not refused
    proof_page.leave(
        "posterior_calibration",
        {
            "title": f"Simulation-based calibration of the posterior, {FLIGHTS} flights in calm air and in gusts",
            "text": "Truths drawn from the prior, flights of two seconds simulated (two states in roll), fitted by "
            "output error in calm air and by filter error in gusts, posteriors drawn: the truth's rank among the draws "
            "is uniform where the posterior holds. Each histogram must be more likely than "
            f"{least:.2g} ({LEAST:g} shared by all), and draws of half the width must not be. "
            f"Refused: {len(refused)}.",
            "columns": [
                "air",
                "draws by",
                "parameter",
                "flights",
                "histogram of ranks",
                "its probability",
                "with half the width",
                "within the 50 % band [%]",
                "within the 95 % band [%]",
            ],
            "rows": rows,
            "passed": bool(passed),
        },
    )
    print("\n".join(map(str, rows)), *refused, sep="\n")
    assert not refused
    assert min(likely) > least
    assert max(mutated) < least
