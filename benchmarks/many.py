"""4,096 vehicles at once on all cores, float64 and float32, as users fly them: their own C in lanes."""

from __future__ import annotations

import time

import numpy as np

from benchmarks.timing import Result, best_rate
from swashplate.api.simulate_batch import simulate_batch
from swashplate.models.catalogue import vehicle as load_vehicle
from swashplate.simulation.closed_loop_batch import Precision
from swashplate.simulation.trim import trim

TARGETS = {"float64": 12e6, "float32": 25e6}
"""Vehicle steps per second of CoaXes on two cores, in C."""
VEHICLES = 4096


def batches(name: str, precision: Precision, *, steps: int, repeats: int, promised: bool = True) -> list[Result]:
    """`simulate_batch`: one card, inputs alike, starts that differ."""
    vehicle = load_vehicle(name)
    hover = trim(vehicle)
    start = {**hover.states(), "p": np.linspace(-0.1, 0.1, VEHICLES)}
    inputs = {n: np.full(steps + 1, value) for n, value in zip(vehicle.input_names, hover.inputs, strict=True)}
    seconds: list[float] = []

    def run() -> None:
        begin = time.process_time()
        simulate_batch(
            vehicle, inputs, start=start, environment=hover.environment, keep=steps, precision=precision
        )  # fmt: skip
        seconds.append(time.process_time() - begin)

    rate = best_rate(run, steps * VEHICLES, repeats=repeats)
    note = f"vehicle steps, all cores; {1e9 * min(seconds) / (steps * VEHICLES):.0f} ns of processor time each"
    target = TARGETS[precision] if promised else None
    return [Result(f"{VEHICLES} {name}, own C in lanes, {precision}", rate, target, note)]
