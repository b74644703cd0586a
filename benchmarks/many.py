"""4,096 vehicles at once on all cores, float64 and float32: their own C in lanes, and the same by `vmap` beside it."""

from __future__ import annotations

import time

import numpy as np

from benchmarks.timing import Result, best_rate
from swashplate.export.batch_c import fly_in_c
from swashplate.models.catalogue import vehicle as load_vehicle
from swashplate.simulation.batch import FlyBatch, fly_batch
from swashplate.simulation.dynamics import SURROUNDINGS, equations_of, parameter_row
from swashplate.simulation.trim import trim

TARGETS = {"float64": 12e6, "float32": 25e6}
"""Vehicle steps per second of CoaXes on two cores, in C."""
BY_JAX = {"float64": 0.8e6, "float32": 2.5e6}
VEHICLES = 4096


def batches(name: str, precision: str, *, steps: int, repeats: int, promised: bool = True) -> list[Result]:
    """The batch that `simulate_batch` runs, in C and by `vmap`: one card, inputs alike, starts that differ."""
    vehicle = load_vehicle(name)
    hover = trim(vehicle)
    x = np.repeat(hover.state[:, None], VEHICLES, axis=1)
    x[vehicle.index("p")] = np.linspace(-0.1, 0.1, VEHICLES)
    row = np.array([*hover.inputs, *(getattr(hover.environment, name) for name in SURROUNDINGS)])
    rows = np.tile(row[:, None], (steps + 1, 1, 1))
    p = parameter_row(vehicle, hover.environment)[:, None]
    arguments = tuple(np.asarray(values, precision) for values in (x, rows, p, 0.01))
    found = []
    for fly, how, targets in ((fly_in_c, "own C in lanes", TARGETS), (fly_batch, "vmap", BY_JAX)):
        seconds: list[float] = []

        def run(fly: FlyBatch = fly, seconds: list[float] = seconds) -> None:
            begin = time.process_time()
            fly(equations_of(vehicle), *arguments, keep=steps, held=True)
            seconds.append(time.process_time() - begin)

        rate = best_rate(run, steps * VEHICLES, repeats=repeats)
        note = f"vehicle steps, all cores; {1e9 * min(seconds) / (steps * VEHICLES):.0f} ns of processor time each"
        target = targets[precision] if promised else None
        found.append(Result(f"{VEHICLES} {name}, {how}, {precision}", rate, target, note))
    return found
