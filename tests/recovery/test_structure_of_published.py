"""Three published coupled helicopters flown in gusts: what the search for a structure makes of their sweeps alone."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import gusty_sweeps
import proof_page
import published_coupled as coupled

SEEDS = int(os.environ.get("SWASHPLATE_SEEDS", "20"))
"""Of each helicopter, every other one flown by hand."""
GUST = gusty_sweeps.GUSTS["light"]


def test_modes_are_held_against_the_truth() -> None:
    """Slow ones and those above what was swept are not asked for; one that is 10 % off is seen."""
    true = np.array([-0.2, -3.0 + 4.0j, -3.0 - 4.0j, -50.0])
    assert coupled.worst_mode(true[1:3], true, fastest=6.0) == 0.0
    assert coupled.worst_mode(1.1 * true, true, fastest=6.0) == pytest.approx(0.1)


def test_a_part_that_is_not_there_is_called_invented() -> None:
    assert coupled.own_states(["body", "flap", "lead", "actuators", "Za"]) == {"flap", "lead", "actuators"}


@pytest.mark.proof
@pytest.mark.parametrize("name", list(coupled.PUBLISHED))
def test_structures_of_published_helicopters_are_found(shared_data: Path, name: str) -> None:
    published = coupled.PUBLISHED[name](shared_data)
    rows: list[list[object]] = []
    right = np.zeros(3, dtype=int)
    for seed in range(SEEDS):
        kind = list(gusty_sweeps.SHAPES)[seed % 2]
        responses = coupled.responses_of(published, kind, gust=GUST, seed=seed)
        found = coupled.search_and_judge(published, responses, fastest=gusty_sweeps.BANDS[kind][1])
        right += found.right
        own_worst = None if found.own_worst is None else 100.0 * found.own_worst
        numbers = [found.J, 100.0 * found.worst, found.own, own_worst]
        rows.append([seed, kind, *(", ".join(parts) or "none" for parts in found.parts), *numbers])
        print(rows[-1], found.picked, flush=True)
        leave(name, rows, right)
    assert min(right) >= 0.9 * SEEDS, rows


def leave(name: str, rows: list[list[object]], right: np.ndarray) -> None:
    """The section so far."""
    proof_page.leave(
        f"structure_of_{name}",
        {
            "title": f"The structure of a published coupled helicopter, searched: {name}",
            "text": f"{len(rows)} seeds of 20; 8 sweeps of 120 s in gusts of {GUST} m/s and a hold, nothing more is "
            f"given. J within {coupled.DEARER} times that of the true structure: {right[0]}; every mode from "
            f"{coupled.SLOWEST} rad/s to the end of the sweep within 5 %: {right[1]}; no invented part: {right[2]} "
            "(18 of 20 wanted of each). Parts are those with states of their own.",
            "columns": [
                "seed",
                "flown",
                "invented",
                "missed",
                "J",
                "worst mode [%]",
                "J of the truth",
                "its worst mode [%]",
            ],
            "rows": rows,
            "passed": bool(len(rows) == 20 and min(right) >= 18),
        },
    )
