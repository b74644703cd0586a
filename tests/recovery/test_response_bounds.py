"""Known truth: fits to responses of sweeps in gusts scatter as their bounds say, and so do models drawn from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import gusty_sweeps
import proof_page
import r50
from swashplate.arrays import Array
from swashplate.errors import IdentificationError
from swashplate.identification.frequency.state_space_fit import fit_state_space
from swashplate.identification.frequency.state_space_result import StateSpaceFit
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.responses.respond import respond
from swashplate.models.linear.state_space import StateSpaceModel

BAND = (0.05, 6.0)
SEEDS = 25
PROMISED = (92.0, 98.0)
"""Percent of all numbers that have to lie within two of their standard deviations."""
DRAWS = 200


@pytest.fixture(scope="module")
def truth(shared_data: Path) -> StateSpaceModel:
    return r50.truth(shared_data)


@dataclass(frozen=True)
class Recovered:
    """One fit: its errors in its own standard deviations, and in those of models drawn from it (NaN: none).

    `wrong` counts numbers whose sign is wrong although zero lies beyond two standard deviations; `silent` those of the
    wrong sign of which no warning says so.
    """

    names: tuple[str, ...]
    distance: Array
    of_draws: Array
    wrong: int
    silent: int


def responses(truth: StateSpaceModel, kind: str, gust: str, seed: int) -> FrequencyResponse:
    flights = gusty_sweeps.fly(
        truth,
        [
            gusty_sweeps.Question(axis, kind, gusty_sweeps.GUSTS[gust], 1000 * seed + k)
            for k, axis in enumerate(truth.inputs)
        ],
    )
    return respond(flights, inputs=truth.inputs, outputs=truth.outputs, band=BAND, bystanders=())


def recovered(truth: StateSpaceModel, fit: StateSpaceFit) -> Recovered:
    true = np.array([truth.parameters[n].value for n in fit.names])
    value, sigma = (np.array([getattr(fit[n], part) for n in fit.names]) for part in ("value", "best_sigma"))
    try:
        drawn = np.stack(list(fit.draw_values(DRAWS, seed=0).values()), axis=1)[:, : len(fit.names)]
        of_draws = (value - true) / drawn.std(axis=0)
    except IdentificationError:  # most draws would lie beyond the bounds of physics, and it says so
        of_draws = np.full(true.size, np.nan)
    wrong = (np.sign(value) != np.sign(true)) & (np.abs(value) > 0.0)
    told = [text for text in fit.warnings if "do not tell the sign" in text]
    assert len(told) <= 1
    listed = np.abs(value) < 2.0 * sigma
    assert bool(told) == bool(np.any(listed))
    return Recovered(fit.names, (value - true) / sigma, of_draws, int(np.sum(wrong & ~listed)), int(np.sum(wrong)))


def within(distances: Sequence[Array]) -> float:
    every = np.concatenate(distances)
    return 100.0 * float(np.mean(np.abs(every[np.isfinite(every)]) < 2.0))


def test_a_few_fits_scatter_as_their_bounds_say(truth: StateSpaceModel) -> None:
    """The short form. Bounds that take lines and outputs for independent held 80 % of such numbers, at 1.65 sigma."""
    cases = [("automatic", "light", 1), ("by hand", "light", 2)]
    found = [recovered(truth, fit_state_space(truth, responses(truth, *case), starts=1)) for case in cases]
    every = np.concatenate([one.distance for one in found])
    assert every.size > 70
    assert np.mean(np.abs(every) < 2.0) > 0.88
    assert 0.6 < np.sqrt(np.mean(every**2)) < 1.3
    assert np.max(np.abs(every)) < 5.0
    draws = np.concatenate([one.of_draws for one in found])
    near = np.isfinite(draws)
    assert near.sum() > 35
    np.testing.assert_allclose(np.median(np.abs(draws[near] / every[near])), 1.0, atol=0.1)
    assert sum(one.wrong for one in found) <= 2


@pytest.mark.proof
def test_fits_of_many_seeds_scatter_as_their_bounds_say(truth: StateSpaceModel) -> None:
    rows: list[list[object]] = []
    by_kind: dict[str, list[Recovered]] = {kind: [] for kind in gusty_sweeps.SHAPES}
    for kind in gusty_sweeps.SHAPES:
        for gust in ("none", "light", "moderate"):
            found = [
                recovered(truth, fit_state_space(truth, responses(truth, kind, gust, seed), starts=1))
                for seed in range(SEEDS)
            ]
            by_kind[kind] += found
            every = np.concatenate([one.distance for one in found])
            rows.append(
                [
                    kind,
                    gust,
                    every.size,
                    within([one.distance for one in found]),
                    float(np.sqrt(np.mean(every**2))),
                    float(np.max(np.abs(every))),
                    within([one.of_draws for one in found]),
                    sum(one.wrong for one in found),
                    sum(one.silent for one in found),
                ]
            )
    shares = {kind: within([one.distance for one in found]) for kind, found in by_kind.items()}
    drawn = {kind: within([one.of_draws for one in found]) for kind, found in by_kind.items()}
    passed = all(PROMISED[0] <= share <= PROMISED[1] for share in (*shares.values(), *drawn.values()))
    proof_page.leave(
        "response_bounds",
        {
            "title": "Bounds of fits to responses of sweeps in gusts",
            "text": f"{SEEDS} seeds in each of six conditions: four records of 120 s of the published R-50 in a hold, "
            "flown by a program and by hand, no reference recorded; 13 states, up to 36 numbers a fit. Within two of "
            "their own standard deviations lie "
            + " and ".join(f"{share:.1f} % ({kind})" for kind, share in shares.items())
            + ", within two of those of models drawn from the fits "
            + " and ".join(f"{share:.1f} %" for share in drawn.values())
            + f" ({PROMISED[0]:g} to {PROMISED[1]:g} wanted).",
            "columns": [
                "flown",
                "gusts",
                "numbers",
                "within two sigma [%]",
                "rms [sigma]",
                "largest [sigma]",
                "within two of the draws [%]",
                "wrong sign, told",
                "wrong sign",
            ],
            "rows": rows,
            "passed": passed,
        },
    )
    assert passed, (shares, drawn)
