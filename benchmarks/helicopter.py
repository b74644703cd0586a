"""The single-rotor helicopter: simulation, trims and derivatives over speed, LPV as printed."""

from __future__ import annotations

import numpy as np

from benchmarks.timing import Result, best_rate
from swashplate.models.catalogue import vehicle
from swashplate.simulation.derivatives import derivative_table
from swashplate.simulation.integrate import simulate_open_loop
from swashplate.simulation.lpv import simulate_lpv
from swashplate.simulation.reduction import PAPER_INPUTS
from swashplate.simulation.trim import trim
from swashplate.simulation.trim_curve import trims_over_speed

SCAN_TARGET = 100_000.0
SPEEDS_TARGET = 50.0
LPV_TARGET = 100_000.0
"""Steps per second; trims with derivatives per second; steps per second (100 times real time at 1 kHz)."""


def scan(*, steps: int, repeats: int) -> Result:
    """`simulate` with flapping, bar and dynamic inflow (19 states), Runge-Kutta at 1 kHz."""
    flown = vehicle("raptor50", bar=True, inflow="pitt-peters")
    hover = trim(flown)
    inputs = np.tile(hover.inputs, (steps + 1, 1))

    def run() -> None:
        simulate_open_loop(flown, inputs, start=hover, rate=1000.0)

    return Result("helicopter, simulate", best_rate(run, steps, repeats=repeats), SCAN_TARGET, "19 states, float64")


def speeds(*, count: int, repeats: int) -> Result:
    """Trim and all 60 derivatives by contributor at `count` speeds, warm."""
    flown = vehicle("raptor50")
    wanted = np.linspace(0.0, 15.0, count)

    def run() -> None:
        for at in trims_over_speed(flown, wanted):
            derivative_table(flown, at)

    return Result(
        "trims with derivatives", best_rate(run, count, repeats=repeats), SPEEDS_TARGET, "per second, 0-15 m/s"
    )


def lpv(*, steps: int, repeats: int) -> Result:
    """The LPV scheme as printed: A and B anew at each step."""
    flown = vehicle("raptor50")
    hover = trim(flown)
    controls = {name: np.full(steps, hover.commands()[name]) for name in PAPER_INPUTS}

    def run() -> None:
        simulate_lpv(flown, controls, start=hover, scheme="as-printed", rate=1000.0)

    rate = best_rate(run, steps, repeats=repeats)
    return Result("LPV as printed", rate, LPV_TARGET, f"{rate / 1000.0:.0f} times real time at 1 kHz")
