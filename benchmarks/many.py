"""4,096 CoaXes at once on all cores, float64 and float32."""

from __future__ import annotations

import numpy as np

from benchmarks.timing import Result, best_rate
from swashplate.models.catalogue import vehicle as load_vehicle
from swashplate.simulation.batch import fly_batch
from swashplate.simulation.dynamics import SURROUNDINGS, equations_of, parameter_row
from swashplate.simulation.trim import trim

TARGETS = {"float64": 0.8e6, "float32": 2.5e6}
VEHICLES = 4096


def batch(precision: str, *, steps: int, repeats: int) -> Result:
    """The batch that `simulate_batch` runs: one card, inputs alike, starts that differ."""
    vehicle = load_vehicle("coax")
    hover = trim(vehicle)
    x = np.repeat(hover.state[:, None], VEHICLES, axis=1)
    x[vehicle.index("p")] = np.linspace(-0.1, 0.1, VEHICLES)
    row = np.array([*hover.inputs, *(getattr(hover.environment, name) for name in SURROUNDINGS)])
    rows = np.tile(row[:, None], (steps + 1, 1, 1))
    p = parameter_row(vehicle, hover.environment)[:, None]
    arguments = tuple(np.asarray(values, precision) for values in (x, rows, p, 0.01))

    def run() -> None:
        fly_batch(equations_of(vehicle), *arguments, keep=steps, held=True)

    rate = best_rate(run, steps * VEHICLES, repeats=repeats)
    return Result(f"{VEHICLES} vehicles, vmap, {precision}", rate, TARGETS[precision], "vehicle steps, all cores")
