"""What options of the rotors cost: steps per second with each over those without, on and off by turns in one run."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.timing import Result, best_rate
from swashplate.models.catalogue import vehicle
from swashplate.simulation.integrate import simulate_open_loop
from swashplate.simulation.trim import trim

CASES: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("raptor50", "tip_loss", {"tip_loss": True}),
    ("raptor50", "induced_factor", {"induced_factor": True}),
    ("raptor50", "ground_effect", {"ground_effect": "cheeseman-bennett"}),
)
SHORT = CASES[:1]
"""Whose plain loop another benchmark has compiled; each of the others compiles a trim and a loop, for 8 s."""


def _loop(name: str, options: dict[str, Any], steps: int) -> Any:
    flown = vehicle(name, **options)
    hover = trim(flown)
    inputs = np.tile(hover.inputs, (steps + 1, 1))
    return lambda: simulate_open_loop(flown, inputs, start=hover, rate=500.0)


def rotor_options(*, steps: int, repeats: int, short: bool) -> list[Result]:
    """One result each: the rate with the option, and in its note the share of the rate without."""
    cases = SHORT if short else CASES
    plain = {name: _loop(name, {}, steps) for name in dict.fromkeys(name for name, _, _ in cases)}
    results = []
    for name, said, options in cases:
        with_it = _loop(name, options, steps)
        rates = [0.0, 0.0]
        for _ in range(repeats):
            for place, run in enumerate((plain[name], with_it)):
                rates[place] = max(rates[place], best_rate(run, steps, repeats=1))
        note = f"{rates[1] / rates[0]:.2f} of {rates[0]:,.0f} without"
        results.append(Result(f"{name}, {said}", rates[1], None, note))
    return results
